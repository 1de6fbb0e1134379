"""Benchmark: suites, scores, result cards, held-out split."""

import functools
import hashlib
import json
import operator
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from short_suite import SHORT

from missions.benchmark.card import card_of, card_text, figures, read_card, read_strategies, verify_card
from missions.benchmark.running import CellRun, Contest, Scored, against
from missions.benchmark.suite import Cell, Suite, judging_of, split_to_judge, suite_named
from missions.errors import ConfigurationError, OutputError
from missions.files import shipped
from missions.mapping.drawn_ground import CELLS, MAPPERS, PIECES, drawn_ground
from missions.runs.assembly import actual
from missions.runs.setup import resolved
from missions.scenarios import load
from missions.sweeps.plan import SweepPlan
from remoras.errors import PluginError
from remoras.strategies import strategies

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
            assert 1400.0 < run.bound_s < 2100.0
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


def test_card_that_repeats_one_run_of_a_cell_is_refused(tmp_path: Path) -> None:
    suite = suite_named("fathom-1")
    card = json.loads(Path(suite.document.path).with_suffix(".json").read_text(encoding="utf-8"))
    runs = card["strategies"][0]["runs"][0]
    runs[1] = runs[0]
    scored = read_strategies(card)
    for entry, strategy in zip(card["strategies"], scored, strict=True):
        entry.update(figures(strategy, suite))
    (tmp_path / "card.json").write_text(json.dumps(card), encoding="utf-8")
    with pytest.raises(OutputError, match="other repeats or seeds than the suite has"):
        read_card(tmp_path / "card.json", suite)


def test_shipped_card_belongs_to_the_suite_and_has_all_strategies() -> None:
    suite = suite_named("fathom-1")
    card = read_card(Path(suite.document.path).with_suffix(".json"), suite)
    runs = [run for strategy in read_strategies(card) for run in strategy.runs]
    assert set(strategies()) - {strategy.name for strategy in read_strategies(card)} <= {"cbba", "cbba-plain"}
    assert max(run.efficiency for run in runs) <= 1.0


FATHOM_1 = "ea2aba0115e7405defc96f77238edc3bba40158ff1673c4883bfa99a3ad432f0"
SEEDS_OF_FATHOM_1 = "d82117fed81a13fc3a2b480da550abe4df262d1818a23f5812df4cbcb80a7de7"
STILL = SHORT[: SHORT.index("[[unforeseen]]")].replace("40.0\n", "40.0\nuncertainty.speed_spread = 0.0\n")
SUITE = STILL + '[[unforeseen]]\nname = "nothing"\n'
SEEDS = "11\n12\n13\n"


def suite_in(folder: Path, seeds: str = SEEDS) -> tuple[Suite, Path]:
    """A suite with a split to be judged by, and the file of its seeds."""
    (folder / "short.toml").write_text(SUITE, encoding="utf-8")
    (folder / "test").mkdir()
    (folder / "test" / "short.toml").write_text(
        'ground = "mapping-patches"\ngenerator = "missions.mapping.drawn_ground:drawn_ground"\n'
        f'seeds_sha256 = "{hashlib.sha256(seeds.encode()).hexdigest()}"\n',
        encoding="utf-8",
    )
    (folder / "seeds.txt").write_text(seeds, encoding="utf-8")
    return suite_named(str(folder / "short.toml")), folder / "seeds.txt"


def test_cells_and_held_out_seeds_of_the_suite_have_fixed_digests() -> None:
    """Another digest means other cases, of another suite, or another list, by which that is judged."""
    assert suite_named("fathom-1").digest == FATHOM_1
    assert judging_of(suite_named("fathom-1")).seeds_sha256 == SEEDS_OF_FATHOM_1


