"""Survey lines drawn by the seed of a run."""

import itertools
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.errors import ConfigurationError
from missions.fieldwork.drawn_lines import DrawnLines, _apart_m, rounds
from missions.lower_bound import least_time_s
from missions.runs.assembly import assemble
from missions.runs.run import run
from missions.runs.setup import resolved
from missions.scenarios import Scenario, World, load

WORLD = World(x_m=(-400.0, 400.0), y_m=(-250.0, 400.0))
TWO_ESCORTS_M = 40.0


def drawn(*settings_: str) -> Scenario:
    return load("escort-lines", [("--set", text) for text in ("drawn_lines.number=4", "channel.per=0", *settings_)])


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**61), st.integers(1, 14), st.floats(0.0, 1.0))
def test_lines_lie_apart_within_the_world_and_a_greater_share_escorts_more_of_the_same(
    seed: int, number: int, share: float
) -> None:
    lines = DrawnLines(number=number, escorted_share=share).of_seed(WORLD, seed)
    assert len(lines) == number
    assert not list(WORLD.outside((line.name, at_m) for line in lines for at_m in (line.from_m, line.to_m)))
    assert all(_apart_m(one, other) > TWO_ESCORTS_M for one, other in itertools.combinations(lines, 2))
    assert abs(sum(line.escorted for line in lines) - share * number) <= 0.5
    every = DrawnLines(number=number, escorted_share=1.0).of_seed(WORLD, seed)
    assert [(line.name, line.from_m, line.to_m) for line in every] == [(e.name, e.from_m, e.to_m) for e in lines]
    assert {line.name for line in lines if line.escorted} <= {line.name for line in every if line.escorted}


def test_runs_of_two_seeds_have_other_lines_and_keep_them_with_their_results(tmp_path: Path) -> None:
    runs = [run(drawn("scenario.duration_s=20"), seed) for seed in (1, 2)]
    assert runs[0].scenario.line != runs[1].scenario.line  # type: ignore[attr-defined]
    assert runs[0].drawn  # repeats of it are no copies, even without losses
    assert run(drawn("scenario.duration_s=20"), 1).recorder.tables == runs[0].recorder.tables


def test_unfixed_ground_is_not_assembled_and_no_line_at_all_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="differs by seed"):
        assemble(resolved(drawn()), 1)
    text = Path("missions/escort/lines.toml").read_text(encoding="utf-8")
    head, _, rest = text.partition("[[line]]")
    (tmp_path / "none.toml").write_text(head + rest[rest.index("[[rally_point]]") :], encoding="utf-8")
    with pytest.raises(ConfigurationError, match=r"line.*at least one \[\[line\]\], or the table \[drawn_lines\]"):
        load(str(tmp_path / "none.toml"))


@pytest.mark.slow
@pytest.mark.parametrize(("share", "seed"), [(0.0, 1), (0.0, 2), (0.5, 1), (0.5, 2)])
def test_no_strategy_is_faster_than_the_bound(share: float, seed: int) -> None:
    scenario = drawn("uncertainty.speed_spread=0", f"drawn_lines.escorted_share={share}", "strategy.name=oracle")
    finished = run(scenario, seed)
    assert finished.completed
    fleet = list(finished.setup.database.values())
    least_s = least_time_s(rounds(finished.scenario, fleet))
    assert 0.2 * finished.end_s < least_s <= finished.end_s
    assert least_time_s(rounds(finished.scenario, fleet, meets=False)) <= least_s
