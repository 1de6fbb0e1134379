"""A line of the ledger counts once it is on the disk."""

import os
from pathlib import Path

import pytest

from missions.sweeps.ledger import LINE_KEYS, RunLedger


def test_a_line_is_synced_after_it_was_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ledger = RunLedger(tmp_path / "ledger.jsonl")
    write, done = os.write, []
    monkeypatch.setattr(os, "write", lambda file, content: done.append("written") or write(file, content[:7]))
    monkeypatch.setattr(os, "fsync", lambda file: done.append("synced"))
    ledger.append([{**dict.fromkeys(LINE_KEYS), "key": "one", "summary": {}}])
    assert done.count("synced") >= 1
    assert done[-1] == "synced"
    ledger.close()
