"""Sites are surveyed, and holes bored by vehicles with a drill whose battery does not last; others bring energy.

Whoever stands at a hole without energy calls; who comes leaves work of its own. Its scenario is ``resupply-field``.
"""

from missions.resupply.mission import ResupplyMission

__all__ = ["ResupplyMission"]
