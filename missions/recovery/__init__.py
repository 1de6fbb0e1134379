"""Sites are surveyed, and heavy objects that are found near them are lifted by several vehicles at once.

Whoever has an object to lift calls; who comes leaves work of its own. Its scenario is ``recovery-field``.
"""

from missions.recovery.mission import RecoveryMission

__all__ = ["RecoveryMission"]
