"""What the strategies do, and that it is gone when its cause is: on the patches."""

from dataclasses import dataclass, replace
from functools import cache
from typing import Any, ClassVar

import pytest
from sampling import sampled

from missions.mapping.metrics import area_roles
from missions.runs.assembly import actual, assemble
from missions.runs.run import Run, run
from missions.runs.setup import resolved
from missions.runs.summary import summary
from missions.scenarios import load
from remoras.strategies import strategies
from remoras.strategies.remoras import Remoras
from remoras.strategy import Declaration

SEEDS = (1, 2, 3)
CUT_OFF_S = (200.0, 1200.0)
NEVER = 10_000
FOR_EVER = f"communication.lease_frames={NEVER}", "communication.false_absence=0"
"""Nobody is taken for absent."""
"""As many frames as a parameter allows: 70000 s, far beyond the end of the run."""


@cache
def finished(strategy: str, seed: int, *settings: str) -> Run:
    loaded = load("mapping-patches", [("--set", setting) for setting in (f"strategy.name={strategy}", *settings)])
    return run(loaded, seed)


def report(strategy: str, seed: int, *settings: str) -> dict[str, Any]:
    return summary(finished(strategy, seed, *settings))


def duplicated(strategy: str, per: float) -> list[float]:
    return [report(strategy, seed, f"channel.per={per}")["duplicate_fraction"] for seed in SEEDS]


def taken_by(done: Run) -> dict[str, list[str]]:
    """Who came to play each role with an area, in time order."""
    taken: dict[str, list[str]] = {}
    for _, vehicle, group, role, event in done.recorder.roles:
        if event == "assigned" and (group, role) in area_roles(done.scenario):
            taken.setdefault(role, []).append(vehicle)
    return taken


def cut_off(vehicle: str, until_s: float = CUT_OFF_S[1]) -> str:
    return f'channel.blackout=[{{from_s={CUT_OFF_S[0]}, until_s={until_s}, vehicle="{vehicle}"}}]'


# Duplicated work comes from loss ------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(("strategy", "per"), sampled([("cbba", 0.95), ("status-broadcast", 0.97)], ("cbba", 0.95)))
def test_work_is_duplicated_when_nearly_all_packets_are_lost_and_not_without_loss(strategy: str, per: float) -> None:
    assert max(duplicated(strategy, per)) > 0.05
    assert max(duplicated(strategy, 0.0)) < 0.005  # who chooses in the same frame hears of it one frame later


@pytest.mark.slow
@pytest.mark.parametrize("channel", ["per=0.9", "blackout=[{from_s=0.0, until_s=1e5}]", "name=perfect"])
def test_fixed_partition_sends_nothing_and_no_channel_changes_it(channel: str) -> None:
    for seed in SEEDS:
        one, other = finished("fixed-partition", seed), finished("fixed-partition", seed, f"channel.{channel}")
        assert one.recorder.packets == other.recorder.packets == []
        assert one.recorder.trajectories == other.recorder.trajectories
        assert one.recorder.rows("coverage") == other.recorder.rows("coverage")
        assert summary(other)["duplicate_fraction"] == 0.0
        assert other.completed


# Meetings cost time -------------------------------------------------------------------------------


@pytest.mark.slow
def test_without_loss_central_is_faster_than_meetings() -> None:
    """With two jobs for each between meetings there are three meetings; five take nearly all of the thirteen."""
    for seed in SEEDS:
        meeting = report("rendezvous-sync", seed, "strategy.parameters.jobs_per_leg=2")
        assert report("central", seed)["mission_time_s"] < meeting["mission_time_s"]


def test_the_way_to_the_meetings_is_what_they_cost() -> None:
    """Who gets all areas before the dive has nowhere to go between them."""
    often, never = (report("rendezvous-sync", 1, f"strategy.parameters.jobs_per_leg={n}") for n in (1, 13))
    assert never["distance_m"] < 0.9 * often["distance_m"]


# Silence is what auctions are repeated for -------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("vehicle", ["AUV00", "AUV01"])
def test_what_a_silent_vehicle_holds_is_auctioned_anew(vehicle: str) -> None:
    """AUV00 is the head: when it is silent the others auction by themselves what it holds."""

    def passed_on(lease_frames: int) -> int:
        lease = f"communication.lease_frames={lease_frames}", "communication.false_absence=0"
        done = finished("contract-net", 1, cut_off(vehicle), *lease, "scenario.duration_s=3000")
        return sum(len(set(holders)) > 1 for holders in taken_by(done).values())

    assert passed_on(30) > passed_on(NEVER)


def test_without_silence_nothing_is_auctioned_anew() -> None:
    assert all(len(set(holders)) == 1 for holders in taken_by(finished("contract-net", 1)).values())


# Prediction, and when it is given up --------------------------------------------------------------


@pytest.mark.slow
def test_what_a_silent_vehicle_should_have_done_is_done_by_others_once_its_lease_has_run_out() -> None:
    def passed_on(lease_frames: int) -> int:
        lease = f"communication.lease_frames={lease_frames}", "communication.false_absence=0"
        doubt = f"strategy.parameters.doubt_rounds={NEVER}"
        done = finished("status-broadcast", 1, cut_off("AUV01", 1e5), *lease, doubt, "scenario.duration_s=3000")
        own = {role for role, holders in taken_by(done).items() if holders[0] == "AUV01"}
        return sum(len(set(taken_by(done)[role])) > 1 for role in own)

    assert passed_on(40) > passed_on(NEVER)


# Influence signals --------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Mute(Remoras):
    """REMORAS without influence signals."""

    declaration: ClassVar[Declaration] = replace(Remoras().declaration, influences=False)


