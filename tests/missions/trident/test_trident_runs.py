"""Runs: what comes of a failed service under each response, and what each part of the mission is there for."""

import math

import pytest
from intervening import SEED, Run, metric, run, said
from sampling import sampled

from missions.trident.behaviours import Escorting
from missions.trident.services import ATTEMPTS
from remoras.behaviours import ADVANCING, DUE, IDLE, Reference
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.radio import note_position
from tests.sample_vehicles import AUV

DECEIVED = 66
"""Seed of a run in which a decoy looks most like the target from above."""
MISLED = 70
"""Seed of a run in which the first look of the sonar at a decoy takes it for the target."""
MISSED = 62
"""Seed of a run in which the first look of the sonar at the target takes it for a decoy."""
CAMERA = ("IAUV00 camera",)


def recovered_s(of: Run) -> float:
    found = metric(of, "target_recovered_s")
    return math.inf if found is None else found


def steps(of: Run, name: str) -> list[str]:
    """Tasks of that name that were ever running, in order, each once."""
    tasks = [str(row[8]) for row in of.recorder.plans if str(row[8]).startswith(f"{name}(") and row[10] == "running"]
    return list(dict.fromkeys(tasks))


def test_without_faults_all_three_responses_do_the_same() -> None:
    times_s = {response: recovered_s(run(response=response)) for response in ("fixed", "repair", "matching")}
    assert len(set(times_s.values())) == 1
    assert times_s["fixed"] < math.inf
    assert run().completed


def test_one_map_is_made_of_what_both_have_charted() -> None:
    finished = run()
    by = {
        name: {row[2:] for row in finished.recorder.rows("charted") if row[1] == name} for name in ("ASV00", "IAUV00")
    }
    assert by["ASV00"]
    assert by["IAUV00"]
    assert not by["ASV00"] & by["IAUV00"]
    assert metric(finished, "charted_fraction") == 1.0


@pytest.mark.slow
@pytest.mark.parametrize("service", ["IAUV00 arm", "ASV00 console"])
def test_a_fixed_plan_stops_where_its_service_fails(service: str) -> None:
    assert recovered_s(run(response="fixed", failing=(service,))) == math.inf
    assert recovered_s(run(failing=(service,))) < math.inf


def test_a_repair_notices_by_what_does_not_come_of_it_and_matching_by_what_the_service_says() -> None:
    """Twelve attempts of 60 s are waited for, and one minute, before the repair turns to the gripper."""
    repaired, matched = run(response="repair", failing=("IAUV00 arm",)), run(failing=("IAUV00 arm",))
    assert [one.split(", ")[2] for one in steps(repaired, "Handling")] == ["IAUV00 arm", "IAUV00 gripper"]
    assert [one.split(", ")[2] for one in steps(matched, "Handling")] == ["IAUV00 gripper"]
    assert recovered_s(repaired) - recovered_s(matched) > 600.0


def test_a_service_of_the_other_vehicle_takes_the_place_of_one_that_failed() -> None:
    """Both surveys of the AUV fail: it asks the surface vehicle, which charts what is left and says when it is done."""
    failing = ("IAUV00 stereo", "IAUV00 sidescan")
    assert recovered_s(run(response="repair", failing=failing)) == math.inf
    finished = run(failing=failing)
    assert [row[1:] for row in said(finished, "requestedOf")] == [("IAUV00", "east", "ASV00 multibeam")]
    assert [row[1:] for row in said(finished, "surveyedBy")][-1] == ("ASV00", "east", "ASV00")
    assert recovered_s(finished) < math.inf


def test_without_inference_nothing_is_matched() -> None:
    finished = run("mission.inference=false", until_s=600.0)
    assert metric(finished, "charted_fraction") == 0.0
    assert steps(finished, "Surveying") == []


def test_the_choice_goes_over_to_the_recogniser_when_the_console_fails() -> None:
    assert {row[1] for row in said(run(), "chosen")} == {"ASV00"}
    assert {row[1] for row in said(run(failing=("ASV00 console",)), "chosen")} == {"IAUV00"}


def test_a_module_without_self_test_fails_in_silence_and_is_noticed_all_the_same() -> None:
    """Tiles stay blank that the vehicle is over: after a minute of it the step has failed, and the next way is gone."""
    silent = run("vehicle.IAUV00.sensor.1.self_test=false", failing=("IAUV00 stereo",), until_s=1200.0)
    assert {row[3] for row in said(silent, "serviceStatus")} == {"available"}
    failed_s = [row[0] for row in silent.recorder.faults if row[2] == "failed step"]
    assert 300.0 < failed_s[0] < 500.0
    assert [one.split(", ")[1] for one in steps(silent, "Surveying") if one.startswith("Surveying(east")] == [
        "IAUV00 stereo)",
        "IAUV00 sidescan)",
    ]


