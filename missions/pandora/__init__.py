"""A structure under water is inspected and serviced for hours while faults come: failure is recognised and answered.

Its scenarios are ``pandora-inspection`` and, for a day, ``pandora-day``.
"""

from missions.pandora.mission import PandoraMission

__all__ = ["PandoraMission"]
