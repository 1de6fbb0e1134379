"""Invariance of missions under renamed vehicles, reordered tables in files, and a translated world."""

from __future__ import annotations

import math
import re
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from sampling import sampled

from missions.runs.run import Run, run
from missions.scenarios import load, shipped
from remoras.recorder import PLANS
from remoras.strategies import strategies

NAMES = {"ASV00": "Zulu", "AUV00": "Yankee", "AUV01": "Mike", "AUV02": "Alfa"}
"""The alphabet turns the order of the nodes round."""
SHIFT_M = 1000.0, -500.0
TOLERANCE_M = 1e-6
"""Positions are of the order of 1 km, and each tick rounds to 1e-13 of that."""
TOLERANCE_S = 4.0
"""Two periods of decision."""


def text_of(scenario: str) -> str:
    return shipped()[scenario].read_text(encoding="utf-8")


def of(text: str, tmp_path: Path, strategy: str, per: float, *keys: str) -> Run:
    """A run of a scenario that is written out as a file, with further keys set."""
    file = tmp_path / "scenario.toml"
    file.write_text(text, encoding="utf-8")
    return run(load(str(file), [("--set", key) for key in (f"strategy.name={strategy}", f"channel.per={per}", *keys)]))


def renamed(found: Any) -> Any:
    """The same text, row or value with the other names."""
    if isinstance(found, str):
        for name, other in NAMES.items():
            found = found.replace(name, other)
        return found
    return tuple(map(renamed, found)) if isinstance(found, list | tuple) else found


def tables(finished: Run) -> dict[str, list[Any]]:
    recorder = finished.recorder
    return {
        name: [tuple(tuple(v) if isinstance(v, list) else v for v in row) for row in recorder.rows(name)]
        for name in recorder.tables
    }


def with_last_first(text: str, header: str) -> str:
    """The same text with tables of that header in reverse order, in every group apart."""
    found = []
    for part in re.split(r"(?m)^(?=\[\[group\]\]|\[fleet\])", text):
        before, *rest = part.split(header)
        found.append(before + "".join(f"{header}{one.rstrip()}\n\n" for one in reversed(rest)))
    return "".join(found)


def shifted(text: str) -> str:
    """The same text with every position elsewhere."""
    east_m, north_m = SHIFT_M

    def moved(line: re.Match[str]) -> str:
        return re.sub(
            r"\[(-?[\d.]+), (-?[\d.]+)\]", lambda at: f"[{float(at[1]) + east_m}, {float(at[2]) + north_m}]", line[0]
        )

    text = re.sub(r"(?m)^(corners_m|position_m|start_m) = .*$", moved, text)
    for key, by_m in (("x_m", east_m), ("y_m", north_m)):
        ends = re.search(rf"(?m)^{key} = \[(.*), (.*)\]$", text)
        text = text.replace(ends[0], f"{key} = [{float(ends[1]) + by_m}, {float(ends[2]) + by_m}]")
    return text


@pytest.mark.slow
@pytest.mark.parametrize("strategy", sampled(sorted(strategies()), "contract-net"))
def test_renaming_vehicles_changes_names_only(strategy: str, tmp_path: Path) -> None:
    """It fails if a tie is broken by name, or names are sorted anywhere that decides: in a claim, a succession."""
    text = text_of("mapping-rendezvous")
    usual = tables(of(text, tmp_path, strategy, 0.5))
    found = tables(of(renamed(text), tmp_path, strategy, 0.5))
    for name, rows in usual.items():
        assert found[name] == [renamed(row) for row in rows], name


def without_numbers(rows_of: dict[str, list[Any]]) -> dict[str, list[Any]]:
    """The same tables with names of statuses that say origin and time alone."""

    def plain(value: object) -> object:
        if isinstance(value, tuple):
            return tuple(map(plain, value))
        return re.sub(r"^(\d+@[\d.]+):\d+\.\d+$", r"\1", value) if isinstance(value, str) else value

    return {name: [tuple(map(plain, row)) for row in rows] for name, rows in rows_of.items()}


@pytest.mark.slow
@pytest.mark.parametrize("strategy", sampled(sorted(strategies()), "cbba"))
def test_the_order_of_tables_changes_nothing(strategy: str, tmp_path: Path) -> None:
    """It fails if jobs or vehicles are taken as the file lists them, where several are as good: slots are given.

    The facts of one plan go out together, in the order of the file, and so stand its tasks; which of them a table has
    first, and what their places are, is not compared. Names of statuses have numbers of roles, as the file has them.
    """
    text = text_of("mapping-patches")
    other = with_last_first(with_last_first(text, "  [[group.role]]"), "[[vehicle]]")
    assert other != text
    assert sorted(other.split()) == sorted(text.split())
    after, before = (without_numbers(tables(of(one, tmp_path, strategy, 0.5))) for one in (other, text))
    for name in ("items", "organisation"):
        assert sorted(after.pop(name)) == sorted(before.pop(name))
    node, parent = PLANS.column_names.index("node"), PLANS.column_names.index("parent")
    shown = [Counter((*row[:node], *row[parent + 1 :]) for row in rows.pop("plans")) for rows in (after, before)]
    assert shown[0] == shown[1]
    assert after == before


@pytest.mark.slow
@pytest.mark.parametrize("strategy", sampled(["remoras", "central", "cbba"], "remoras"))
def test_translating_the_world_translates_the_tracks(strategy: str, tmp_path: Path) -> None:
    """It fails if the origin has a meaning: cells counted from 0, a distance from (0, 0), a place where nobody is.

    Once a group is together its vehicles keep places that turn with the heading of the leader, as it follows from
    positions rounded to half a metre. There a tie may fall to the other side; the tracks are held to until then.
    """
    text = text_of("mapping-rendezvous")
    before, after = of(text, tmp_path, strategy, 0.5), of(shifted(text), tmp_path, strategy, 0.5)
    met_s = next(milestone.time_s for milestone in before.milestones if milestone.name == "gathered")
    east_m, north_m = SHIFT_M
    assert [(m.name, m.vehicle, m.group) for m in after.milestones] == [
        (m.name, m.vehicle, m.group) for m in before.milestones
    ]
    assert after.end_s == pytest.approx(before.end_s, abs=TOLERANCE_S)
    rows = list(zip(before.recorder.rows("trajectories"), after.recorder.rows("trajectories"), strict=False))
    assert rows[0][0][0] < met_s
    for (now_s, name, x_m, y_m, *_), (then_s, other, then_x_m, then_y_m, *_) in rows:
        if now_s > met_s:
            break
        assert (now_s, name) == (then_s, other)
        off_m = math.hypot(then_x_m - x_m - east_m, then_y_m - y_m - north_m)
        assert off_m <= TOLERANCE_M, (now_s, name)


@pytest.mark.parametrize(("scenario", "job"), [("minehunting-contacts", "revisit 1"), ("recovery-field", "lift 1")])
def test_translating_the_world_keeps_the_expected_efforts(scenario: str, job: str, tmp_path: Path) -> None:
    """It fails if the effort of a job whose place is found at run time is reckoned from any other place."""
    text, keys = text_of(scenario), ("scenario.duration_s=900.0",)
    before, after = (of(one, tmp_path, "remoras", 0.2, *keys).recorder.plans for one in (text, shifted(text)))
    assert any(row[8].endswith(f"{job})") and row[11] for row in before)
    for (*step, time_s, energy_j), (*other, then_s, then_j) in zip(before, after, strict=True):
        assert other[1:] == step[1:]
        assert (then_s, then_j) == (pytest.approx(time_s), pytest.approx(energy_j))
