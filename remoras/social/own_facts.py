"""What a vehicle's plans are made of: the facts of its own that tests and effects of tasks are asked of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from remoras.activities import Objective
from remoras.beliefs import Beliefs, Key
from remoras.database import AUVDatabase
from remoras.social.gatherings import Gatherings
from remoras.social.planning import MissionPlanner, missions_of
from remoras.social.standing import Standing


class OwnFacts:
    """Beliefs of one vehicle, and what its social layer knows beside them; see ``SocialPart.social_domain``.

    Args:
        beliefs: of the vehicle.
        database: static data of all vehicles.
        standing: who plays what; gatherings: which meetings count.
        planner: of the missions that the vehicle plans.
        objectives: of roles, by group, role and name; looked at when asked.
    """

    def __init__(
        self,
        beliefs: Beliefs,
        database: AUVDatabase,
        standing: Standing,
        gatherings: Gatherings,
        planner: MissionPlanner,
        objectives: Mapping[tuple[str, str, str], Objective],
    ) -> None:
        self._beliefs = beliefs
        self._database = database
        self._standing = standing
        self._gatherings = gatherings
        self._planner = planner
        self._objectives = objectives

    def get(self, key: Key, default: Any = None, /) -> Any:
        """The value of a fact, or ``default`` if it is not known."""
        kind, about = key
        match kind:
            case "members":
                return self._standing.present.members(*about.split("."))
            case "lost":
                return self._planner.lost.get(about, default)
            case "allocated":
                return about in self._planner.allocated or default
            case "objective":
                group, role, name = about.split(".")
                found = self._objectives.get((group, role, name))
                return default if found is None else found.argument
            case "hasMission":
                return missions_of(self._standing.organisation.groups.values(), self._beliefs).get(about, default)
            case "data":
                return self._database[about]
        if self._gatherings.is_undone(key, self._standing.is_cut_off):
            return default
        return self._beliefs.get(key, default)
