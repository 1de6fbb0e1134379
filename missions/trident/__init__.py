"""Trident mission: surveys of a site by services of two vehicles, and recovery of a target."""

from missions.trident.mission import TridentMission

__all__ = ["TridentMission"]
