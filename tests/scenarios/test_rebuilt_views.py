"""What a vehicle knows of the organisation, round by round, is what follows from all its facts at once.

A vehicle of the same name that knows nothing takes over the world model at the end, and counts it in one round. In
these missions the head is lost and succeeded, and every other packet is lost. That is no law: ``test_view.py`` has the
statements of which the order of hearing matters; and for a claim it counts whom a vehicle has missed before.
"""

import pytest

from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.vehicle import Vehicle
from tests.tools.campaigns import ground_of
from worldmodel.remembering import remember

LOST = 'fault=[{kind="lost",vehicle="AUV00",at_s=60}]'


def knows(vehicle: Vehicle) -> tuple[object, ...]:
    social = vehicle.social
    standing = social.standing
    return (
        standing.organisation,
        set(social.objectives.values()),
        social.missions,
        standing.takes_no_jobs,
        standing.view.leadership.leading,
    )


@pytest.mark.parametrize("strategy", ["remoras", "central", "contract-net"])
def test_a_view_follows_from_all_facts_at_once(strategy: str) -> None:
    ground = ground_of("areas-50m")
    changes = (*ground.settings, f"strategy.name={strategy}", "channel.name=bernoulli", "channel.per=0.5", LOST)
    setup = resolved(load(ground.scenario, [("--set", change) for change in changes]))
    for seed in (1, 2):
        fleet, again = assemble(setup, seed), assemble(setup, seed)
        while fleet.running:
            fleet.step()
        there = [vehicle for vehicle in fleet.vehicles if vehicle.is_alive]
        assert any("Operational" in vehicle.social.standing.view.leadership.leading for vehicle in there)
        for vehicle in there:
            fresh = again.vehicles[vehicle.data.node]
            fresh.social.standing._membership.absent = vehicle.social.standing.absent
            fresh.social.consider(remember(fresh.beliefs.model, vehicle.beliefs.model, fleet.now_s).changes)
            fresh.social.consult()
            assert knows(fresh) == knows(vehicle), vehicle.name
        fleet.close()
        again.close()