@pytest.mark.slow
def test_drawn_grounds_are_valid_and_differ_in_areas_and_fleet(tmp_path: Path) -> None:
    tables = tomllib.loads(shipped()["mapping-patches"].read_text(encoding="utf-8"))
    found, n_mappers, n_pieces = [], set(), set()
    for seed in range(12):
        drawn = drawn_ground(tables, seed)
        assert drawn == drawn_ground(tables, seed)
        found.append(drawn["area"])
        path = tmp_path / f"{seed}.toml"
        path.write_text(tomli_w.dumps(drawn), encoding="utf-8")
        setup = resolved(load(str(path)))
        boxes = [(*area["corners_m"][0], *area["corners_m"][2]) for area in drawn["area"]]
        width_m, height_m = (max(box[2 + axis] for box in boxes) - min(box[axis] for box in boxes) for axis in (0, 1))
        pieces_m2 = sum((right - left) * (upper - lower) for left, lower, right, upper in boxes)
        assert pieces_m2 == width_m * height_m  # no piece overlaps another or lies apart, or the scenario is refused
        assert 0.9 * CELLS[0] <= pieces_m2 / 25.0**2 <= 1.1 * CELLS[1]
        n_mappers.add(len(setup.database) - 1)
        n_pieces.add(len(boxes))
    assert n_mappers == set(MAPPERS)
    assert min(n_pieces) >= PIECES[0]
    assert max(n_pieces) <= PIECES[1]
    assert len(n_pieces) > 3
    assert all(one != other for at, one in enumerate(found) for other in found[:at])
    assert tables == tomllib.loads(shipped()["mapping-patches"].read_text(encoding="utf-8"))


def test_each_drawn_ground_has_other_vehicle_speeds(tmp_path: Path) -> None:
    """Speeds are drawn for the instance: with one seed for all grounds they would be the same on each."""
    suite, seeds = suite_in(tmp_path)
    judged = split_to_judge(suite, seeds, tmp_path / "grounds")
    speeds = set()
    for repeat, study in enumerate(judged.studies(["remoras"], settings={"uncertainty": {"speed_spread": 0.3}})):
        setup = resolved(study.configurations[0].scenario)
        assert SweepPlan(study).task(0, 0).seed == judged.seed(repeat)
        speeds |= {actual(setup, data, judged.seed(repeat)).speed_factor for data in setup.database.values()}
    assert len(speeds) > 8


@pytest.mark.parametrize(("seeds", "named"), [
    ("11\n12\n14\n", r"--seeds .*: sha256 = [0-9a-f]{12}; allowed: [0-9a-f]{12}, the seeds of short"),
    (None, "--split test: --seeds FILE is missing; the seeds of short have the sha256 [0-9a-f]{12} and are"),
    *((f"11\n{line}\n", r"seeds\.txt:2: .*; allowed: a whole number below 2\^62")
      for line in ("twelve", "-1", "1.5", 2**62)),
])  # fmt: skip
def test_unsuitable_held_out_seeds_are_refused_in_one_line(tmp_path: Path, seeds: str | None, named: str) -> None:
    suite, path = suite_in(tmp_path, SEEDS if seeds is None or "14" in seeds else seeds)
    path.write_text(seeds or "", encoding="utf-8")
    with pytest.raises(OutputError, match=named):
        split_to_judge(suite, None if seeds is None else path, tmp_path / "grounds")
    (tmp_path / "test" / "short.toml").unlink()
    with pytest.raises(OutputError, match=r"--split test: short has none: .* is missing; allowed: dev"):
        split_to_judge(suite, None, tmp_path)


TEXT = SUITE.replace("0.42", "0.4")
TEXT = TEXT.replace('"measured"\nset."channel.name" = "network"', '"worse"\nset."channel.per" = 0.6')


@pytest.mark.parametrize(("was", "now", "said"), [
    ('"mapping-patches"', '"mapping-patch"', "suite.grounds.*a shipped scenario.*mapping-patches"),
    ('"worse"', '"alike"', "network.2.name.*give each its own"), ("repeats = 2", "repeats = 0", "suite.repeats = 0"),
    ("limit_s = 7200.0", "limit = 7200.0", "suite.limit"),
    ("0.6", "1.6", "channel.per = 1.6"), ("0.6", "0.4", "two cases of this suite run alike"),
    ('set."channel.per" = 0.6', 'set."channel.name" = "network"\nset."channel.network" = "lost.csv"', "lost.csv"),
])  # fmt: skip
def test_faulty_suite_file_is_refused_with_its_key_before_any_run(
    was: str, now: str, said: str, tmp_path: Path
) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(TEXT.replace(was, now), encoding="utf-8")
    with pytest.raises(ConfigurationError, match=said):
        suite_named(str(path)).studies(["remoras"])


def test_invalid_repeats_and_strategies_are_refused() -> None:
    suite = suite_named("fathom-1")
    with pytest.raises(OutputError, match="--repeats 11: allowed: 1 to 10"):
        Contest.of(suite, ["remoras"], 11)
    with pytest.raises(PluginError, match=r'--strategy "remora".*did you mean'):
        Contest.of(suite, ["remora"])
    assert Contest.of(suite, ["remoras", "cbba", "remoras"], 1).strategies == ("remoras", "cbba")
