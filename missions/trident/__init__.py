"""Intervention by services of two vehicles: they survey a site, an operator chooses, one of them recovers the target.

The shipped scenario is ``trident-intervention``; ``docs/missions/trident.md`` says what it is for and what it shows.
"""

from missions.trident.mission import TridentMission

__all__ = ["TridentMission"]
