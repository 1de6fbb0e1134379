"""Independent vehicles in one process that receive each other; each step advances the one whose event is next."""

from collections.abc import Sequence
from pathlib import Path

from memory_drivers import AT_ONCE, Ether

from missions.nodes import NodeLog, NodePlan, VehicleNode, alone
from missions.nodes.logs import Began
from missions.nodes.node import Mishaps, NodeOutcome

NONE, BEGAN = Mishaps(), Began(1_000_000.0, 1.0)


def step_until(until_s: float, *nodes: VehicleNode) -> None:
    while (node := min(nodes, key=lambda one: one.solo.next_s)).solo.next_s < until_s:
        node.step()


def together(
    plans: Sequence[NodePlan], out: Path | None = None, mishaps: Mishaps = NONE
) -> tuple[list[VehicleNode], list[NodeOutcome]]:
    """Run vehicles to their end, with logs in a folder; return nodes and outcomes."""
    own = [alone(plan) for plan in plans]
    ether = Ether(own[0].setup.modem.packet_s)
    logs = [None if out is None else NodeLog(out, plan, BEGAN) for plan in plans]
    nodes = [VehicleNode(one, ether.driver(), AT_ONCE, log, mishaps) for one, log in zip(own, logs, strict=True)]
    step_until(plans[0].end_s, *nodes)
    return nodes, [node.run() for node in nodes]
