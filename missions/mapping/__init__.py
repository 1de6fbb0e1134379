"""Mapping mission of the REMORAS paper: joint survey of areas, then a rendezvous.

Scenarios: ``mapping-rendezvous`` (that of the paper) and ``mapping-patches`` (more areas than vehicles).
"""

from missions.mapping.mission import MappingMission

__all__ = ["MappingMission"]
