"""The mission of the REMORAS paper: vehicles map areas together, then meet.

Its scenarios are ``mapping-rendezvous``, that of the paper, and ``mapping-patches``, with more areas than vehicles.
"""

from missions.mapping.mission import MappingMission

__all__ = ["MappingMission"]