def test_a_decoy_that_is_found_out_is_rejected_and_another_is_chosen() -> None:
    """Whatever looks like the target from above, the camera tells from near."""
    finished = run(seed=DECEIVED)
    (_, _, rejected, verdict), *_ = said(finished, "verdict")
    assert verdict == "decoy"
    chosen = [row[3] for row in said(finished, "chosen")]
    assert chosen[0] == rejected
    assert rejected not in chosen[1:]
    assert metric(finished, "n_violations") == 0


# Verdicts

ONE_LOOK = ("mission.p_mistaken=0.3", "mission.p_missed=0.3")
"""A look of the sonar is right in 85 of 100, so one is enough."""


def test_looks_go_on_until_they_are_sure_where_one_would_mislead() -> None:
    """A verdict that one look makes is wrong here; with as many as the stated rates ask for the target is recovered."""
    misled, sure = (run(*settings, failing=CAMERA, seed=MISLED) for settings in (ONE_LOOK, ()))
    assert metric(misled, "n_mistaken") == 1
    assert recovered_s(misled) == math.inf
    assert metric(sure, "n_mistaken") == 0
    assert recovered_s(sure) < math.inf


@pytest.mark.slow
@pytest.mark.parametrize("at_s", [100.0, *(pytest.param(at_s, marks=pytest.mark.thorough) for at_s in (400.0, 800.0))])
def test_with_the_camera_dead_the_target_is_recovered_by_the_sonar_and_no_decoy(at_s: float) -> None:
    """20 seeds: one look had recovered it in 12, and a decoy in 5."""
    runs = [run(failing=CAMERA, at_s=at_s, seed=seed, until_s=7200.0) for seed in range(61, 81)]
    assert sum(recovered_s(of) < math.inf for of in runs) >= 18
    assert sum(metric(of, "n_mistaken") for of in runs) <= 1


def test_a_candidate_that_was_rejected_is_looked_at_anew_once_none_is_left() -> None:
    """One look rejects; it is wrong of the target, so that nothing is left to choose."""
    hasty = "mission.p_missed=0.45"
    never, again = (run(hasty, f"mission.looks_again={n}", failing=CAMERA, seed=MISSED, until_s=5000.0) for n in (0, 2))
    assert recovered_s(never) == math.inf
    assert recovered_s(again) < math.inf
    assert [row[3] for row in said(never, "verdict")].count("open") == 0
    assert [row[3] for row in said(again, "verdict")].count("open") >= 1


# Navigation


@pytest.mark.slow
def test_fixes_bound_the_error_and_escort_keeps_them_coming() -> None:
    error_m = {e: metric(run(f"mission.escort_m={e}"), "navigation_error_m") for e in (0.0, 80.0)}
    assert error_m[80.0] < 10.0 < error_m[0.0]
    without = metric(run(failing=("ASV00 usbl",), at_s=1.0, response="fixed"), "navigation_error_m")
    assert without > 2.0 * error_m[0.0]


def test_an_escort_waits_on_the_side_of_home_for_who_is_out_and_heard() -> None:
    escorting, picture = Escorting(("IAUV00", "IAUV01"), (0.0, 0.0), 25.0, 80.0, AUV), Picture(frame_s=2.0)
    here, away = Motion(0.0, 0.0, 0.0, 0.0), Motion(120.0, 160.0, 0.0, 0.0)
    assert escorting.perceive(here, picture, False) == IDLE  # nobody has been heard
    for name, place_m in (("IAUV01", (0.0, 300.0)), ("IAUV00", (180.0, 240.0))):
        note_position(picture.peers, name, place_m)
        picture.peers.heard_s[name] = 0.0
    assert escorting.perceive(here, picture, False) == DUE
    (x_m, y_m), speed_mps, *_ = escorting.reference(here, picture) or ((0.0, 0.0), 0.0)
    assert (x_m, y_m, speed_mps) == (pytest.approx(132.0), pytest.approx(176.0), AUV.transit_speed_mps)  # 80 of 300 m
    assert escorting.perceive(away, picture, True) == ADVANCING  # near, and still due
    note_position(picture.peers, "IAUV00", (15.0, 20.0))  # home: the next one
    assert (escorting.reference(here, picture) or Reference((0.0, 0.0), 0.0)).target_m == pytest.approx((0.0, 220.0))
    picture.body.now_s = 41.0  # not heard for 20 frames: nobody knows where they are
    assert escorting.perceive(here, picture, True) == IDLE


