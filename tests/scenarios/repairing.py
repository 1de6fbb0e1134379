"""A strategy that allocates roles when it is asked, and in no other way; a mission with another way to explore."""

from dataclasses import replace
from functools import cached_property
from typing import Any

from missions.mapping.mission import MappingMission
from remoras.activities import Activity
from remoras.behaviours import Behaviour
from remoras.database import VehicleData
from remoras.htn import Domain, Method, Task
from remoras.organisation import Group
from remoras.strategies.allocation import all_jobs
from remoras.strategies.founding import common_roles
from remoras.strategies.remoras import STRATEGY as REMORAS
from remoras.strategy import Declaration
from remoras.work import Work


class WhenAsked:
    """Nobody negotiates: what the plan of the group's head does not ask for is not allocated."""

    name = "when-asked"
    declaration = Declaration("", {"playsRole": "its roles", "leftRole": "that it leaves one"}, planned_before=False)
    form = staticmethod(REMORAS.form)

    def adapt(self, work: Work) -> Any:
        return all_jobs(work) + common_roles(work)

    def negotiator(self, me: str, group: Group) -> None:
        return None


WHEN_ASKED = WhenAsked()


class OnceMore(MappingMission):
    """Who has failed to explore an area begins once more with what is left of it, before it gives up."""

    @cached_property
    def activity_domain(self) -> Domain:
        shipped = super().activity_domain
        zigzag, nothing = shipped.methods["PursueExploring"]
        again = Method("once more", lambda facts, *args: [Task("BeginningAgain", args)], zigzag.applicable)
        beginning = replace(shipped.operators["ZigzagExploring"], name="BeginningAgain")
        methods = {**shipped.methods, "PursueExploring": (zigzag, again, nothing)}
        return Domain({**shipped.operators, "BeginningAgain": beginning}, methods)

    def activities(self, steps: Any, *of: Any) -> Any:
        """As shipped; what is begun again has a parameter more, so that its behaviour is a new one."""
        names = {step.name for together in steps for step in together}
        if "BeginningAgain" not in names:
            return super().activities(steps, *of)
        (only,), rests_on = super().activities([[Task("ZigzagExploring")]], *of)
        activity = only.activities[0]
        again = replace(activity, parameters=(*activity.parameters, "again"))
        return (replace(only, activities=(again,)),), rests_on

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        if activity.parameters[-1:] == ("again",):
            activity = replace(activity, parameters=activity.parameters[:-1])
        return super().behaviour_for(activity, data)
