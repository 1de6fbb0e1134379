"""Runs of archaeological search, with and without communication, and refused tables."""

import math
from pathlib import Path

import pytest
from recorded import metric, said
from searching import SILENCE, Facts, mission, run, run_of, text

from missions.arrows.detectors import shown_code
from missions.arrows.mission import ArrowsMission
from missions.runs.run import Run
from remoras.activities import Activity, ActivityType
from remoras.behaviours import Behaviour
from remoras.motion import Motion
from remoras.picture import Picture


def last_apart_bits(of: Run) -> float:
    return float(of.recorder.rows("fleet_maps")[-1][2])


def test_run_finds_identifies_and_images_sites_and_all_return() -> None:
    of = run()
    assert metric(of, "found_fraction") > 0.0
    assert metric(of, "identified_fraction") > 0.0
    assert {"AUV03"} == {vehicle for _, vehicle, *_ in said(of, "picturedBy")}
    assert [one.name for one in of.milestones if one.group == "Divers"] == ["gathered"]
    assert of.recorder.trajectories[-1][0] < 1200.0 + 900.0


def test_without_communication_all_return_with_different_maps() -> None:
    silent = run(*SILENCE)
    assert metric(silent, "found_fraction") > 0.0
    assert last_apart_bits(silent) > 5.0 * last_apart_bits(run())
    at_m = {row[1]: (row[2], row[3]) for row in silent.recorder.trajectories[-4:]}
    assert all(math.dist(place_m, (600.0, -60.0)) <= 60.0 for place_m in at_m.values())


def test_searchers_that_receive_nothing_are_alone_for_all_of_a_run_that_ends_early() -> None:
    """All are lost at 300 s of a search of 1200 s, and out of contact from 60 s without reception on."""
    lost = [f"{{vehicle='{name}', kind='{kind}', at_s={at_s}}}" for name in ("ASV00", "AUV01", "AUV02", "AUV03")
            for kind, at_s in (("deaf", 0.0), ("lost", 300.0))]  # fmt: skip
    of = run(f"fault=[{', '.join(lost)}]")
    assert of.ended_s == 300.0
    assert 0.7 < metric(of, "alone_fraction") <= 0.8


def test_contact_rule_changes_no_position_if_all_packets_arrive() -> None:
    """Not one position differs, neither at the start nor near the rally point."""
    loud = "channel.source_level_db=130"
    held, free = (run(loud, f"mission.contact={one}") for one in ("true", "false"))
    assert held.recorder.trajectories == free.recorder.trajectories


def camera_of(of: ArrowsMission) -> Behaviour:
    return of.behaviour_for(Activity("Identifying", ActivityType.GUIDANCE, ("search area",)), of._database["AUV03"])


def test_camera_without_finds_returns_to_regain_contact() -> None:
    """Otherwise it would hover at the last identified anomaly and receive no further one."""
    far, near = Motion(200.0, 700.0), Motion(690.0, 390.0)
    picture = Picture(frame_s=6.0, facts=Facts({}))
    picture.body.now_s = 1000.0
    for contact, heard_s, goes in (("true", 100.0, True), ("true", 900.0, False), ("false", 100.0, False)):
        of = mission("channel.source_level_db=108", f"mission.contact={contact}")
        camera = camera_of(of)
        picture.peers.heard_s = {"AUV01": heard_s, "AUV02": 990.0}
        assert (camera.perceive(far, picture, True).stimulus > 0.0) is goes
        reference = camera.reference(far, picture)
        assert (reference is not None and reference.target_m == of.reach.point_m) is goes
        assert camera.perceive(near, picture, True).stimulus == 0.0


def test_object_with_two_names_is_identified_once_from_all_its_images() -> None:
    """Images of it are noted under one of its two names; a camera that waits for those of the other waits for good."""
    facts, at_m = Facts({}), Motion(600.0, 400.0)
    facts.add("Anomaly-310", (600.0, 400.0))
    facts.add("Anomaly-610", (608.0, 400.0))
    facts.told["shown", "Anomaly-610"] = {shown_code(number, 3, 4) for number in range(4)}
    camera, picture = camera_of(mission()), Picture(frame_s=6.0, facts=facts)
    picture.body.now_s = 100.0
    (concluded,) = camera.perceive(at_m, picture, True).concludes
    ((anomaly, attribute, identity, _),) = concluded.facts
    assert (attribute, identity) == ("identity", "rock")
    facts.known["identity", anomaly] = identity
    camera.perceive(at_m, picture, True)
    assert camera.perceive(at_m, picture, True).stimulus == 0.0


@pytest.mark.slow
def test_anomalies_that_are_not_sent_are_not_identified(tmp_path: Path) -> None:
    file = tmp_path / "mute.toml"
    file.write_text(text().replace("\nlocation = 40\ncontact = 40", ""), encoding="utf-8")
    assert metric(run_of(str(file)), "identified_fraction") == 0.0
    assert metric(run(), "identified_fraction") > 0.0
