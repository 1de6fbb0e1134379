"""What a vehicle's plans are made of: the facts of its own that tests and effects of tasks are asked of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from remoras.activities import Objective
from remoras.beliefs import Beliefs, Key
from remoras.database import AUVDatabase
from remoras.organisation import Organisation
from remoras.social.gatherings import Gatherings
from remoras.social.planning import MissionPlanner, missions_of
from remoras.social.view import View


@dataclass(frozen=True, slots=True)
class OwnFacts:
    """Beliefs of one vehicle, and what its social layer knows beside them; see ``SocialPart.social_domain``.

    Attributes:
        beliefs: of the vehicle.
        database: static data of all vehicles.
        present: who plays what and is there.
        view: missions that groups were given at sea, and formations of groups.
        gatherings: which meetings count; is_cut_off: whether the vehicle hears nobody.
        planner: of the missions that the vehicle plans.
        objectives: of roles, by group, role and name.
    """

    beliefs: Beliefs
    database: AUVDatabase
    present: Organisation
    view: View
    gatherings: Gatherings
    is_cut_off: bool
    planner: MissionPlanner
    objectives: Mapping[tuple[str, str, str], Objective]

    def get(self, key: Key, default: Any = None, /) -> Any:
        """The value of a fact, or ``default`` if it is not known."""
        kind, about = key
        match kind:
            case "members":
                return self.present.members(*about.split("."))
            case "lost":
                return self.planner.lost.get(about, default)
            case "allocated":
                return about in self.planner.allocated or default
            case "objective":
                group, role, name = about.split(".")
                objective = self.objectives.get((group, role, name))
                return default if objective is None else objective.argument
            case "hasMission":
                return missions_of(self.present.groups.values(), self.view.missions).get(about, (default,))[-1]
            case "given":
                group, _, mission = about.partition(".")
                missions = missions_of(self.present.groups.values(), self.view.missions)
                return mission in missions.get(group, ()) or default
            case "formed":
                return about in self.present.groups
            case "formation":
                return self.view.formation(about) or default
            case "data":
                return self.database[about]
            case "instances":
                return self.beliefs.instances(about)
            case "isA":
                return self.beliefs.is_a(*about.rsplit(".", 1)) or default
        if self.gatherings.is_undone(key, self.is_cut_off):
            return default
        return self.beliefs.get(key, default)
