"""Objects in the sea: found by one vehicle, classified by several, fused alike on all; a biased sensor, and its ban.

The runs are those of ``mapping-objects`` at a loss of 0.4, seed 3. Where things lie is said by the scenario.
"""

import math
from collections import Counter
from functools import lru_cache
from typing import Any

import pytest

import remoras
from missions.mapping.sensors import CLASSES, MOST_SHARE, Classifier, ClassifierSettings, Seabed, SeaObject
from missions.runs.known import KnownAt
from remoras.sensor import Observation, Pose
from worldmodel import core_ontology_paths, read_tbox

VEHICLES = ("ASV00", "AUV00", "AUV01", "AUV02")
LIES_M = {"steamer": (350.0, 200.0), "barge": (200.0, 350.0), "outfall": (340.0, 340.0), "mound": (480.0, 230.0)}
OFF_M = 12.0
BIAS = {
    "kind": "biased",
    "vehicle": "AUV02",
    "sensor": "classifier",
    "attribute": "location",
    "offset": [OFF_M, 0.0],
    "at_s": 0.0,
}
BAN = {"issuer": "AUV00", "vehicle": "AUV02", "at_s": 600.0}
SETTLED_S = 120.0
"""17 TDMA frames of 7.09 s: an item that is repeated each frame is missed by one of three with 3 * 0.4^17 < 1e-6."""


@lru_cache
def finished(biased: bool = False, banned: bool = False) -> remoras.Run:
    chosen: dict[str, Any] = {"fault": [BIAS]} if biased else {}
    return remoras.run(
        "mapping-objects", per=0.4, seed=3, set=chosen | ({"ban": [{**BAN, "until_s": 1600.0}]} if banned else {})
    )


def seen_at(known: KnownAt, name: str, within_m: float = 20.0) -> str | None:
    """The instance that the vehicle takes for an object of the scenario; None if it knows of none there."""
    found = []
    for belief in known.beliefs:
        if belief.attribute == "location":
            at_m = known.fused(belief.subject, "location").value
            found.append((math.dist(at_m, LIES_M[name]), belief.subject))
    way_m, subject = min(found, default=(math.inf, None))
    return subject if way_m <= within_m else None


def test_what_two_vehicles_classified_is_fused_alike_on_all() -> None:
    run = finished()
    end_s = run.summary["mission_time_s"]
    fused = {}
    for vehicle in VEHICLES:
        known = run.known(vehicle, end_s)
        subject = seen_at(known, "steamer")
        fused[vehicle] = subject, known.fused(subject, "classification"), known.fused(subject, "location")
    assert len({repr(one) for one in fused.values()}) == 1
    subject, kind, place = fused["ASV00"]  # which has no such sensor
    assert kind.origins == place.origins == ("AUV00", "AUV01")
    assert kind.value == "wreck"
    assert math.dist(place.value, LIES_M["steamer"]) < 3.1 * 2.0 * math.sqrt(2.0)
    looks = run.known("ASV00", end_s).history(subject, "classification")
    # A look gives 0.8 to the class that it names, 0.2 / 3 to each of the three others; n sigmas of 2 m: 2 / sqrt(n).
    weights = {
        name: math.prod(0.8 if look.value == name else 0.2 / 3 for look in looks)
        for name in ("unknown", "wreck", "pipeline", "anomaly")
    }
    assert len(looks) > 2
    assert kind.uncertainty == pytest.approx(weights["wreck"] / sum(weights.values()))
    assert place.uncertainty == pytest.approx(2.0 / math.sqrt(len(looks)))
    alone = [one for one in run.known("ASV00", end_s).history(subject, "classification") if one.origin == "AUV00"]
    assert alone[-1].uncertainty == 0.8  # one source alone is less sure, and says another place
    said_m = [one for one in run.known("ASV00", end_s).history(subject, "location") if one.origin == "AUV00"]
    assert said_m[-1].value != f"POINT ({place.value[0]} {place.value[1]})"


def test_one_vehicle_creates_the_instance_and_another_adds_to_it() -> None:
    known = finished().known("ASV00", finished().summary["mission_time_s"])
    subject = seen_at(known, "steamer")
    origins = {one.origin for one in known.history(subject, "classification")}
    (created,) = known.history(subject, "type")
    assert created.value == "ObjectOfInterest"
    assert origins == {"AUV00", "AUV01"}
    assert created.origin in origins


