"""Trident mission: surveys of a site by services of two vehicles, and recovery of a target.

Scenario: ``trident-intervention``; purpose and results: ``docs/missions/trident.md``.
"""

from missions.trident.mission import TridentMission

__all__ = ["TridentMission"]
