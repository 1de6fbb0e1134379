"""What a vehicle knows of the organisation, round by round, is what follows from all its facts at once.

A vehicle of the same name that knows nothing takes over the world model at the end, and counts it in one round. In
these missions the head is lost or mute for a while, most packets are lost, and orders are heard out of order. That is
no law: ``test_view.py`` has the statements of which the order of hearing matters; and for a claim it counts whom a
vehicle has missed before.
"""

from typing import Any

import pytest
from scenarios.small_grounds import ground_of

from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.vehicle import Vehicle
from worldmodel.remembering import remember

LOST, MUTE = 'kind="lost",vehicle="AUV00",at_s=60', 'kind="mute",vehicle="AUV00",at_s=40,until_s=130'
CASES = {
    "remoras": ("areas-50m", 0.5, LOST),
    "contract-net": ("mapping-patches-small", 0.7, MUTE),
}
"""By strategy: the ground, what is lost, and what befalls the head."""


def known(vehicle: Vehicle) -> dict[str, Any]:
    """What a vehicle knows of the organisation."""
    social, standing = vehicle.social, vehicle.social.standing
    return {
        "roles": standing.organisation.assignments,
        "claims": standing.view.leadership.leading,
        "objectives": set(social.objectives.values()),
        "missions": social.missions,
        "takes no jobs": standing.takes_no_jobs,
    }


def rebuilt(vehicle: Vehicle, fresh: Vehicle, now_s: float) -> dict[str, Any]:
    """The same, if it had heard all at once, and missed whom it misses now.

    Args:
        vehicle: whose world model is taken over.
        fresh: one of the same name that knows nothing.
        now_s: the time now.
    """
    social = fresh.social
    social.standing._membership.absent = vehicle.social.standing.absent
    social.consider(remember(fresh.beliefs.model, vehicle.beliefs.model, now_s).changes)
    social.consult()
    return known(fresh)


@pytest.mark.parametrize("strategy", CASES)
def test_a_view_follows_from_all_facts_at_once(strategy: str) -> None:
    name, per, fault = CASES[strategy]
    ground, channel = ground_of(name), ("channel.name=bernoulli", f"channel.per={per}")
    changes = (*ground.settings, *channel, f"strategy.name={strategy}", f"fault=[{{{fault}}}]")
    setup = resolved(load(ground.scenario, [("--set", change) for change in changes]))
    for seed in (1, 2, 3):
        fleet, again = assemble(setup, seed), assemble(setup, seed)
        while fleet.running:
            fleet.step()
        there = [vehicle for vehicle in fleet.vehicles if vehicle.is_alive]
        assert any("Operational" in vehicle.social.standing.view.leadership.leading for vehicle in there)
        for vehicle in there:
            fresh = again.vehicles[vehicle.data.node]
            assert rebuilt(vehicle, fresh, fleet.now_s) == known(vehicle), vehicle.name
        fleet.close()
        again.close()
