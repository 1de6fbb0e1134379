"""The vehicles of a scenario in processes of their own, which know each other through packets only."""

from missions.nodes.alone import Alone, Plan, alone
from missions.nodes.logs import Log, Played, play, read_log
from missions.nodes.node import Node, Outcome
from missions.nodes.swarm import Swarm, swarm

__all__ = ["Alone", "Log", "Node", "Outcome", "Plan", "Played", "Swarm", "alone", "play", "read_log", "swarm"]
