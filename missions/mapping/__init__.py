"""The mission of the REMORAS paper: vehicles map areas together, then meet (``mapping-rendezvous``, ``mapping-patches``)."""

from missions.mapping.mission import MappingMission

__all__ = ["MappingMission"]