@pytest.mark.parametrize("at_s", sampled([900.0, 1450.0], 1450.0))
def test_who_is_lost_is_not_waited_for_at_sea(at_s: float) -> None:
    """The surface vehicle kept near to where it last heard the AUV until the time limit of 7200 s."""
    finished = run(f"fault=[{{kind='lost',vehicle='IAUV00',at_s={at_s}}}]", until_s=7200.0)
    assert not finished.completed
    last = finished.recorder.rows("trajectories")[-1]
    assert last[0] < at_s + 300.0
    of_asv = [row for row in finished.recorder.rows("trajectories") if row[1] == "ASV00"][-1]
    assert math.dist(of_asv[2:4], (190.0, 60.0)) <= 25.0


def test_who_holds_on_does_not_leave_for_a_fix_when_the_other_is_lost() -> None:
    """Its fixes came from who is lost. It went for one, came back without holding, and could not handle."""
    finished = run("fault=[{kind='lost',vehicle='ASV00',at_s=1500.0}]", seed=3, until_s=7200.0)
    (held,) = [row for row in said(finished, "heldBy") if row[1] == "IAUV00"]
    assert said(finished, "fixedOn") == []
    assert held[0] > 1500.0  # and it takes longer than to notice the loss
    assert metric(finished, "recovered")


def test_a_dead_positioning_system_is_made_up_for_at_the_transponder() -> None:
    finished = run(failing=("ASV00 usbl",))
    (fixed, *_) = said(finished, "fixedOn")
    assert fixed[1:] == ("IAUV00", "IAUV00", "true")
    assert said(run(failing=("ASV00 usbl",), response="fixed"), "fixedOn") == []


@pytest.mark.slow
def test_attempts_are_made_where_the_candidate_was_seen_and_a_worse_finder_makes_them_worse() -> None:
    def off_m(*settings: str) -> float:
        runs = [run(*settings, seed=seed, per=0.0) for seed in (2, 3, 4)]
        rows = [row for one in runs for row in one.recorder.rows(ATTEMPTS.name)]
        return sum(row[5] for row in rows) / len(rows)

    near_m, far_m = off_m(), off_m("vehicle.IAUV00.sensor.4.sigma_m=1.5", "vehicle.IAUV00.sensor.4.p_right=1.0")
    assert near_m < 1.0 < far_m


# Communication


@pytest.mark.slow
def test_with_all_messages_lost_each_does_what_it_can_alone_and_comes_home() -> None:
    """The AUV takes over all work, chooses by itself and recovers; both end where they meant to meet."""
    silence = ",".join(f'{{kind="mute",vehicle="{name}",at_s=0.0}}' for name in ("ASV00", "IAUV00"))
    finished = run(f"fault=[{silence}]", until_s=7200.0)
    assert metric(finished, "charted_fraction") == 1.0
    assert metric(finished, "recovered")
    assert {row[1] for row in said(finished, "chosen")} >= {"IAUV00"}
    last = {row[1]: row[2:4] for row in finished.recorder.trajectories}
    for name in ("ASV00", "IAUV00"):  # as far as it knows where it is: it has no fixes
        assert math.dist(last[name], (190.0, 60.0)) < 25.0 + 100.0


def test_one_seed_same_bytes() -> None:
    once, again = run(failing=("IAUV00 arm",), until_s=1800.0), run.__wrapped__(failing=("IAUV00 arm",), until_s=1800.0)
    for name in ("trajectories", "items", "packets", "plans", "charted", "attempts", "choreography"):
        assert once.recorder.rows(name) == again.recorder.rows(name)


@pytest.mark.slow
@pytest.mark.parametrize(
    "strategy",
    sampled(
        ["plan-and-dispatch", "central", "contract-net", "status-broadcast", "cbba", "rendezvous-sync", "oracle"],
        "central", "contract-net", "cbba", "oracle",
    ),
)  # fmt: skip
def test_every_strategy_that_tells_its_vehicles_something_recovers_the_target(strategy: str) -> None:
    finished = run(f"strategy.name={strategy}", seed=SEED)
    assert finished.completed
    assert metric(finished, "recovered")
