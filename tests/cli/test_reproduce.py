"""Published results and printed tables that ``remoras reproduce`` measures again."""

import json
import random
import shlex
import tomllib
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from missions.scenarios import load
from remoras.cli import app
from remoras.cli.app import HOMES, OrderedGroup
from remoras.cli.reproduction import entries as module
from remoras.cli.reproduction import measures
from remoras.cli.reproduction.entries import AGREES, DEVIATES, Entry, Row, entries
from remoras.cli.runs import overrides_of

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
@pytest.mark.thorough
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


def test_milestone_that_is_not_reached_deviates() -> None:
    """Without weight of signals AUV00 never gives up: the entry of the six times fails and names the value."""
    values = {"run": module.Measured([{"milestones": [], "mission_time_s": 2145.0}])}
    rows = ENTRIES["remoras-times"].rows
    assert {row.outcome(values).measured for row in rows} == {"none"}
    assert all(row.outcome(values).fails for row in rows)


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


# Items of the papers --------------------------------------------------------------------------------

PAPERS = tomllib.loads((module.ROOT / "docs" / "papers.toml").read_text(encoding="utf-8"))["section"]
ITEMS = [tuple(item) for section in PAPERS for item in section["items"]]
COMMANDS = sorted({f"remoras {detail}" for _, verdict, detail in ITEMS if verdict == "works"})
CHEAP = ("explain", "list")
"""Commands that take milliseconds, so that the usual suite runs them."""


def parts(command: str) -> list[list[str]]:
    """Arguments of each ``remoras`` command of a line."""
    split = [shlex.split(part) for part in command.split(" && ")]
    assert all(words[0] == "remoras" for words in split)
    return [words[1:] for words in split]


def test_every_item_has_a_verdict_with_a_command_or_a_reason() -> None:
    assert {verdict for _, verdict, _ in ITEMS} == {"works", "deviates", "missing"}
    assert all(detail for _, _, detail in ITEMS)
    assert len({text for text, _, _ in ITEMS}) > 0.95 * len(ITEMS)


@pytest.mark.parametrize("command", COMMANDS)
def test_command_of_an_item_is_accepted(command: str) -> None:
    """Its options parse, and its scenario loads with them; its key or entry exists."""
    for name, *arguments in parts(command):
        assert name in HOMES
        if "--help" in arguments or name in CHEAP:
            assert CliRunner().invoke(app, [name, *arguments]).exit_code == 0
            continue
        made = OrderedGroup().get_command(None, name)
        assert made is not None
        given = made.make_context(name, list(arguments)).params
        if name == "run":
            options = (given[key] for key in ("strategy", "policy", "channel", "network", "per"))
            load(given["scenario"], overrides_of(*options, given["settings"] or []))
        if name == "reproduce":
            assert set(given["names"]) <= set(ENTRIES)


@pytest.mark.slow
@pytest.mark.thorough
@pytest.mark.parametrize(
    "command", random.Random(2011).sample([c for c in COMMANDS if c.split()[1] not in (*CHEAP, "new", "node")], 10)
)
def test_command_of_an_item_succeeds(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for arguments in parts(command):
        result = CliRunner().invoke(app, arguments)
        assert result.exit_code == 0, result.output
