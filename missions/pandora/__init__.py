"""Pandora mission: long inspection and maintenance of a structure under faults."""

from missions.pandora.mission import PandoraMission

__all__ = ["PandoraMission"]
