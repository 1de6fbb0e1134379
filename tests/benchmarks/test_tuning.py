"""The search of the strategies' parameters: what it tries, what it finds, and when that counts as better."""

import json
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

from benchmarks.tuning import (
    KEPT,
    RANGES,
    ROUNDS,
    Point,
    Round,
    main,
    points_of,
    range_of,
    search,
    swept,
    table,
    tunable,
    tuned,
)
from missions.files import shipped_studies
from missions.sweeps.plan import seed_of
from missions.sweeps.study_file import StudyFile
from remoras.strategies import configured, parameters, strategies
from remoras.strategies.central import Central
from remoras.strategies.fixed_partition import FixedPartition

DURATION_S = 40.0
BRIEF = f"""
[study]
name = "brief"
scenario = "mapping-patches"
sampling = "list"
keep_tables = 0
repeats = {{repeats}}
seed = {{seed}}

[set]
"scenario.duration_s" = {DURATION_S}
"""


def test_every_parameter_has_a_range_that_the_strategy_allows() -> None:
    searched = set()
    for name, strategy in tunable().items():
        for parameter in tuned(strategy):
            low, high = (type(parameter.default)(end) for end in range_of(name, parameter.name))
            assert low < high
            for end in (low, high):
                assert getattr(configured(strategy, {parameter.name: end}), parameter.name) == end
            own = f"{name}.{parameter.name}"
            searched.add(own if own in RANGES else parameter.name)
    assert searched == set(RANGES)


def test_what_is_not_searched_is_a_factor() -> None:
    left = {one.name for strategy in tunable().values() for one in set(parameters(strategy)) - set(tuned(strategy))}
    assert left == {"common_plan", "repairs", "announces"}


def test_the_seeds_of_the_search_are_in_no_shipped_study_and_in_no_other_round() -> None:
    searched = [seed_of(one.seed, repeat) for one in ROUNDS for repeat in range(one.repeats)]
    assert len(set(searched)) == len(searched)
    for path in shipped_studies().values():
        file = StudyFile.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
        repeats = file.stopping.maximum if file.stopping else file.study.repeats
        assert not set(searched) & {seed_of(file.study.seed, repeat) for repeat in range(repeats)}


def test_the_defaults_are_the_first_point_and_the_others_meet_every_stratum_once() -> None:
    default, *drawn = points_of(Central(), 12)
    assert default.values == (("margin", 0.05), ("help_s", 60.0), ("acknowledge_rounds", 400), ("queue", 2))
    assert len(drawn) == 11
    margins = [dict(point.values)["margin"] for point in drawn]
    assert sorted(int(11 * float(margin) / 0.3) for margin in margins) == list(range(11))  # 0 to 0.3 in 11 strata
    queues = [dict(point.values)["queue"] for point in drawn]
    assert all(type(queue) is int and 1 <= queue <= 6 for queue in queues)
    assert drawn == points_of(Central(), 12)[1:]


class Stub:
    """Times as a function of the margin; seeds differ by more than points, and all points by nearly the same."""

    def __init__(self, best_margin: float) -> None:
        self.best_margin = best_margin
        self.runs: list[tuple[str, int, int]] = []  # round, points, points of central

    def __call__(self, tried: Sequence[Point], of: Round) -> Mapping[Point, Mapping[int, float]]:
        self.runs.append((of.name, len(tried), sum(point.strategy == "central" for point in tried)))
        found: dict[Point, dict[int, float]] = {}
        for point in tried:
            off = abs(float(dict(point.values)["margin"]) - self.best_margin)
            found[point] = {
                repeat: 2000.0 + 100.0 * repeat + (1000.0 + repeat % 2) * off for repeat in range(of.repeats)
            }
        return found


def test_it_finds_the_best_point_with_as_many_runs_for_each_strategy() -> None:
    stub = Stub(best_margin=0.3)
    central, fixed = search([Central(), FixedPartition()], 12, stub)
    margins = [float(dict(point.values)["margin"]) for point in points_of(Central(), 12)]
    assert dict(central.found.values)["margin"] == max(margins)
    assert central.found_s - central.default_s == pytest.approx(-1000.5 * (max(margins) - 0.05))
    assert central.is_better
    assert central.n_pairs == ROUNDS[2].repeats
    assert fixed.is_better
    assert stub.runs == [("first", 24, 12), ("second", 2 * KEPT, KEPT), ("last", 4, 2)]


def test_the_defaults_stay_where_nothing_is_better() -> None:
    stub = Stub(best_margin=0.05)
    [verdict] = search([Central()], 5, stub)
    assert verdict.found == verdict.default
    assert not verdict.is_better
    assert stub.runs[-1] == ("last", 0, 0)
    assert "| the defaults |" in table([verdict])


def test_a_difference_within_the_noise_is_none() -> None:
    """The winner of the first rounds is 10 s better in the mean of the last, and up to 70 s better or worse in each."""

    def evaluate(tried: Sequence[Point], of: Round) -> Mapping[Point, Mapping[int, float]]:
        default = points_of(Central(), 5)[0]
        off = [-80.0, 60.0, -70.0, 50.0, -65.0, 45.0, -55.0, 35.0]  # sum -80
        return {
            point: {n: 2000.0 + (0.0 if point == default else off[n] if of.name == "last" else -50.0) for n in range(8)}
            for point in tried
        }

    [verdict] = search([Central()], 5, evaluate)
    assert verdict.found_s - verdict.default_s == pytest.approx(-10.0)
    assert verdict.found != verdict.default
    assert not verdict.is_better


def test_runs_that_do_not_end_count_with_the_whole_duration_and_are_made_once(tmp_path: Path) -> None:
    of = Round("brief", 5, 1, BRIEF)
    tried = [point for strategy in (Central(), FixedPartition()) for point in points_of(strategy, 3)[:2]]
    times = swept(tried, of, tmp_path, jobs=1)
    assert times == {point: {0: DURATION_S} for point in tried}
    ledger = tmp_path / "brief" / "ledger.jsonl"
    lines = ledger.read_text(encoding="utf-8").splitlines()
    assert {json.loads(line)["summary"]["seed"] for line in lines} == {seed_of(5, 0)}
    assert len(lines) == 4
    assert swept(tried, of, tmp_path, jobs=1) == times
    assert len(ledger.read_text(encoding="utf-8").splitlines()) == 4
    assert swept([], of, tmp_path, jobs=1) == {}


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (["oracle"], "unknown strategy oracle: allowed are cbba, cbba-plain, central,"),
        (["central", "--points", "2"], "--points 2: 3 at least"),
        (["central", "--jobs", "0"], "--jobs 0: 1 at least"),
    ],
)
def test_wrong_words_are_refused(given: list[str], says: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main([*given, "--out", "never-made"])
    assert caught.value.code == 2
    assert says in capsys.readouterr().err


def test_the_oracle_alone_has_nothing_to_search() -> None:
    assert set(strategies()) - set(tunable()) == {"oracle"}
