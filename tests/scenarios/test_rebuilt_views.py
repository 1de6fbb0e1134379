"""What a vehicle knows of the organisation, round by round, is what follows from all its facts at once.

A vehicle of the same name that knows nothing takes over the world model at the end, and counts it in one round. In
these missions the head is lost or mute for a while, most packets are lost, and orders are heard out of order. That is
no law: whether a statement is granted is asked when it is heard; and for a claim it counts whom a vehicle has missed
before.
"""

import json
from typing import Any

import pytest

from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.vehicle import Vehicle
from worldmodel.world_model import remember

LOST, MUTE = 'kind="lost",vehicle="AUV00",at_s=60', 'kind="mute",vehicle="AUV00",at_s=40,until_s=130'
CASES = {"remoras": ("mapping-rendezvous", 0.5, LOST), "contract-net": ("mapping-patches", 0.7, MUTE)}
"""By strategy: the scenario, what is lost, and what befalls the head."""


def smaller(scenario: str) -> list[str]:
    """What makes all lengths of a mapping ground those times 0.4, with shorter leases and waits."""
    own: Any = load(scenario)
    found = ["communication.lease_frames=10", f"mission.meeting_deadline_s={0.4 * own.mission.meeting_deadline_s:g}"]
    for area in own.area:
        corners = [[0.4 * one for one in corner] for corner in area.corners_m]
        found.append(f'area."{area.name}".corners_m={json.dumps(corners)}')
    for point in own.rally_point:
        found.append(f'rally_point."{point.name}".position_m={json.dumps([0.4 * one for one in point.position_m])}')
    return found


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
    channel = "channel.name=bernoulli", f"channel.per={per}"
    changes = (*smaller(name), *channel, f"strategy.name={strategy}", f"fault=[{{{fault}}}]")
    setup = resolved(load(name, [("--set", change) for change in changes]))
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
