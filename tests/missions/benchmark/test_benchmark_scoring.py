"""Benchmark: suites, scores, result cards."""

import functools
import json
import operator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from short_suite import SHORT

from missions.benchmark.card import card_of, card_text, figures, read_card, read_strategies, verify_card
from missions.benchmark.running import CellRun, Contest, Scored, against
from missions.benchmark.suite import Cell, Suite, suite_named
from missions.errors import ConfigurationError, OutputError
from missions.runs.assembly import actual
from missions.runs.setup import resolved
from missions.sweeps.plan import SweepPlan
from remoras.errors import PluginError

STRATEGIES = ["cbba", "remoras"]


def run_of(efficiency: float, repeat: int = 0) -> CellRun:
    return CellRun(repeat, repeat, efficiency * 1000.0, 1000.0, True, 1.0, None)


def strategy_of(*cells: list[float]) -> Scored:
    found = {
        Cell("ground", str(number), ""): [run_of(value, repeat) for repeat, value in enumerate(values)]
        for number, values in enumerate(cells)
    }
    return Scored("mine", "mine:MINE", found)


@pytest.fixture(scope="module")
def suite(tmp_path_factory: pytest.TempPathFactory) -> Suite:
    path = tmp_path_factory.mktemp("suite") / "short.toml"
    path.write_text(SHORT, encoding="utf-8")
    return suite_named(str(path))


@pytest.fixture(scope="module")
def contest(suite: Suite) -> Contest:
    return Contest.of(suite, STRATEGIES)


