"""Social layer: the flotilla as an organisation, and the missions it performs (REMORAS, section IV).

Its eight modules, by the paper's names, and where they are:

* AUV database: ``database``, data of the vehicles;
* optimiser of organisational performances: ``strategy``, which allocates roles;
* groups and roles: ``organisation``, which vehicles belong to and play which;
* missions: ``missions``, what each group is to do;
* mission planner: ``MissionPlanner``, which turns the missions of the groups that this vehicle leads into objectives;
* individual objectives of a vehicle and collective objectives of a role: ``objectives_of``.

Organisational data are facts of the world model and travel as such; ``Consultation`` says from when they count.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from remoras.activities import ActivitySet, Objective
from remoras.beliefs import Beliefs, Fact, Key
from remoras.database import AUVDatabase
from remoras.mission import Finding, SocialPart
from remoras.motion import Motion
from remoras.organisation import Group, RoleAssignment
from remoras.picture import Picture
from remoras.plugins import answer, broken_promise
from remoras.social.agreement import Agreement
from remoras.social.consultation import Consultation
from remoras.social.negotiation import Negotiation
from remoras.social.planning import Deliberation, MissionPlanner, missions_of
from remoras.strategy import Strategy
from remoras.work import Outlook, Point, Work, jobs_left, works
from worldmodel import Change

Means = tuple[tuple[ActivitySet, ...], frozenset[Key]]
"""Activities by which an objective is pursued, and the facts that this choice rests on."""


@dataclass(frozen=True, slots=True)
class Consulted:
    """What the end of a round changed for this vehicle.

    Attributes:
        assigned, left: roles that it took and left.
        refused: what does not count, and why, in words.
        activities_due: True if its activities have to be chosen anew.
    """

    assigned: list[RoleAssignment]
    left: list[RoleAssignment]
    refused: list[str]
    activities_due: bool


class SocialLayer:
    """Organisation, missions and objectives as one vehicle sees them.

    Args:
        me: own name.
        database: static data of all vehicles.
        beliefs: facts of this vehicle.
        mission: turns missions into objectives and objectives into activities.
        strategy: forms the organisation and allocates roles.
        agreement: what was agreed before the mission.
        rally_points_m: by name.
        picture: what is known of the peers; its part ``groups`` is written here and nowhere else.
    """

    def __init__(
        self,
        me: str,
        database: AUVDatabase,
        beliefs: Beliefs,
        mission: SocialPart,
        strategy: Strategy,
        agreement: Agreement,
        rally_points_m: Mapping[str, Point],
        picture: Picture,
    ) -> None:
        self.me = me
        self.database = database
        self.strategy = strategy
        self.organisation = agreement.organisation
        self.finished: list[Objective] = []
        self._beliefs = beliefs
        self._mission = mission
        self._mission_name = f"mission {type(mission).__name__}"
        self._picture = picture
        picture.facts = beliefs
        self._meets_after = agreement.meets_after
        self._objectives = {(one.group, one.role, one.name): one for one in agreement.objectives}
        self._activities: dict[Objective, Means] = {}
        self._jobs = mission.jobs
        self._meetings = frozenset(("gatheredAt", group) for group in self.organisation.groups)
        self._unavailable: frozenset[str] = frozenset()
        self._led = self._groups_led()
        planned = {group: agreement.rests_on[group] for group in self._led if group in agreement.rests_on}
        self.planner = MissionPlanner(me, mission.social_domain, beliefs, strategy, planned)
        self.planner.take_on(group for group in self._led if group in self.missions)
        self._consultation = Consultation(beliefs)
        self._negotiation = Negotiation(me, strategy, self.organisation, beliefs, rally_points_m, self._jobs)

    @property
    def missions(self) -> Mapping[str, str]:
        """What each group is to do, by its name, as far as it is known."""
        return missions_of(self.organisation.groups.values(), self._beliefs)

    def objectives_of(self, vehicle: str) -> tuple[Objective, ...]:
        """Objectives of all roles that ``vehicle`` plays."""
        played = {(one.group, one.role) for one in self.organisation.roles_of(vehicle)}
        return tuple(one for one in self._objectives.values() if (one.group, one.role) in played)

    def leads(self, group: str) -> bool:
        """True if this vehicle is a head of ``group`` and has the social layer to lead it."""
        return group in self._led

    def _groups_led(self) -> tuple[str, ...]:
        if not self.database[self.me].social_layer:
            return ()
        return tuple(group for group in self.organisation.groups if self.me in self.organisation.heads(group))

    def _work(self, positions_m: Mapping[str, Point]) -> dict[str, Work]:
        jobs, done = jobs_left(self._jobs, self._beliefs)
        return works(self.organisation, self.database, jobs, done, positions_m, self._unavailable)

    # Hearing -------------------------------------------------------------------------------------

    def consider(self, changes: Sequence[Change]) -> bool:
        """Take note of changed facts; True if activities rest on them and have to be chosen anew.

        Organisational facts wait for the end of the round. A mission for a group that this vehicle leads makes planning
        due now, and so does a fact that one of its plans rests on.
        """
        for change in changes:
            self._consultation.note(change)
            self._negotiation.note(change)
            self.planner.note(change)
        keys = self._beliefs.keys_of(changes)
        if any(attribute == "available" for attribute, _ in keys):
            self._unavailable = frozenset(
                name for name in self.database if self._beliefs.get(("available", name)) is False
            )
        if not self._meetings.isdisjoint(keys):
            self._picture.groups.gathered = self._gathered()
        self.planner.reconsider(keys, self._led)
        return self._drop_activities(keys)

    def _drop_activities(self, keys: Collection[Key]) -> bool:
        """Let go of activities that rest on any of the facts ``keys``; True if there were some."""
        if not keys:
            return False
        stale = [one for one, (_, rests_on) in self._activities.items() if not rests_on.isdisjoint(keys)]
        for objective in stale:
            del self._activities[objective]
        return bool(stale)

    def _gathered(self) -> set[str]:
        """Groups believed to be together; a meeting before those that it must follow does not count."""
        met_s = {group: self._beliefs.observed_s(("gatheredAt", group)) for group in self.organisation.groups}

        def follows_all(group: str, when_s: float) -> bool:
            before = (met_s[other] for other in self._meets_after.get(group, ()))
            return all(before_s is None or before_s <= when_s for before_s in before)

        return {group for group, when_s in met_s.items() if when_s is not None and follows_all(group, when_s)}

    # The end of a round --------------------------------------------------------------------------

    @property
    def consultation_due(self) -> bool:
        """True if something was said of roles or objectives that does not count yet."""
        return self._consultation.is_due

    def consult(self) -> Consulted:
        """End of a round: what was said in it of roles and objectives counts from now on."""
        agreed = self._consultation.end(self.organisation)
        self.organisation = agreed.organisation
        self._objectives |= {(one.group, one.role, one.name): one for one in agreed.objectives}
        self.planner.end_round()
        for one in agreed.left:
            self.planner.replace_who_left(one.group)
        moved = [*agreed.assigned, *agreed.left]
        stale = self._drop_activities({("members", f"{one.group}.{one.role}") for one in moved})
        self._led = self._groups_led()
        assigned = [one for one in agreed.assigned if one.vehicle == self.me]
        left = [one for one in agreed.left if one.vehicle == self.me]
        return Consulted(assigned, left, agreed.refused, bool(agreed.objectives or stale or assigned or left))

    def negotiate(self, now_s: float, motion: Motion, calls: Mapping[str, float]) -> list[tuple[list[Fact], bool]]:
        """End of a round: facts that this vehicle states together to organise its groups, and whether it tells them.

        Args:
            motion: of this vehicle.
            calls: how dissatisfied the vehicles are that call on this one, by name.
        """
        if not (self._negotiation.takes_part or self.strategy.declaration.influences):
            return []
        peers = self._picture.peers
        work = self._work({**peers.positions_m, self.me: motion.position_m})
        if self.strategy.declaration.influences:
            self._picture.groups.awaited = {name: self._awaited(one, now_s) for name, one in work.items()}
        statements = self._negotiation.negotiate(now_s, work, peers.heard_s, peers.unheard, calls)
        return [([self._beliefs.fact(*fact) for fact in said.facts], said.told) for said in statements]

    def _awaited(self, work: Work, now_s: float) -> float:
        """How much of the wait for the meeting of a group is for this vehicle: 0..1, see ``Groups.awaited``."""
        free_s = {
            name: work.after_all(Outlook(now_s, work.position_m(name)), self.database[name], work.held_by(name)).free_s
            for name in work.members
        }
        own_s = free_s.pop(self.me, now_s) - now_s
        others_s = max(free_s.values(), default=now_s) - now_s
        return 1.0 if own_s <= 0.0 else max(0.0, 1.0 - others_s / own_s)

    # Planning and concluding ---------------------------------------------------------------------

    def note_planning_due(self) -> None:
        """Begin a decision: behaviours see in the picture whether there is something to plan."""
        self._picture.groups.planning_due = self.planner.is_due

    def plan_missions(self) -> Deliberation:
        """Plan the missions that are due, and let the strategy allocate what the plans ask for."""
        work = self._work(dict(self._picture.peers.positions_m))
        return self.planner.plan(self.missions, work, self._objectives.values())

    def findings(self, motion: Motion) -> list[Fact]:
        """What this vehicle concludes as the leader of its groups, as facts."""
        facts: list[Fact] = []
        for name in self._led:
            if self.holds(name):
                continue
            group = self.organisation.groups[name]
            facts += self._facts_of(self._found(group, motion))
        return facts

    def _found(self, group: Group, motion: Motion) -> Sequence[Finding]:
        expected = "a list of Finding"
        try:
            found = tuple(self._mission.findings(group, self.organisation, self._beliefs, self._picture, motion))
        except Exception as error:
            raise broken_promise(self._mission_name, "findings", expected, error) from error
        if found and not all(isinstance(one, Finding) for one in found):
            raise broken_promise(self._mission_name, "findings", expected, found)
        return found

    def _facts_of(self, findings: Sequence[Finding]) -> list[Fact]:
        return [self._beliefs.fact(one.subject, one.attribute, one.value) for one in findings]

    def gives_out(self, group: str) -> bool:
        """True while ``group`` has work that this vehicle still has to give out or to see done."""
        return group in self._negotiation.holding

    def holds(self, group: str) -> bool:
        """True while ``group`` still has work to hand out or to confirm, so that it does not count as gathered."""
        if self.gives_out(group):
            return True
        _, done = jobs_left(self._jobs, self._beliefs)
        return self.leads(group) and self.planner.waits_for(self._picture.peers.unheard, done)

    def addressed(self, change: Change) -> dict[str, set[str]]:
        """Vehicles that have to hear of a block of this vehicle's own, by name, and the roles that it gives them.

        These are the vehicles that are given roles. Where missions are planned at sea, all members of a group have to
        hear of its roles and objectives.
        """
        given: dict[str, set[str]] = {}
        for fact in change.block.facts:
            if (said := self._consultation.role_named(fact)) is not None:
                attribute, role = said
                if attribute == "playsRole":
                    given.setdefault(self._beliefs.name(fact.subject), set()).add(role)
                if not self.strategy.declaration.planned_before:
                    for member in self.organisation.members(role.split(".")[0]):
                        given.setdefault(member, set())
        given.pop(self.me, None)
        return given

    def resign(self) -> list[Fact]:
        """Leave all roles: a vehicle that has to look after itself is of no use to its groups."""
        roles = self.organisation.roles_of(self.me)
        return [self._beliefs.fact(self.me, "leftRole", f"{one.group}.{one.role}") for one in roles]

    def completed(self, objective: Objective) -> list[Fact]:
        """What to make known when all has been done for ``objective``."""
        finding = answer(
            self._mission_name,
            "completion",
            "a Finding or None",
            lambda found: found is None or isinstance(found, Finding),
            lambda: self._mission.completion(objective, self.me),
        )
        if finding is None:
            return []
        self.finished.append(objective)
        return self._facts_of([finding])

    # Activities ----------------------------------------------------------------------------------

    def get(self, key: Key, default: Any = None, /) -> Any:
        """A fact for planning: ``("members", "Group.Role")`` from the organisation, others from the beliefs."""
        if key[0] == "members":
            return self.organisation.members(*key[1].split("."))
        return self._beliefs.get(key, default)

    def activity_sets(self, position_m: Point) -> tuple[ActivitySet, ...]:
        """Activities by which this vehicle pursues the objectives of its roles.

        Those under way are kept as they are unless a fact that they rest on has changed.
        """
        objectives = sorted(self.objectives_of(self.me), key=lambda o: (o.group, o.role, o.name, o.argument))
        self._activities = {one: self._activities.get(one) or self._means_to(one, position_m) for one in objectives}
        return tuple(activity_set for sets, _ in self._activities.values() for activity_set in sets)

    def _means_to(self, objective: Objective, position_m: Point) -> Means:
        return answer(
            f"{self._mission_name}, objective {objective}",
            "activity_sets",
            "a tuple of ActivitySet, and a frozenset of the keys that it rests on",
            _are_means,
            lambda: self._mission.activity_sets(objective, self.database[self.me], self, position_m),
        )


def _are_means(found: Any) -> bool:
    sets, rests_on = found
    return all(isinstance(one, ActivitySet) for one in sets) and isinstance(rests_on, frozenset)