MUTE = Mute()


@pytest.mark.slow
def test_only_vehicles_that_hear_influence_signals_give_up_early() -> None:
    """AUV00 leaves the last of its area to those who wait."""

    def given_up(*settings: str) -> int:
        done = run(load("mapping-rendezvous", [("--set", setting) for setting in settings]), 1)
        return sum(milestone.name == "mapping_stopped" for milestone in done.milestones)

    assert given_up("strategy.name=remoras") == 1
    assert given_up(f"strategy.name={__name__}:MUTE") == 0
    assert given_up("strategy.name=remoras", "decision.weight_external=0") == 0


# Speeds that nobody knows -------------------------------------------------------------------------


def real_speeds_mps(seed: int, *settings: str) -> list[float]:
    fleet = assemble(resolved(load("mapping-patches", [("--set", setting) for setting in settings])), seed)
    speeds = [vehicle.functional.data.transit_speed_mps for vehicle in fleet.vehicles]
    fleet.close()
    return speeds


VARIED = [
    *[(f"strategy.name={name}",) for name in strategies()],
    ("communication.policy=mps-ack-repeat",),
    ("channel.per=0.9",),
    ("channel.name=gilbert-elliott",),
]


@pytest.mark.parametrize("settings", VARIED, ids=lambda settings: settings[0])
def test_the_speeds_are_the_same_whatever_is_compared(settings: tuple[str, ...]) -> None:
    assert real_speeds_mps(4, *settings) == real_speeds_mps(4)


def test_the_speeds_differ_between_seeds_and_vehicles_within_the_spread() -> None:
    known = [vehicle.transit_speed_mps for vehicle in load("mapping-patches").vehicle]
    drawn = [real_speeds_mps(seed) for seed in range(20)]
    assert len({tuple(speeds) for speeds in drawn}) == 20
    factors = [real / data for speeds in drawn for real, data in zip(speeds, known, strict=True)]
    assert len(set(factors)) == len(factors)
    assert all(0.9 <= factor <= 1.1 for factor in factors)
    assert min(factors) < 0.93  # of 80 even draws, 15 % of them below: 0.85^80 = 2e-6 for none
    assert max(factors) > 1.07


def test_without_spread_every_vehicle_is_as_fast_as_its_data() -> None:
    setup = resolved(load("mapping-patches", [("--set", "uncertainty.speed_spread=0.0")]))
    assert all(actual(setup, data, seed=1) == data for data in setup.database.values())


# What a vehicle lost or cut off holds goes to others -----------------------------------------------

LINKS = ", ".join(f'{{sender="{sender}", receiver="AUV02", per=1.0}}' for sender in ("ASV00", "AUV00", "AUV01"))
DEAF = f"channel.link=[{LINKS}]"


@pytest.mark.slow
def test_a_member_that_hears_nobody_leaves_its_areas_to_others() -> None:
    """It is heard, but what it is given at sea would be left undone.

    After its lease it takes no jobs, and says so; else the head takes them back, since it never acknowledges them.
    """
    taken_back = "strategy.parameters.acknowledge_rounds=100"
    patient = "strategy.parameters.acknowledge_rounds=10000"
    assert report("central", 1, "channel.name=matrix", DEAF, patient)["coverage_fraction"] > 0.99
    assert report("central", 1, "channel.name=matrix", DEAF, *FOR_EVER, taken_back)["coverage_fraction"] > 0.99
    assert report("central", 1, "channel.name=matrix", DEAF, *FOR_EVER, patient)["coverage_fraction"] < 0.95


def test_who_wins_an_area_back_accepts_it_again() -> None:
    settings = ["strategy.name=contract-net", "strategy.parameters.queue=1", "channel.name=perfect"]
    settings.append('channel.blackout=[{vehicle="AUV02", from_s=200, until_s=800}]')
    done = run(load("mapping-rendezvous", [("--set", setting) for setting in settings]), 1)
    assert done.completed
    assert all(len(vehicles) <= 3 for vehicles in taken_by(done).values())


LOST = (
    'channel.blackout=[{vehicle="AUV02", from_s=40, until_s=1e5}]',
    "scenario.duration_s=5000",
)


@pytest.mark.slow
def test_claims_of_a_lost_vehicle_do_not_stand_for_ever() -> None:
    """In time the others survey what it claimed when it was last heard."""

    def mapped_by_others(*settings: str) -> float:
        done = finished("cbba", 1, *LOST, *settings)
        cells = {(x, y) for _, vehicle, x, y in done.recorder.rows("coverage") if vehicle != "AUV02"}
        return len(cells) / len(done.mission.world(done.seed).cells)

    assert mapped_by_others() == 1.0
    assert mapped_by_others(*FOR_EVER) < 0.96


def test_areas_of_the_far_future_are_bid_for() -> None:
    """With a discount this steep their bids round to nothing; a plan for all would hide it."""
    settings = "strategy.parameters.discount_s=50", "strategy.parameters.plans_for_all=false"
    assert report("cbba", 1, *settings)["coverage_fraction"] > 0.99


LONG_SPELLS = {"p_good_to_bad": 0.005, "p_bad_to_good": 0.005, "per_good": 0.0, "per_bad": 1.0}


@pytest.mark.slow
def test_a_group_meets_with_who_missed_its_meeting() -> None:
    """AUV00, out of reach, misses the meeting and comes back."""
    settings = ["strategy.name=contract-net", "channel.name=gilbert-elliott"]
    settings += [f"channel.{key}={value}" for key, value in LONG_SPELLS.items()]
    scenario = load("mapping-patches", [("--set", setting) for setting in settings])
    assert run(scenario, 7).completed
