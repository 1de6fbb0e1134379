"""A line of the ledger counts once it is on the disk."""

import os
from pathlib import Path
from typing import Any

import pytest
from failing_disk import FailingDisk

from missions.errors import OutputError
from missions.sweeps.ledger import LINE_KEYS, RunLedger


def line(key: str) -> dict[str, Any]:
    return {**dict.fromkeys(LINE_KEYS), "key": key, "summary": {}}


def test_a_line_is_synced_after_it_was_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ledger = RunLedger(tmp_path / "ledger.jsonl")
    write, done = os.write, []
    monkeypatch.setattr(os, "write", lambda file, content: done.append("written") or write(file, content[:7]))
    monkeypatch.setattr(os, "fsync", lambda file: done.append("synced"))
    ledger.append([line("one")])
    assert done.count("synced") >= 1
    assert done[-1] == "synced"
    ledger.close()


@pytest.mark.parametrize(
    ("operation", "fault"), [("write", "error"), ("write", "short"), ("write", "dead"), ("fsync", "dead")]
)
def test_a_disk_that_takes_no_line_and_cuts_none_off_is_named_and_the_lines_before_are_kept(
    tmp_path: Path, operation: str, fault: str
) -> None:
    path = tmp_path / "ledger.jsonl"
    ledger = RunLedger(path)
    ledger.append([line("one")])
    with pytest.MonkeyPatch.context() as patch:
        FailingDisk(patch, operation, fault).fail_at(1)
        with pytest.raises(OutputError, match=r"ledger\.jsonl: cannot be written: "):
            ledger.append([line("two")])
    assert set(ledger.lines) == {"one"}
    ledger.close()
    again = RunLedger(path)
    assert "one" in again.lines
    again.append([line("three")])
    assert set(again.lines) >= {"one", "three"}
    again.close()
    assert path.read_bytes().count(b"\n") == len(again.lines)