@pytest.fixture(scope="module")
def made(contest: Contest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made")
    contest.make(folder, 1)
    return folder


def test_cells_have_equal_weight_for_any_number_of_runs() -> None:
    found = strategy_of([0.2, 0.4], [0.9])
    assert found.score == pytest.approx(0.6)
    assert found.interval is None
    assert found.worst.network == "0"


def test_differences_use_instances_common_to_both_strategies() -> None:
    mean, _ = against(strategy_of([0.5, 0.6, 0.1]), strategy_of([0.4, 0.4]))
    assert mean == pytest.approx(0.15)


def test_cells_of_one_instance_do_not_count_as_repeats() -> None:
    """40 cells with one instance count as one sample; with two instances there is no interval at all."""
    luck = [0.5, 0.52, 0.61, 0.47, 0.66, 0.58, 0.43, 0.55]
    one, forty = strategy_of(luck), strategy_of(*[luck] * 40)
    assert one.interval == forty.interval == pytest.approx((0.4867, 0.5933), abs=0.02)
    assert strategy_of(*[luck[:2]] * 40).interval is None


@pytest.mark.slow
def test_incomplete_run_counts_with_its_time_limit(contest: Contest, made: Path) -> None:
    for strategy in contest.scored(made):
        for run in strategy.runs:
            assert (run.completed, run.time_s, run.failed) == (False, 7200.0, False)
            assert 200.0 < run.bound_s < 1000.0
        bounds = {run.repeat: run.bound_s for run in strategy.runs}
        assert len(set(bounds.values())) == 2  # the speeds of each seed are others


@pytest.mark.slow
def test_card_is_read_back_and_its_runs_are_reproduced(
    suite: Suite, contest: Contest, made: Path, tmp_path: Path
) -> None:
    card = card_of(contest, contest.scored(made))
    path = tmp_path / "card.json"
    path.write_text(card_text(card), encoding="utf-8")
    assert read_card(path, suite) == json.loads(card_text(card))
    assert [figures(strategy, suite) for strategy in read_strategies(card)] == [
        {key: entry[key] for key in figures(strategy, suite)}
        for entry, strategy in zip(card["strategies"], read_strategies(card), strict=True)
    ]
    check = verify_card(path, suite, 5, 3)
    assert (check.seed, check.n_runs, check.other_code) == (5, 8, {})
    verified = dict(check.runs)
    assert len(verified) == 3
    assert set(verified.values()) == {""}


@pytest.mark.slow
def test_verification_detects_a_card_with_half_of_its_runs_forged(
    suite: Suite, contest: Contest, made: Path, tmp_path: Path
) -> None:
    """Times of one strategy are forged, figures and all. Of 8 runs a verifier makes all 8 again: ten at least."""
    strategies = contest.scored(made)
    forged = {cell: [replace(run, time_s=6000.0, completed=True) for run in runs]
              for cell, runs in strategies[1].cells.items()}  # fmt: skip
    path = tmp_path / "card.json"
    path.write_text(card_text(card_of(contest, [strategies[0], replace(strategies[1], cells=forged)])))
    found = [text for _, text in verify_card(path, suite, 1).runs]
    assert (len(found), sum(bool(text) for text in found)) == (8, 4)
    of_seeds = [{name for name, _ in verify_card(path, suite, seed, 1).runs} for seed in (1, 2, 3, 4)]
    assert len(set.union(*of_seeds)) > 1


def altered(card: dict[str, object], path: Path, at: str, value: object) -> None:
    """Write the card with something else at a place, or without it."""
    found = json.loads(card_text(card))
    *way, last = (int(part) if part.isdecimal() else part for part in at.split("."))
    inner: Any = functools.reduce(operator.getitem, way, found)
    inner[last] = value
    path.write_text(json.dumps(found), encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize(("at", "value", "said"), [
    ("digest", "0" * 64, "suite = short with digest 000000000000; allowed: short with digest"),
    ("strategies.0.score", 0.99, "cbba.score = 0.99: allowed: .* the card was altered"),
    ("note", "17", "note: unknown key; allowed: suite, digest"), ("strategies.0.runs", None, "no card of a benchmark"),
])  # fmt: skip
def test_altered_card_is_refused(
    at: str, value: object, said: str, suite: Suite, contest: Contest, made: Path, tmp_path: Path
) -> None:
    path = tmp_path / "card.json"
    altered(card_of(contest, contest.scored(made)), path, at, value)
    with pytest.raises(OutputError, match=said):
        verify_card(path, suite, 1)


@pytest.mark.slow
def test_card_that_repeats_one_run_of_a_cell_is_refused(
    suite: Suite, contest: Contest, made: Path, tmp_path: Path
) -> None:
    card = json.loads(card_text(card_of(contest, contest.scored(made))))
    runs = card["strategies"][0]["runs"][0]
    runs[1] = runs[0]
    scored = read_strategies(card)
    for entry, strategy in zip(card["strategies"], scored, strict=True):
        entry.update(figures(strategy, suite))
    (tmp_path / "card.json").write_text(json.dumps(card), encoding="utf-8")
    with pytest.raises(OutputError, match="other repeats or seeds than the suite has"):
        read_card(tmp_path / "card.json", suite)


FATHOM_2 = "bc686db5437bcb33de7b37cb9b6f5edd61d3a66721232802ff0274485e282630"
STILL = SHORT[: SHORT.index("[[unforeseen]]")].replace("40.0\n", "40.0\nuncertainty.speed_spread = 0.0\n")
SUITE = STILL + '[[unforeseen]]\nname = "nothing"\n'


def test_cells_of_the_suite_have_a_fixed_digest() -> None:
    """Another digest means other cases, of another suite."""
    assert suite_named("fathom-2").digest == FATHOM_2


def test_instances_differ_in_lines_and_speeds_and_all_cells_share_them(suite: Suite) -> None:
    configurations = suite.study(["remoras"]).configurations
    places, speeds = set(), set()
    for repeat in range(2):
        seed = suite.seed(repeat)
        of_cells = {configuration.scenario.for_seed(seed).line for configuration in configurations}
        assert len(of_cells) == 1
        places |= of_cells
        setup = resolved(configurations[0].scenario.for_seed(seed))
        speeds |= {actual(setup, data, seed).speed_factor for data in setup.database.values()}
    assert len(places) == 2
    assert len(speeds) > 8


def test_the_split_for_the_final_score_has_other_instances(suite: Suite) -> None:
    kept = suite_named(suite.document.path, "test")
    assert kept.cells == suite.cells
    assert {kept.seed(repeat) for repeat in range(9)}.isdisjoint(suite.seed(repeat) for repeat in range(9))
    assert SweepPlan(kept.study(["remoras"])).task(0, 1).seed == kept.seed(1)


TEXT = SUITE.replace("0.42", "0.4")
TEXT = TEXT.replace('"measured"\nset."channel.name" = "network"', '"worse"\nset."channel.per" = 0.6')


@pytest.mark.parametrize(("was", "now", "said"), [
    ('"escort-lines"', '"escort-line"', "suite.scenario.*a shipped scenario.*escort-lines"),
    ('"worse"', '"alike"', "network.2.name.*give each its own"), ("repeats = 2", "repeats = 0", "suite.repeats = 0"),
    ("limit_s = 7200.0", "limit = 7200.0", "suite.limit"),
    ("0.6", "1.6", "channel.per = 1.6"), ("0.6", "0.4", "two cases of this suite run alike"),
    ("= 0.5", "= 1.5", "drawn_lines.escorted_share = 1.5"),
    ('set."channel.per" = 0.6', 'set."channel.name" = "network"\nset."channel.network" = "lost.csv"', "lost.csv"),
])  # fmt: skip
def test_faulty_suite_file_is_refused_with_its_key_before_any_run(
    was: str, now: str, said: str, tmp_path: Path
) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(TEXT.replace(was, now), encoding="utf-8")
    with pytest.raises(ConfigurationError, match=said):
        suite_named(str(path)).study(["remoras"])


def test_invalid_repeats_and_strategies_are_refused() -> None:
    suite = suite_named("fathom-2")
    with pytest.raises(OutputError, match="--repeats 13: allowed: 1 to 12"):
        Contest.of(suite, ["remoras"], 13)
    with pytest.raises(PluginError, match=r'--strategy "remora".*did you mean'):
        Contest.of(suite, ["remora"])
    assert Contest.of(suite, ["remoras", "cbba", "remoras"], 1).strategies == ("remoras", "cbba")
