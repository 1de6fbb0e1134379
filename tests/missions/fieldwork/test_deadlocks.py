"""Two vehicles, each at a line that takes an escort: a deadlock unless one leaves its line for the other."""

import re
from pathlib import Path

import pytest
from sampling import sampled
from varied import Varied
from watched import JETTY_M, TEAM, seen

from missions.meeting import Meeting
from missions.meeting.meeting import MeetingSettings
from missions.meeting.truth import JOBS, JobTruth
from missions.runs.results import summary, write_results
from missions.runs.run import Run, run
from missions.scenarios import load
from missions.verification import verify
from remoras.activities import ROOM, Wait
from remoras.recorder import Recorder
from remoras.truth import FleetView

ESCORTS = Varied("escort-lines", "lines.toml")
UNCALLED = "decision.weight_external=0"
LOST = "fault=[{vehicle='AUV01', kind='lost', at_s=300.0}]"


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Path:
    tables = ESCORTS.raw()
    tables["vehicle"] = tables["vehicle"][:2]
    places = ("west", -200.0), ("east", 200.0)
    tables["line"] = [
        {"name": name, "from_m": [x_m, 0.0], "to_m": [x_m, 60.0], "escorted": True} for name, x_m in places
    ]
    tables["scenario"]["duration_s"] = 900.0
    return ESCORTS.written(tmp_path_factory.mktemp("two"), tables)


def flown(path: Path, *keys: str) -> Run:
    return run(load(str(path), [("--set", key) for key in keys]), 1)


def stuck(of: Run) -> list[tuple[str, float]]:
    return [(stone.vehicle, stone.time_s) for stone in of.milestones if stone.name == "deadlock"]


def test_deadlock_of_two_is_found_with_its_time_and_vehicles(two: Path, tmp_path: Path) -> None:
    """Without calls both wait to the end; the cycle begins with the later of two waits of 2400 s."""
    uncalled = flown(two, UNCALLED, "scenario.duration_s=400.0")
    began_s = max(float(until_s) for until_s in re.findall(r"an escort on \w+ until (\d+) s", uncalled.reason)) - 2400.0
    assert 0.0 < began_s < 400.0
    assert stuck(uncalled) == [("AUV00", began_s), ("AUV01", began_s)]
    assert summary(uncalled)["deadlock_s"] == began_s
    assert f"deadlock since {began_s:.0f} s: AUV00, AUV01 wait for each other" in uncalled.reason
    assert flown(two, UNCALLED, "scenario.duration_s=400.0").milestones == uncalled.milestones
    write_results(uncalled, tmp_path / "run")
    assert not verify(tmp_path / "run").findings


def test_call_ends_the_deadlock(two: Path) -> None:
    called = flown(two)
    assert called.completed, called.reason
    assert summary(called)["deadlock_s"] is None


def test_endless_wait_for_a_lost_vehicle_is_no_deadlock(two: Path) -> None:
    """The other ends during its wait: the reason of the run names the wait and the lost vehicle."""
    left = flown(two, UNCALLED, LOST, "scenario.duration_s=320.0")
    assert "AUV00 waits for an escort" in left.reason
    assert "out of action: AUV01" in left.reason
    assert stuck(left) == []
    assert summary(left)["deadlock_s"] is None


HELP, NO_ROOM = Wait("others at lift", 2400.0, 30.0), Wait(ROOM, float("inf"), 50.0)


@pytest.mark.parametrize(
    ("waits", "near", "found"),
    [
        ((HELP, HELP), True, [("A", 30.0), ("B", 30.0)]),  # each takes the other to be elsewhere
        ((HELP, None), True, []),  # B may come
        ((HELP, NO_ROOM), True, [("A", 50.0), ("B", 50.0)]),  # A stands in its way
        ((HELP, NO_ROOM), False, []),  # another vehicle, which is gone, stood in its way
        ((HELP._replace(n_peers=2), HELP), True, []),  # a third is lost
    ],
)
def test_cycle_needs_each_vehicle_to_wait_for_the_next(waits, near: bool, found: list[tuple[str, float]]) -> None:
    truth = JobTruth(
        Meeting({"Team": TEAM}, {"jetty": JETTY_M}, MeetingSettings(arrival_radius_m=3.0), {}),
        "Lifting",
        Recorder([JOBS]),
    )
    places_m = (0.0, 0.0), (6.0 if near else 60.0, 0.0)
    fleet = FleetView(
        tuple(seen(name, position_m=m, waits=wait) for name, m, wait in zip("AB", places_m, waits, strict=True))
    )
    truth.observe(fleet, 60.0)
    truth.close(fleet, 60.0)
    assert [(stone.vehicle, stone.time_s) for stone in truth.milestones if stone.name == "deadlock"] == found


def test_vehicle_at_the_rally_point_waits_for_late_ones() -> None:
    """B is there and would have to come: it waits for A, which waits for help."""
    truth = JobTruth(
        Meeting({"Team": TEAM}, {"jetty": JETTY_M}, MeetingSettings(arrival_radius_m=3.0), {}),
        "Lifting",
        Recorder([JOBS]),
    )
    fleet = FleetView((seen("A", waits=HELP), seen("B", position_m=JETTY_M, performed=("Homing",))))
    truth.observe(fleet, 70.0)
    assert "deadlock since 70 s: A, B" in truth.close(fleet, 90.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "more"),
    sampled(
        [
            ("recovery-field", "lifts.number=6"), ("escort-lines", "line.line 1.escorted=true"),
            ("ferry-passage", "mission.handling_s=30.0"), ("resupply-field", "transfer.power_w=300.0"),
        ],
        ("recovery-field", "lifts.number=6"),
    ),
)  # fmt: skip
def test_no_mission_with_calls_ends_in_a_deadlock(name: str, more: str) -> None:
    keys = "channel.per=0.5", more
    assert stuck(run(load(name, [("--set", key) for key in keys]), 42)) == []
