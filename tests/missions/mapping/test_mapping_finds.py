"""Finds: placed by the seed, inspected as jobs once reported, with true completion."""

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
from surveying import mapper
from watched import Facts

from missions.mapping.detections import PATIENCE_S, Inspecting, InspectionJob, seabed_with_finds
from missions.mapping.scenario import FindsTable
from missions.mapping.sensors import Seabed, SeabedFeature, Stays, SwathSensor
from missions.runs.results import summary
from missions.runs.run import Run, run
from missions.scenarios import load
from missions.scenarios.scenario import Scenario
from remoras.motion import Motion, advance
from remoras.picture import Picture
from remoras.sensor import Pose
from remoras.strategies import strategies
from remoras.work import Outlook

SEABED = Seabed.of_areas(25.0, {"area": ((0.0, 0.0), (0.0, 100.0), (100.0, 100.0), (100.0, 0.0))})
"""Sixteen cells."""
FINDS = FindsTable(number=3)
QUICK = ("remoras", "fixed-partition")
"""Strategies whose missions are flown in every test run."""
SOME = list(strategies())[::3]


def with_finds(number: int = 2, *more: str) -> Scenario:
    settings = (f"finds.number={number}", "finds.longest_stay_s=200", *more)
    return load("mapping-rendezvous", [("--set", one) for one in settings])


def milestones(done: Run, name: str) -> list[tuple[float, str]]:
    return [(m.time_s, m.vehicle) for m in done.milestones if m.name == name]


# Off ---------------------------------------------------------------------------------------------


def test_find_below_a_vehicle_is_reported_with_its_position_error() -> None:
    """The vehicle is above the only feature but believes itself 50 m beside it, where another cell is mapped."""
    (cell, feature), *_ = seabed_with_finds(SEABED, FINDS, 5).features.items()
    world = replace(SEABED, features={cell: feature})
    x_m, y_m = (cell[0] + 0.5) * 25.0, (cell[1] + 0.5) * 25.0
    off_m = -50.0 if x_m > 50.0 else 50.0
    sensor = SwathSensor(20.0, 2.0, "AUV00")
    pose = Pose(x_m, y_m, 20.0, 0.0, 1.0, (off_m, 0.0))
    facts = [fact for one in sensor.sense(pose, world, 0.0) for fact in one.facts]
    here = feature.position_m
    assert (feature.name, "foundAt", (here[0] + off_m, here[1])) in facts
    beside = cell[0] + round(off_m / 25.0), cell[1]
    assert [fact for fact in facts if fact[1] == "mappedCell"] == [("area", "mappedCell", SEABED.cells[beside][1])]
    assert sensor.sense(pose, world, 1.0) == []


# Drawing -----------------------------------------------------------------------------------------


def test_features_are_in_distinct_cells_and_more_keep_the_first_ones() -> None:
    few, many = (seabed_with_finds(SEABED, FINDS.model_copy(update={"number": n}), 5).features for n in (3, 16))
    assert set(many) == set(SEABED.cells)
    assert list(few.items()) == list(many.items())[:3]
    assert [feature.name for feature in few.values()] == [f"find {n}" for n in (1, 2, 3)]
    for (column, row), feature in many.items():
        assert feature.position_m == ((column + 0.5) * 25.0, (row + 0.5) * 25.0)
        assert FINDS.shortest_stay_s <= feature.stay_s <= FINDS.longest_stay_s


# Job ---------------------------------------------------------------------------------------------


def test_inspection_takes_way_and_mean_stay_once_its_place_is_known() -> None:
    job, data = InspectionJob("find 1", 330.0), mapper()
    assert job.left(Facts()) is None
    found = job.left(Facts({("foundAt", "find 1"): (300.0, 400.0)}))
    assert found is not None
    assert found.after(Outlook(10.0, (0.0, 0.0)), data) == Outlook(
        10.0 + 500.0 / data.transit_speed_mps + 330.0, (300.0, 400.0)
    )
    done = job.left(Facts({("foundAt", "find 1"): (300.0, 400.0), ("inspectedBy", "find 1"): "AUV01"}))
    assert done is not None
    assert done.share_left == 0.0
    assert job.after(Outlook(0.0, (0.0, 0.0)), replace(data, sensors=())) is None
    assert job.is_able(mapper(swath_m=0.5))  # however narrow, it is a mapping sensor


# On site -----------------------------------------------------------------------------------------

WRECK = SeabedFeature("find 1", (62.5, 12.5), 30.0, 8.0, 0.6)
WRECKED = replace(SEABED, features={(2, 0): WRECK})


