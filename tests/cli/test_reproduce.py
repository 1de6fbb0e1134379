"""Published results and printed tables that ``remoras reproduce`` measures again."""

import json
from typing import Any

import pytest
from typer.testing import CliRunner

from remoras.cli import app
from remoras.cli.reproduction import entries as module
from remoras.cli.reproduction import measures
from remoras.cli.reproduction.entries import AGREES, DEVIATES, Entry, Row, entries

ENTRIES = entries()
FIGURES = ("exchange-figure-3", "exchange-figure-4", "exchange-figure-5")
QUICK = ("remoras-table-1", "remoras-table-2", "remoras-figure-5", "exchange-section-5", "manager-slot", "link-axioms",
         "known-places")  # fmt: skip
"""Entries that take a second or two."""


def called(*arguments: str) -> Any:
    return CliRunner().invoke(app, ["reproduce", *arguments], env={"COLUMNS": "200"})


@pytest.mark.parametrize("entry", ENTRIES.values(), ids=lambda entry: entry.name)
def test_every_entry_has_a_source_and_a_recipe(entry: Entry) -> None:
    """Lines stand on their page, measures exist, studies exist; an entry that cannot be measured says why."""
    assert entry.origin
    assert entry.recipe or entry.unavailable
    assert not entry.measure or hasattr(measures, entry.measure)
    assert bool(entry.rows) != bool(entry.lines or entry.command or entry.unavailable) or entry.measure
    for line in entry.printed():
        line.printed()


def test_names_of_entries_are_unique() -> None:
    assert len(called("--list").stdout.splitlines()) == len(ENTRIES)
    files = [(module.HERE / f"{name}.toml").read_text(encoding="utf-8") for name in ("published", "printed")]
    assert sum(text.count("[[entry]]") for text in files) == len(ENTRIES)


@pytest.mark.parametrize("name", QUICK)
def test_quick_results_have_their_verdicts(name: str) -> None:
    result = called(name, "--json")
    assert result.exit_code == 0, result.stdout
    (entry,) = json.loads(result.stdout)["entries"]
    assert all(row["verdict"] == AGREES or row["reason"] for row in entry["rows"])


@pytest.mark.slow
def test_all_quick_entries_have_their_verdicts() -> None:
    result = called()
    assert result.exit_code == 0, result.stdout
    assert "skipped, more than ten minutes each: " in result.stdout


@pytest.mark.slow
def test_exchange_figures_hold_with_the_trials_of_the_paper() -> None:
    values = measures.exchange_figures(trials=2000)
    rows = [row for name in FIGURES for row in ENTRIES[name].rows]
    assert [row.quantity for row in rows if row.outcome(values).verdict != AGREES] == []


@pytest.mark.parametrize(
    ("row", "value", "verdict", "fails"),
    [
        (Row(quantity="q", expected=100.0, within=0.02, value="{v}"), 101.9, AGREES, False),
        (Row(quantity="q", expected=100.0, within=0.02, value="{v}"), 102.1, DEVIATES, True),
        (Row(quantity="q", expected=(1.0, 2.0), value="{v}"), 2.0, AGREES, False),
        (Row(quantity="q", expected=(1.0, 2.0), value="{v}"), 2.01, DEVIATES, True),
        (Row(quantity="q", expected="a, b", value="{v}"), "a, c", DEVIATES, True),
        (Row(quantity="q", expected=1.0, value="{v}", known=5.0, deviates="why"), 5.2, DEVIATES, False),
        (Row(quantity="q", expected=1.0, value="{v}", known=5.0, deviates="why"), 6.0, DEVIATES, True),
        (Row(quantity="q", expected=1.0, value="{v}", known=5.0, deviates="why"), 1.0, AGREES, False),
    ],
)
def test_verdict_of_a_row(row: Row, value: float | str, verdict: str, fails: bool) -> None:
    """A known deviation excuses only the value that is known."""
    outcome = row.outcome({"v": value})
    assert (outcome.verdict, outcome.fails) == (verdict, fails)


def test_command_fails_if_a_result_does_not_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measures, "exchange_selection", lambda: dict.fromkeys(
        ("urgent", "old", "sent", "frame_s", "slot_s"), 6.0
    ))  # fmt: skip
    result = called("manager-slot")
    assert result.exit_code == 1
    assert "deviates  step 7: weight once sent: expected 0, measured 6" in result.stdout


def test_result_out_of_reach_says_why() -> None:
    result = called("contract-net-auctions", "measured-seas")
    assert result.exit_code == 0
    assert "not measurable: positions, speeds" in result.stdout
    assert "python -m benchmarks.seas 1:4" in result.stdout


def test_unknown_name_is_refused_in_one_line() -> None:
    result = called("remoras-tims")
    assert result.exit_code == 2
    assert len(result.stderr.splitlines()) == 1
    assert "remoras-times" in result.stderr
