"""Mapping mission of the REMORAS paper: joint survey of areas, then a rendezvous."""

from missions.mapping.mission import MappingMission

__all__ = ["MappingMission"]
