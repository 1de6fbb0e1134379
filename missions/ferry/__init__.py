"""Vehicles carry loads from one side of a reef to the other, by a passage in which two cannot pass each other.

Whoever is stopped by another one calls for room; rows of vehicles clear the passage. Its scenario is ``ferry-passage``.
"""

from missions.ferry.mission import FerryMission

__all__ = ["FerryMission"]
