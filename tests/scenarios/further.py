"""A mission whose planner makes new ones at sea: a group that has found something is to inspect it too."""

from collections.abc import Sequence
from functools import cached_property

from missions.mapping.mission import MappingMission
from missions.mapping.tasks import AREA_MAPPING, INSPECTION, inspection_methods, waiting
from remoras.htn import Domain, FactsLike, Method, Task
from remoras.mission import GIVE_MISSION

FIND = "HaveInspectedByOneself"


class Further(MappingMission):
    """Whoever maps gives its own group a further mission once something is found: to inspect it."""

    @property
    def instances(self) -> Sequence[tuple[str, str]]:
        return [*super().instances, ("Mission", INSPECTION)]

    @cached_property
    def social_domain(self) -> Domain:
        shipped = super().social_domain

        def found(facts: FactsLike, group: str) -> bool:
            return bool(waiting(facts, self.groups[group], self._inspections))

        def with_find(method: Method) -> Method:
            def subtasks(facts: FactsLike, group: str) -> list[Task]:
                return [*method.subtasks(facts, group), Task(FIND, (group,))]

            return Method(method.name, subtasks, method.applicable)

        own = [
            Method("too", lambda facts, group: [Task(GIVE_MISSION, (group, INSPECTION))], found, (GIVE_MISSION,)),
            Method("nothing found", lambda facts, group: [], uses=()),
        ]
        methods = {
            **shipped.methods,
            AREA_MAPPING: tuple(map(with_find, shipped.methods[AREA_MAPPING])),
            FIND: tuple(own),
            INSPECTION: tuple(inspection_methods(self.groups, self._inspections)),
        }
        return Domain(shipped.operators, methods)
