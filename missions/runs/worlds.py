"""World models of the vehicles of a scenario, as they begin."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.scenarios.knowledge import pruning_of
from worldmodel import Keeping, WorldModel

if TYPE_CHECKING:
    from missions.runs.setup import Setup


def world_model(setup: Setup, node: int, epoch: int = 0) -> WorldModel:
    """The world model of a vehicle before it knows anything.

    Args:
        setup: the scenario resolved.
        node: of the vehicle.
        epoch: how often it has begun anew.
    """
    kept, communication = setup.scenario.worldmodel, setup.scenario.communication
    apart_s = max([feature.apart_s(setup.scenario) for feature in setup.features], default=0.0)
    return WorldModel(
        setup.tbox,
        node,
        setup.instances,
        communication.time_resolution_s,
        epoch=epoch,
        n_origins=len(setup.database),
        run_time_instances_per_origin=setup.mission.instances_found_per_vehicle,
        keeping=Keeping(
            max(communication.clock_tolerance_s, apart_s),
            kept.waiting_s,
            kept.waiting_blocks,
            pruning_of(kept, setup.tbox),
            setup.common_facts,
        ),
    )
