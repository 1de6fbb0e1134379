"""The split by which strategies are judged: grounds drawn from seeds whose digest alone is out."""

import hashlib
import tomllib
from pathlib import Path

import pytest
import tomli_w

from missions.benchmark.card import card_of, card_text, verify_card
from missions.benchmark.judging import judging_of, split_to_judge
from missions.benchmark.running import Contest
from missions.benchmark.suite import Suite, suite_named
from missions.errors import OutputError
from missions.files import shipped
from missions.mapping.drawn_ground import CELLS, MAPPERS, PIECES, drawn_ground
from missions.mapping.rounds import rounds
from missions.rounds import least_time_s
from missions.runs.assembly import actual
from missions.runs.setup import resolved
from missions.scenarios import load

SEEDS_OF_FATHOM_1 = "d82117fed81a13fc3a2b480da550abe4df262d1818a23f5812df4cbcb80a7de7"
SUITE = """
[suite]
name = "short"
grounds = ["mapping-patches"]
bound = "missions.mapping.rounds:rounds"
limit_s = 7200.0
repeats = 2

[set]
scenario.duration_s = 40.0
uncertainty.speed_spread = 0.0

[[network]]
name = "alike"
set."channel.per" = 0.42

[[network]]
name = "measured"
set."channel.name" = "network"

[[unforeseen]]
name = "nothing"
"""
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


def test_the_seeds_by_which_fathom_1_is_judged_are_settled() -> None:
    """Another digest means another list: who has tuned on one is judged by the next version's."""
    assert judging_of(suite_named("fathom-1")).seeds_sha256 == SEEDS_OF_FATHOM_1


@pytest.mark.slow
def test_drawn_grounds_are_scenarios_that_differ_in_areas_room_and_fleet(tmp_path: Path) -> None:
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


@pytest.fixture(scope="module")
def contest(tmp_path_factory: pytest.TempPathFactory) -> tuple[Contest, Path]:
    folder = tmp_path_factory.mktemp("judged")
    contest = Contest.of(split_to_judge(*suite_in(folder), folder / "grounds"), ["cbba", "remoras"])
    contest.make(folder / "runs", 1)
    return contest, folder


@pytest.mark.slow
def test_each_repeat_is_on_another_ground_with_its_own_bound(contest: tuple[Contest, Path]) -> None:
    made, folder = contest
    cells = {strategy.name: strategy.cells for strategy in made.scored(folder / "runs")}
    assert [cell.label for cell in made.suite.cells] == ["drawn, alike, nothing", "drawn, measured, nothing"]
    for strategy in cells.values():
        for runs in strategy.values():
            assert [run.repeat for run in runs] == [0, 1, 2]
            for run, path in zip(runs, sorted((folder / "grounds").iterdir()), strict=True):
                setup = resolved(load(str(path), [("set", "uncertainty.speed_spread=0.0")]))
                fleet = tuple(actual(setup, data, run.seed) for data in setup.database.values())
                assert run.bound_s == pytest.approx(least_time_s(rounds(setup.scenario, fleet)), abs=1e-3)
            assert len({run.bound_s for run in runs}) == 3


@pytest.mark.slow
def test_its_card_is_verified_with_the_same_seeds_alone(contest: tuple[Contest, Path], tmp_path: Path) -> None:
    made, folder = contest
    card = card_of(made, made.scored(folder / "runs"))
    assert card["split"] == "test"
    path = tmp_path / "card.json"
    path.write_text(card_text(card), encoding="utf-8")
    again = split_to_judge(suite_named(str(folder / "short.toml")), folder / "seeds.txt", tmp_path / "again")
    assert again.digest == made.suite.digest
    assert set(dict(verify_card(path, again, 2)).values()) == {""}
    with pytest.raises(OutputError, match=r"suite = short with digest .*; allowed: short with digest"):
        dict(verify_card(path, suite_named(str(folder / "short.toml")), 1))


@pytest.mark.parametrize(
    ("seeds", "named"),
    [
        ("11\n12\n14\n", r"--seeds .*: sha256 = [0-9a-f]{12}; allowed: [0-9a-f]{12}, the seeds of short"),
        (
            None,
            "--split test: --seeds FILE is missing; the seeds of short have the sha256 [0-9a-f]{12} and are",
        ),
    ],
)
def test_without_the_seeds_one_line_says_what_is_allowed(tmp_path: Path, seeds: str | None, named: str) -> None:
    suite, path = suite_in(tmp_path)
    if seeds is not None:
        path.write_text(seeds, encoding="utf-8")
    with pytest.raises(OutputError, match=named):
        split_to_judge(suite, None if seeds is None else path, tmp_path / "grounds")


@pytest.mark.parametrize("line", ["twelve", "-1", "1.5", str(2**62)])
def test_a_seed_that_is_none_is_named_with_its_line(tmp_path: Path, line: str) -> None:
    suite, path = suite_in(tmp_path, f"11\n{line}\n")
    with pytest.raises(OutputError, match=r"seeds\.txt:2: .*; allowed: a whole number below 2\^62"):
        split_to_judge(suite, path, tmp_path / "grounds")


def test_a_suite_without_such_a_split_says_so(tmp_path: Path) -> None:
    (tmp_path / "short.toml").write_text(SUITE, encoding="utf-8")
    with pytest.raises(OutputError, match=r"--split test: short has none: .* is missing; allowed: dev"):
        split_to_judge(suite_named(str(tmp_path / "short.toml")), None, tmp_path)
