"""What a vehicle forges under a fault of the mind it has no right to say, now or later."""

from types import SimpleNamespace
from typing import Any

from scenarios.small_grounds import ground_of

from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from stress.minds import forged_act
from stress.schedule import StressFault


def test_an_objective_is_forged_of_groups_only_that_the_forger_cannot_come_to_form() -> None:
    """The head of the operational group forms the inspectors: who is in that group may come to give them objectives."""
    ground = ground_of("mapping-inspection-small")
    setup = resolved(load(ground.scenario, [("--set", change) for change in ground.settings]))
    fleet = assemble(setup, 1)
    while not all("Inspectors" in vehicle.social.organisation.groups for vehicle in fleet.vehicles):
        fleet.step()
    witness: Any = SimpleNamespace(
        recorded={vehicle.name: list(vehicle.beliefs.model.blocks()) for vehicle in fleet.vehicles}
    )
    about = {}
    for vehicle in fleet.vehicles:
        fault = StressFault(kind="forged-objective", vehicle=vehicle.name, at_s=1.0)
        forged = forged_act(fault, vehicle, setup.mission, witness, setup.agreement.organisation)
        about[vehicle.name] = None if forged is None else forged.about.split(".")[0]
    assert about == {"ASV00": "Operational", "AUV00": None, "AUV01": "Coordination", "AUV02": "Coordination"}
    fleet.close()
