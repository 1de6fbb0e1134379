"""Lost, mute or deaf vehicles: the others continue, meet and finish; a returning vehicle rejoins."""

from typing import Any, ClassVar

import pytest
from recorded import flown

from exchange.packets import Reception
from missions.runs.assembly import assemble
from missions.runs.run import Run, result_of
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.fleet.fleet import Fleet
from remoras.fleet.vehicle import Vehicle

LEASES_S = 2 * 40 * 7.09
"""Two leases of 40 TDMA frames."""


def took(finished: Run) -> list[tuple[str, str]]:
    return [(row[1], row[3]) for row in finished.recorder.roles if row[0] > 0.0 and row[4] == "assigned"]


@pytest.mark.slow
def test_a_lost_head_is_succeeded_in_both_its_groups() -> None:
    """The Coordinator of Operational is the Tactician of Coordination; AUV01 comes before AUV02 by name."""
    settings = 'fault=[{kind="lost",vehicle="AUV00",at_s=300}]', "channel.per=0.4", "scenario.duration_s=7200"
    finished = flown("mapping-rendezvous", *settings)
    assert finished.completed, finished.reason
    assert {("AUV01", "Coordinator"), ("AUV01", "Tactician")} <= set(took(finished))
    at_s = next(row[0] for row in finished.recorder.roles if row[1] == "AUV01" and row[3] == "Coordinator")
    assert 300.0 < at_s < 300.0 + LEASES_S


def test_a_restarted_vehicle_takes_jobs_despite_earlier_reports() -> None:
    """Cut off, it says that it takes none, which the others hear; then it begins anew, and says that it does."""
    faults = (
        '{kind="deaf",vehicle="AUV01",at_s=30,until_s=205}',
        '{kind="restarts",vehicle="AUV01",at_s=180,until_s=200,memory="lost"}',
    )
    settings = [("--set", f"fault=[{','.join(faults)}]"), ("--set", "communication.lease_frames=10")]
    fleet = assemble(resolved(load("mapping-rendezvous", settings)), seed=1)
    found = []
    for time_s in (170.0, 300.0):
        while fleet.now_s < time_s:
            fleet.step()
        found.append([v.name for v in fleet.vehicles if "AUV01" in v.social.takes_no_jobs])
    fleet.close()
    assert found == [["ASV00", "AUV00", "AUV02"], []]


@pytest.mark.parametrize("remembers", [False, True])
def test_a_vehicle_knows_its_battery_at_once_after_a_restart(remembers: bool) -> None:
    fleet = assemble(resolved(load("mapping-rendezvous")), seed=1)
    while fleet.now_s < 100.0:
        fleet.step()
    before = fleet.named("AUV01")
    restarted = fleet.restart(before, remembers)
    assert restarted.functional.picture.body.battery == before.functional.picture.body.battery < 1.0
    fleet.close()


class Hearing(Vehicle):
    """Counts beliefs about what a vehicle held before a restart, of which this vehicle does not know."""

    n_void: ClassVar[int] = 0

    def hear(self, data: bytes, now_s: float) -> Reception | None:
        reception = super().hear(data, now_s)
        for peer, uid in () if reception is None else reception.beliefs:
            believed = self.model.vehicles[peer]
            knows = self.radio.manager.knows_life(peer, believed.beliefs.model.epoch)
            Hearing.n_void += not knows and not believed.radio.manager.holds(uid)
        return reception


def test_beliefs_about_a_vehicle_before_a_restart_that_nobody_has_learnt_of_are_not_false() -> None:
    fault = 'fault=[{kind="restarts",vehicle="ASV00",at_s=1088.8,until_s=1432.2}]'
    settings = fault, "channel.name=gilbert-elliott", "fleet.layers=false", "scenario.duration_s=1500"
    setup = resolved(load("minehunting-contacts", [("--set", one) for one in settings]))
    fleet = assemble(setup, 91, vehicle=Hearing)
    fleet.run()
    assert fleet.n_false_beliefs == 0 < Hearing.n_void


def longest_double_lead_s(fleet: Fleet) -> float:
    """Step a fleet to its end; the longest time in which one group had two heads that hear and are heard (s)."""
    since_s: dict[str, float] = {}
    longest_s = 0.0
    while fleet.running:
        fleet.step()
        survivors = [vehicle for vehicle in fleet.view.vehicles if vehicle.is_in_contact]
        for group in survivors[0].organisation.groups if survivors else ():
            if sum(vehicle.leads(group) for vehicle in survivors) > 1:
                longest_s = max(longest_s, fleet.now_s - since_s.setdefault(group, fleet.now_s))
            else:
                since_s.pop(group, None)
    return longest_s


def shortcomings(ground: str, strategy: str, per: float, kind: str, vehicle: str, seed: int, *at_s: float) -> list[str]:
    """Run a case; return each failure to finish as a group."""
    fault = f'fault=[{{kind="{kind}",vehicle="{vehicle}",at_s={[*at_s]}}}]'
    given = [f"strategy.name={strategy}", f"channel.per={per}", fault]
    scenario = load(ground, [("--set", one) for one in given])
    setup = resolved(scenario)
    fleet = assemble(setup, seed)
    lead_s = longest_double_lead_s(fleet)
    finished = result_of(setup, seed, fleet, 0.0)
    fleet.close()
    two_leases_s = 2.0 * scenario.communication.lease_frames * setup.schedule.frame_s
    found = [] if finished.completed else [finished.reason]
    if finished.goal_fraction < 1.0:
        found.append(f"goal {finished.goal_fraction:.3f}")
    if lead_s > two_leases_s:
        found.append(f"two heads for {lead_s:.0f} s")
    missed = [one for one in finished.milestones if one.name == "missed_meeting" and kind == "lost"]
    return [*found, *(f"{one.group} met without {one.vehicle}" for one in missed)]


@pytest.mark.slow
@pytest.mark.parametrize(
    "case",
    [
        # Who succeeds looks at the work before it concludes.
        ("mapping-patches", "central", 0.4, "lost", "AUV00", 1, 1500.0, 1500.0),
        # The mute vehicle's contact stands for nobody else.
        ("mapping-rendezvous", "remoras", 0.4, "mute", "AUV01", 1, 300.0, 300.0),
        # Who is away is waited for no longer than due, also by who takes no part in the work.
        ("mapping-patches", "rendezvous-sync", 0.4, "deaf", "ASV00", 1, 1500.0, 1500.0),
        # What the goal spares may stay undone; the head waits no longer for the deaf one, which is elsewhere.
        ("mapping-patches", "remoras-planned", 0.0, "deaf", "AUV00", 6, 1500.0, 1500.0),
        # Who takes up a job that nobody claims keeps it.
        ("mapping-patches", "cbba", 0.8, "lost", "any", 1305378488804, 300.0, 1500.0),
        # Who succeeds a head says again which roles it gave; what was heard of the lost is passed on.
        ("mapping-patches", "central", 0.8, "lost", "any", 34555051360347, 300.0, 1500.0),
    ],
    ids=lambda case: " ".join(map(str, case[1:6])),
)
def test_the_survivors_finish(case: tuple[Any, ...]) -> None:
    """They reach the whole goal and meet; no two that hear each other lead one group for over two leases."""
    assert shortcomings(*case) == []
