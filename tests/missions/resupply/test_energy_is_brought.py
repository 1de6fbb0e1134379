"""Altruism bears the mission of resupply: drills whose batteries do not last. Without its cause it does nothing."""

import math
from pathlib import Path

import pytest
from resupplying import EMPTY, FULL, OFF, events, raw, sampled, written

from missions.runs.run import Run, run
from missions.scenarios import load

SHORT = "scenario.duration_s=1500.0"
CALM = "decision.tedium_per_s=0.0"
TRANSFER_W = 0.7 * 500.0


def tracks(of: Run) -> list[tuple[object, ...]]:
    return list(of.recorder.trajectories)


def lost(vehicle: str, at_s: float) -> str:
    return f'fault=[{{kind="lost",vehicle="{vehicle}",at_s={at_s}}}]'


def mean_wait_s(of: Run) -> float:
    """Until the first vehicle comes to a hole where the work is halted."""
    came = events(of, "came")
    waits_s = [
        min((time_s for time_s, _, of_hole, _ in came if of_hole == hole and time_s > at_s), default=of.end_s) - at_s
        for at_s, _, hole, _ in events(of, "halted")
    ]
    return math.fsum(waits_s) / len(waits_s)


@pytest.mark.slow
def test_missions_are_shorter_where_calls_are_answered() -> None:
    """A call moves vehicles away from sites of their own; else they come once they have nothing else to do."""
    pairs = [(sampled(seed), sampled(seed, OFF)) for seed in (1, 2)]
    assert all(on.completed and off.completed and on.end_s < 0.95 * off.end_s for on, off in pairs)
    assert all(mean_wait_s(on) < 0.6 * mean_wait_s(off) for on, off in pairs)


@pytest.mark.slow
@pytest.mark.parametrize("cause", [FULL, (CALM,)])
def test_without_its_cause_altruism_does_nothing(cause: tuple[str, ...]) -> None:
    """Where batteries last nobody needs energy; where waiting makes none dissatisfied none calls."""
    assert tracks(sampled(1, SHORT, *cause)) == tracks(sampled(1, SHORT, *cause, OFF))
    assert tracks(sampled(1, SHORT)) != tracks(sampled(1, SHORT, OFF))


@pytest.mark.slow
def test_a_call_moves_to_the_act_that_ends_the_wait_and_to_no_other() -> None:
    """And those alone who have energy to give: the other drill's vehicle is called too."""
    moved = {(row[4], row[1]) for row in sampled(1).recorder.decisions if row[9] > 0.0}
    assert {activity for activity, _ in moved} == {"Helping"}
    assert {vehicle for _, vehicle in moved} <= {"AUV00", "AUV01", "AUV02"}


def test_no_energy_comes_from_nowhere() -> None:
    """What drills took is what their batteries had and what was brought; nobody gives what it does not have."""
    done = sampled(1)
    brought_j = math.fsum(energy_j for *_, energy_j in events(done, "brought"))
    taken_j = 8 * 240.0 * 300.0
    assert taken_j * 0.98 - 2 * 90e3 <= brought_j <= taken_j
    for vehicle in ("AUV00", "AUV01", "AUV02"):
        assert math.fsum(row[3] for row in events(done, "brought") if row[1] == vehicle) <= 0.7 * 500e3


def test_what_befell_is_written_down_in_order() -> None:
    """Also that somebody has left, which shows some seconds later."""
    times_s = [row[0] for row in sampled(2).recorder.rows("energy")]
    assert len(times_s) > 20
    assert times_s == sorted(times_s)


def test_energy_comes_in_while_both_are_in_place_and_no_faster_than_it_can() -> None:
    """Looked at in the tracks."""
    done = sampled(1)
    at_m = {(row[0], row[1]): (row[2], row[3]) for row in done.recorder.trajectories}
    holes_m = {boring["name"]: boring["position_m"] for boring in done.scenario.model_dump()["boring"]}
    came = {(vehicle, hole): time_s for time_s, vehicle, hole, _ in reversed(events(done, "came"))}
    brought = events(done, "brought")
    assert len(brought) >= 4
    for until_s, vehicle, hole, energy_j in brought:
        from_s = came[vehicle, hole]
        assert energy_j <= TRANSFER_W * (until_s - from_s + 1.0)
        (x_m, y_m), middle_s = holes_m[hole], round((from_s + until_s) / 2.0)
        assert math.dist(at_m[middle_s, vehicle], (x_m + 10.0, y_m)) <= 2.0
        assert any(math.dist(at_m[middle_s, one], (x_m, y_m)) <= 2.0 for one in ("AUV03", "AUV04"))


@pytest.mark.slow
@pytest.mark.parametrize("keys", [(), ("channel.per=0.8",), (lost("AUV02", 700.0),), (lost("AUV00", 600.0),)])
def test_nobody_takes_a_hole_for_bored_that_is_not(keys: tuple[str, ...]) -> None:
    """On a bad channel too, and where a helper is lost while it gives, or the head."""
    done = sampled(2, *keys)
    bored_s = {hole: time_s for time_s, _, hole, _ in events(done, "bored")}
    claimed = {row[4]: row[3] for row in reversed(done.recorder.items) if row[5] == "jobDone" and "hole" in row[4]}
    assert done.completed
    assert len(claimed) == len(bored_s) == 8
    assert all(claimed[hole] >= bored_s[hole] for hole in claimed)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("keys", "says"),
    [
        (EMPTY, "hole 6 impossible, as vehicles say"),
        ((lost("AUV03", 700.0),), "no vehicle left that is able to do hole 2, hole 3, hole 4"),
    ],
)
def test_without_energy_or_drill_the_mission_ends_and_says_so(keys: tuple[str, ...], says: str) -> None:
    """Nobody has energy to spare; who has called is lost. All sites are surveyed, and all come home before the end."""
    done = sampled(1, *keys, "mission.wait_s=600.0")
    assert not done.completed
    assert says in done.reason
    surveyed = {row[2] for row in done.recorder.rows("jobs") if row[2].startswith("site")}
    assert len(surveyed) == 18


def test_the_order_of_vehicles_in_the_file_changes_nothing(tmp_path: Path) -> None:
    tables = raw()
    tables["scenario"]["duration_s"] = 1500.0
    tables["vehicle"].reverse()
    turned = run(load(str(written(tmp_path, tables))), 1)
    assert sorted(map(repr, tracks(turned))) == sorted(map(repr, tracks(sampled(1, SHORT))))