@pytest.mark.slow
def test_a_bias_misleads_and_a_ban_corrects_until_it_is_taken_back() -> None:
    """The mean of an offset of 12 m and one of none is 6 m off; with the offset left out nothing is."""
    run = finished(biased=True, banned=True)
    sound = finished(biased=True)
    for vehicle in VEHICLES:
        before, during, after = (run.known(vehicle, at_s) for at_s in (599.0, 1599.0, 1600.0 + SETTLED_S))
        assert (before.banned, during.banned, after.banned) == ({}, {"AUV02": 0.0}, {})
        assert "AUV02" in before.fused(seen_at(before, "barge"), "location").origins
        subject = seen_at(during, "outfall")
        truth_m = LIES_M["outfall"][0]
        misled, corrected = after.fused(subject, "location"), during.fused(subject, "location")
        assert "AUV02" not in corrected.origins
        assert "AUV02" in misled.origins
        share = 1.0 / len(misled.origins)
        assert misled.value[0] - truth_m > OFF_M * share - 2.0 * 3.1  # of each look 3.1 sigmas at most
        assert misled.value[0] - corrected.value[0] > 2.0
    at_s = 599.0
    assert list(run.known("ASV00", at_s).beliefs) == list(sound.known("ASV00", at_s).beliefs)


@pytest.mark.slow
def test_what_was_known_before_a_ban_is_what_is_known_after_it_was_taken_back() -> None:
    run = finished(biased=True, banned=True)
    before, after = run.known("ASV00", 599.0), run.known("ASV00", 1600.0 + SETTLED_S)
    for belief in before.beliefs:
        told = after.history(belief.subject, belief.attribute, until_s=599.0)
        assert belief in told or belief.attribute in ("position", "batteryFraction")  # of which the newest is kept


def test_bans_are_in_the_table_of_faults_and_items() -> None:
    run = finished(biased=True, banned=True)
    faults = run.table("faults")
    assert faults[faults.kind == "biased"].detail.tolist() == ["classifier: location off by 12, 0, for good"]
    items = run.table("items")
    told = items[items.attribute == "bannedFrom"]
    assert told[["origin", "subject", "value"]].to_numpy().tolist() == [
        ["AUV00", "AUV02", "0.0"],
        ["AUV00", "AUV02", "1048575.0"],
    ]


def test_who_is_lost_says_no_ban() -> None:
    lost = {"kind": "lost", "vehicle": "AUV00", "at_s": 100.0}
    run = remoras.run("mapping-objects", seed=3, set={"scenario.duration_s": 900.0, "fault": [lost], "ban": [BAN]})
    faults = run.table("faults")
    assert faults[faults.kind == "ban not said"][["vehicle", "detail"]].to_numpy().tolist() == [["AUV00", "AUV02"]]
    assert run.known("ASV00", 890.0).banned == {}


# The sensor ------------------------------------------------------------------------------------------


def looks(settings: ClassifierSettings, seed: int, n: int, node: int = 1) -> list[Observation]:
    sensor = Classifier(settings, node)
    world = Seabed(25.0, {}, objects=(SeaObject("it", (10.0, 0.0), "wreck"),), seed=seed)
    pose = Pose(0.0, 0.0, 20.0, 0.0, 1.0)
    return [one for k in range(n) for one in sensor.sense(pose, world, settings.every_s * k)]


def test_a_look_is_as_often_right_as_it_says() -> None:
    """Of 200 looks 140 are right, within four times sqrt(200 * 0.7 * 0.3) = 6.5; wrong ones are even."""
    found = Counter(one.row[1] for one in looks(ClassifierSettings(p_right=0.7), 5, 200))
    assert abs(found["wreck"] - 140) < 26
    assert set(found) == set(CLASSES)
    others = [found[name] for name in CLASSES if name != "wreck"]
    assert max(others) - min(others) < 4 * math.sqrt(2 * 30)  # 30 of each on average


def test_the_place_of_a_look_has_the_stated_error() -> None:
    """Of 200 normal errors of sigma 2 the root of the mean square is within 0.4 of 2: four times 2 / sqrt(400)."""
    found = looks(ClassifierSettings(sigma_m=2.0), 5, 200)
    east = [one.row[2] - 10.0 for one in found]
    assert math.sqrt(sum(x * x for x in east) / len(east)) == pytest.approx(2.0, abs=0.4)
    assert max(map(abs, east)) <= 3.1 * 2.0
    assert MOST_SHARE < 1.0


def test_draws_are_keyed() -> None:
    settings = ClassifierSettings()
    assert looks(settings, 5, 9) == looks(settings, 5, 9)
    assert looks(settings, 5, 9) != looks(settings, 6, 9)
    assert looks(settings, 5, 9) != looks(settings, 5, 9, node=2)
    fine = looks(ClassifierSettings(every_s=1.0), 5, 9)
    assert [one.row for one in fine] == [one.row for one in looks(settings, 5, 9)]


def test_classes_are_those_of_the_ontology() -> None:
    assert read_tbox(*core_ontology_paths()).attribute_named("classification").symbols == ("unknown", *CLASSES)
