"""Race: verdicts and leads on values with known truth, and races of real missions through the command."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_mission import SMALL
from typer.testing import CliRunner

from missions.comparison.race import Race, RaceLine
from missions.comparison.ranking import Contender
from missions.comparison.treatments import Measured, Treatment
from missions.metric import Better, Metric
from missions.runs.metrics import CORE_METRICS
from missions.statistics import FEW
from missions.sweeps.folder import SweepResults
from remoras.cli import app
from remoras.cli.race import _lead

TIME = next(metric for metric in CORE_METRICS if metric.name == "mission_time_s")
SHARE = next(metric for metric in CORE_METRICS if metric.name == "goal_fraction")
IDLE = """
from dataclasses import dataclass
from typing import ClassVar

from remoras.cli.templates.nearest import Nearest
from remoras.strategy import Move


class Nobody:
    def negotiate(self, situation):
        return Move(holding=True)


@dataclass(frozen=True)
class Idle(Nearest):
    name: ClassVar[str] = "idle"

    def negotiator(self, me, group):
        return Nobody()
"""


def raced(
    values: Mapping[str, Sequence[float]], metric: Metric = TIME, budget: int = 1000, within: float = 0.03
) -> RaceLine:
    """Race of strategies with these values by repeat."""
    race, made = Race([(0.1, name) for name in values], metric, within), 0
    while race.advance(budget - made):
        made = sum(race.repeats.values())
        column = {}
        for name, own in values.items():
            repeats = range(race.repeats[0.1, name])
            of_repeats = {repeat: own[repeat % len(own)] for repeat in repeats}
            column[Treatment("s", name, "ack", "bernoulli", 0.1, ())] = Contender(
                Measured(of_repeats), Measured(dict.fromkeys(repeats, 1.0))
            )
        race.look([column], {0.1: [1.0] * made})
    return race.lines[0.1]


def still_racing(line: RaceLine) -> dict[str, bool]:
    return {rank.strategy: rank.among_best for rank in line.ranks}


def noise(seed: int, n: int = 64) -> list[float]:
    return [float(value) for value in np.random.Generator(np.random.Philox(seed)).normal(0.0, 1.0, n)]


def test_clearly_worse_strategies_are_beaten_at_the_first_look() -> None:
    """100 against 110 and 130, with deviations of 1: the lead is 1 - 100 / 110 = 9.1 %, known to about a half."""
    line = raced(
        {name: [mean + x for x in noise(at)] for at, (name, mean) in enumerate({"a": 100, "b": 110, "c": 130}.items())}
    )
    assert (line.winner, line.runner_up, line.certain) == ("a", "b", True)
    assert still_racing(line) == {"a": True, "b": False, "c": False}
    assert (line.runs, line.undecided) == (3 * FEW, ())
    assert line.lead == pytest.approx(1 - 100 / 110, abs=0.015)
    assert 0.05 < line.lead_low < line.lead < line.lead_high < 0.13


def test_equal_strategies_are_not_decided_until_the_budget_ends() -> None:
    """Deviations of 10 % leave 3 % open: all 100 runs are used, a beaten one costs nothing after the first look."""
    values = {name: [100 + 10 * x for x in noise(at)] for at, name in enumerate("ab")}
    line = raced({**values, "c": [200 + 10 * x for x in noise(7)]}, budget=100)
    assert still_racing(line) == {"a": True, "b": True, "c": False}
    assert {rank.strategy: rank.n for rank in line.ranks} == {"a": 46, "b": 46, "c": FEW}
    assert not line.certain
    assert line.lead_low < -0.03
    assert line.lead_low < line.lead < line.lead_high


def test_a_winner_close_to_the_best_is_certain_without_beating_it() -> None:
    """The paired difference has a deviation of 0.5 %: 8 repeats show that it is below 3 %."""
    common = noise(1)
    near = {
        name: [100 + 10 * x + 0.5 * y for x, y in zip(common, noise(at), strict=True)]
        for at, name in ((2, "a"), (3, "b"))
    }
    line = raced(near)
    assert (line.certain, still_racing(line)) == (True, {"a": True, "b": True})
    assert line.lead_low >= -0.03
    assert raced(near, within=0.0005, budget=40).runs == 40


def test_fewer_completions_lose_whatever_the_metric() -> None:
    race = Race([(0.1, "a"), (0.1, "b")], TIME, 0.03)
    assert race.advance(100)
    column = {
        Treatment("s", name, "ack", "bernoulli", 0.1, ()): Contender(
            Measured({n: mean + n for n in range(FEW)}), Measured(dict.fromkeys(range(FEW), success))
        )
        for name, mean, success in (("a", 100.0, 0.0), ("b", 200.0, 1.0))
    }
    race.look([column], {0.1: []})
    assert (race.lines[0.1].winner, race.lines[0.1].undecided, race.lines[0.1].lead) == ("b", (), None)


@given(st.lists(st.lists(st.integers(1, 50), min_size=FEW, max_size=FEW), min_size=2, max_size=4))
def test_leads_hold_for_either_direction_and_unit(columns: list[list[int]]) -> None:
    """The interval contains the lead; a unit changes nothing; values turned around give the same order."""
    values = {f"{at}": [float(x) for x in own] for at, own in enumerate(columns)}
    line = raced(values, budget=FEW * len(values))
    assert line.lead_low - 1e-3 <= line.lead <= line.lead_high + 1e-3 or abs(line.lead) > 1.0
    scaled = raced({name: [7.0 * x for x in own] for name, own in values.items()}, budget=FEW * len(values))
    assert (scaled.winner, scaled.lead, scaled.certain) == (
        line.winner,
        pytest.approx(line.lead, abs=1e-3),
        line.certain,
    )
    turned = raced({name: [100.0 - x for x in own] for name, own in values.items()}, SHARE, FEW * len(values))
    assert [rank.strategy for rank in turned.ranks] == [rank.strategy for rank in line.ranks]


@pytest.mark.parametrize(
    ("better", "unit", "lead", "expected"),
    [
        (Better.LOWER, "s", 0.004, "0.4 % shorter than b [-0.6 to +1.1]"),
        (Better.LOWER, "s", -0.004, "0.4 % longer than b [-0.6 to +1.1]"),
        (Better.HIGHER, "1", 0.004, "0.4 % higher than b [-0.6 to +1.1]"),
        (Better.HIGHER, "1", -0.004, "0.4 % lower than b [-0.6 to +1.1]"),
    ],
)
def test_a_lead_says_how_much_better_than_which_strategy(better: Better, unit: str, lead: float, expected: str) -> None:
    line = raced({"a": [100.0 + x for x in range(8)], "b": [110.0 + x for x in range(8)]}, TIME, 16)
    line = replace(line, lead=lead, lead_low=-0.006, lead_high=0.011, runner_up="b")
    assert _lead(line, replace(TIME, better=better, unit=unit)) == expected


def race_of(folder: Path, *arguments: object, per: str = "0.2") -> str:
    """JSON of a race on a small mission, without the CPU times."""
    (folder / "pond.toml").write_text(SMALL, encoding="utf-8")
    command = ["race", folder / "pond.toml", "--only", "--per", per, *arguments, "--json"]
    done = CliRunner().invoke(app, [str(word) for word in command])
    assert done.exit_code == 0, done.output
    return json.dumps([{**line, "cpu_s": None} for line in json.loads(done.stdout)])


THREE = ("--strategy", "central", "--strategy", "contract-net", "--strategy", "remoras")


@pytest.mark.slow
def test_a_race_gives_the_same_report_for_any_jobs_and_resumes(tmp_path: Path) -> None:
    """A race with half of the runs, continued in its folder, reports as one without interruption."""
    whole = race_of(tmp_path, *THREE, "--budget", 40, "--within", 0, "--jobs", 1)
    assert race_of(tmp_path, *THREE, "--budget", 24, "--within", 0, "--jobs", 2, "--out", tmp_path / "out") != whole
    assert SweepResults.read(tmp_path / "out").status().remaining == 0  # the rest of the budget is no missing run
    assert race_of(tmp_path, *THREE, "--budget", 40, "--within", 0, "--jobs", 2, "--out", tmp_path / "out") == whole
    assert race_of(tmp_path, *THREE, "--budget", 40, "--within", 0, "--seed", 2) != whole


@pytest.mark.slow
def test_a_strategy_that_never_completes_is_reported(tmp_path: Path) -> None:
    """A line for each loss; the idle strategy has no completed run and loses, with central or alone."""
    (tmp_path / "race_idle.py").write_text(IDLE, encoding="utf-8")
    idle = "--strategy", f"{tmp_path / 'race_idle.py'}:Idle"
    lines = json.loads(race_of(tmp_path, *idle, "--strategy", "central", per="0.2,0.6"))
    assert [(line["per"], line["winner"]) for line in lines] == [(0.2, "central"), (0.6, "central")]
    for line in lines:
        (own,) = [rank for rank in line["ranks"] if rank["strategy"] == "race_idle:Idle"]
        assert (own["success_rate"], own["among_best"], own["mean"]) == (0.0, False, 1200.0)
    short = SMALL.replace("duration_s = 1200.0", "duration_s = 60.0")
    (tmp_path / "brief.toml").write_text(short, encoding="utf-8")
    done = CliRunner().invoke(app, ["race", str(tmp_path / "brief.toml"), *idle, "--only", "--strategy", "central"])
    assert done.exit_code == 0, done.output
    assert "none: no run completes" in done.stdout


@pytest.mark.slow
def test_parameters_of_the_scenario_race_with_the_strategies_that_have_them(tmp_path: Path) -> None:
    """Both allocators have a queue, only central joins others' jobs."""
    own = '[strategy]\nname = "central"\nparameters = {queue = 3, join_s = 90.0}\n'
    (tmp_path / "set.toml").write_text(SMALL.replace('[strategy]\nname = "remoras"\n', own), encoding="utf-8")
    command = ["race", str(tmp_path / "set.toml"), "--only", *THREE[:4], "--budget", "16", "--out", str(tmp_path / "o")]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    assert [line for line in done.stderr.splitlines() if line.startswith("remoras: ")] == [
        "remoras: strategy.parameters.join_s is not applied to contract-net: no such parameter",
        "remoras: at most 16 runs; beaten strategies are dropped after the first 16",
    ]
