"""The commands benchmark and check."""

import json
from pathlib import Path

import pytest
from invoked import refused, remoras
from short_suite import SHORT

from missions.sweeps.ledger import LEDGER


@pytest.fixture
def suite(tmp_path: Path) -> Path:
    path = tmp_path / "short.toml"
    path.write_text(SHORT, encoding="utf-8")
    return path


@pytest.mark.slow
def test_a_benchmark_writes_card_tables_and_citation_and_can_be_verified(suite: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = ("benchmark", suite, "--strategy", "cbba", "--repeats", 1, "--jobs", 1, "--out", out, "--json")
    done = remoras(*command)
    assert done.exit_code == 0, done.output
    card = json.loads((out / "card.json").read_text())
    assert json.loads(done.stdout)["strategies"][0]["score"] == card["strategies"][0]["score"]
    assert {path.name for path in out.iterdir()} == {"card.json", "cite.bib", "runs", "table.md", "table.tex"}
    written, ledger = (out / "card.json").read_bytes(), out / "runs" / LEDGER
    made = ledger.read_bytes().splitlines(keepends=True)
    ledger.write_bytes(b"".join(made[:1]))  # as a kill after the first run leaves it
    (out / "card.json").unlink()
    assert remoras(*command).exit_code == 0
    assert ((out / "card.json").read_bytes(), len(ledger.read_bytes().splitlines())) == (written, len(made))
    again = remoras("benchmark", suite, "--verify", out / "card.json", "--runs", 2, "--json")
    assert again.exit_code == 0, again.output
    shown = json.loads(again.stdout)
    assert (shown["verified"], shown["of"], shown["other_code"], shown["other"]) == (2, 2, {}, {})


def test_an_invalid_result_card_is_reported(suite: Path, tmp_path: Path) -> None:
    (tmp_path / "card.json").write_text("[]")
    assert "no card of a benchmark" in refused("benchmark", suite, "--verify", tmp_path / "card.json")


@pytest.mark.slow
def test_a_folder_of_other_runs_is_refused(suite: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    begin = "benchmark", suite, "--jobs", 1, "--out", out
    assert remoras(*begin, "--strategy", "cbba", "--repeats", 2).exit_code == 0
    message = refused(*begin, "--strategy", "cbba", "--repeats", 1)
    assert "repeats" in message
    assert "name another folder" in message
    assert "--accept-code" not in message


def test_a_nonconforming_strategy_is_refused_before_any_run(
    suite: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mute.py").write_text(
        "from dataclasses import dataclass\n"
        "from typing import ClassVar\n"
        "from remoras.strategies.remoras import Remoras\n"
        "from remoras.strategy import Declaration\n"
        "@dataclass(frozen=True)\n"
        "class Mute(Remoras):\n"
        "    name: ClassVar[str] = 'mute'\n"
        "    declaration: ClassVar = Declaration(source='', messages={})\n"
    )
    done = remoras("benchmark", suite, "--strategy", "mute.py:Mute", "--out", tmp_path / "out")
    assert done.exit_code == 1
    assert "does not conform" in done.stderr
    assert not (tmp_path / "out").exists()
    assert remoras("check", "strategy", "mute.py:Mute").exit_code == 1
