"""Pandora mission: long inspection and maintenance of a structure under faults.

Scenarios: ``pandora-inspection``; for a whole day ``pandora-day``.
"""

from missions.pandora.mission import PandoraMission

__all__ = ["PandoraMission"]