def test_only_time_near_and_slow_counts_as_stay() -> None:
    stays = Stays()
    here, beside = (62.5, 12.5), (62.5, 20.6)
    ticks = [(here, 0.6)] * 20 + [(beside, 0.0)] * 5 + [(here, 0.61)] * 5 + [(here, 0.0)] * 20
    over = [n for n, (at_m, speed) in enumerate(ticks) if stays.inspected(WRECKED, at_m, speed, float(n))]
    # 20 looks last 19 s; back at tick 30, 11 s more end at tick 41
    assert over == [41]


def test_sensor_reports_a_find_and_the_end_of_its_inspection() -> None:
    sensor = SwathSensor(25.0, 1.3, "AUV07")
    first = sensor.sense(Pose(62.5, 12.5, 20.0, 0.0, 0.0), WRECKED, 0.0)
    assert [one.facts for one in first] == [(("area", "mappedCell", 2),), (("find 1", "foundAt", (62.5, 12.5)),)]
    later = [(t, one.facts) for t in range(1, 60) for one in sensor.sense(Pose(62.5, 12.5, 20.0, 0.0, 0.0), WRECKED, t)]
    assert later == [(30, (("find 1", "inspectedBy", "AUV07"),))]


def inspect(sensor_works: bool, water_mps: float = 0.0) -> tuple[Inspecting, list[tuple[float, float]], Any]:
    """A vehicle 200 m away inspects the wreck: the behaviour, (distance, speed) by tick, and its last perception.

    The water runs from the wreck to the vehicle.
    """
    data, facts, motion = mapper(), Facts({("foundAt", "find 1"): WRECK.position_m}), Motion(262.5, 12.5)
    behaviour, picture = Inspecting("find 1", FINDS, data), Picture(facts=facts)
    sensor, track = data.sensors[0].make(data), []
    perception = behaviour.perceive(motion, picture, False)
    for now_s in range(1, 2000):
        picture.body.now_s = float(now_s)
        if (reference := behaviour.reference(motion, picture)) is not None:
            advance(motion, data, reference.target_m, reference.speed_mps, 1.0)
        motion.x_m += water_mps
        pose = Pose(motion.x_m, motion.y_m, 20.0, motion.heading_rad, motion.speed_mps)
        for observation in sensor.sense(pose, WRECKED, float(now_s)) if sensor_works else ():
            facts.known |= {(attribute, subject): value for subject, attribute, value in observation.facts}
        track.append((math.dist(motion.position_m, WRECK.position_m), motion.speed_mps))
        perception = behaviour.perceive(motion, picture, True)
        if perception.done or perception.failed:
            break
    return behaviour, track, perception


def test_vehicle_slows_down_near_a_find_and_stays_until_inspected() -> None:
    _, track, perception = inspect(sensor_works=True)
    assert perception.done
    assert max(speed for _, speed in track) == pytest.approx(mapper().transit_speed_mps)
    assert all(speed <= FINDS.close_speed_mps + 1e-9 for way_m, speed in track if way_m <= FINDS.close_radius_m)
    near = [way_m <= FINDS.close_radius_m for way_m, _ in track]
    assert sum(near) == pytest.approx(WRECK.stay_s, abs=3.0)
    assert all(after or not before for before, after in pairwise(near)), "it never leaves"


def test_inspection_fails_after_the_longest_stay_with_a_dead_sensor() -> None:
    _, track, perception = inspect(sensor_works=False)
    assert perception.failed
    on_site_s = sum(way_m <= FINDS.close_radius_m for way_m, _ in track)
    assert on_site_s == pytest.approx(FINDS.longest_stay_s + PATIENCE_S, abs=3.0)


def test_find_is_inspected_in_a_current_of_half_the_close_speed() -> None:
    assert inspect(sensor_works=True, water_mps=0.5 * FINDS.close_speed_mps)[2].done


# The mission -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("strategy", "per"),
    [*((one, 0.0) for one in QUICK), *(pytest.param(one, 0.4, marks=pytest.mark.slow) for one in SOME)],
)
def test_all_finds_are_inspected_before_the_group_meets(strategy: str, per: float) -> None:
    done = run(with_finds(3, f"strategy.name={strategy}", f"channel.per={per}"))
    assert done.completed, done.reason
    found, inspected = milestones(done, "found"), milestones(done, "inspected")
    assert len(found) == len(inspected) == 3
    gathered_s = next(m.time_s for m in done.milestones if (m.name, m.group) == ("gathered", "Operational"))
    assert max(time_s for time_s, _ in inspected) < gathered_s
    told = summary(done)
    assert told["finds_inspected_fraction"] == 1.0
    if strategy == "fixed-partition":  # nobody hears of what others have found
        assert sorted(vehicle for _, vehicle in found) == sorted(vehicle for _, vehicle in inspected)
