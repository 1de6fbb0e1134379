"""Lines are surveyed, some of them by a source that another vehicle has to follow with its receiver all along.

Whoever has a line that takes an escort calls while it has none; who comes follows. Its scenario is ``escort-lines``.
"""

from missions.escort.mission import EscortMission

__all__ = ["EscortMission"]
