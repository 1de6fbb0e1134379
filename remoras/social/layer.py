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

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
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
from remoras.social.consultation import Agreed, Consultation
from remoras.social.membership import NO_CHANGES, Changes, Membership
from remoras.social.negotiation import ROLE_ATTRIBUTES, Negotiation
from remoras.social.planning import Deliberation, MissionPlanner, missions_of
from remoras.social.succession import HEAD_TERM, HEADED_BY, role_after, successor
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


@dataclass(frozen=True, slots=True)
class Review:
    """What a look around at the end of a round has shown.

    Attributes:
        changes: peers that have become absent and present.
        facts: what this vehicle tells the others about itself on falling out and on coming back.
        assigned, left: roles that it plays again and no longer, now that it has come back.
        activities_due: True if its activities have to be chosen anew.
    """

    changes: Changes = NO_CHANGES
    facts: list[Fact] = field(default_factory=list)
    assigned: list[RoleAssignment] = field(default_factory=list)
    left: list[RoleAssignment] = field(default_factory=list)
    activities_due: bool = False


class SocialLayer:
    """Organisation, missions and objectives as one vehicle sees them.

    ``organisation`` is what was agreed; ``present`` is the same without those who are absent: what the vehicle plans,
    negotiates, addresses and concludes with. While it is cut off it leads itself, and its orders are for itself alone.

    Args:
        me: own name.
        database: static data of all vehicles.
        beliefs: facts of this vehicle.
        mission: turns missions into objectives and objectives into activities.
        strategy: forms the organisation and allocates roles.
        agreement: what was agreed before the mission.
        rally_points_m: by name.
        picture: what is known of the peers; its part ``groups`` is written here and nowhere else.
        lease_s: how long a peer that is not heard counts as present; infinite where nobody speaks.
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
        lease_s: float = math.inf,
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
        self._met_alone: dict[str, float] = {}  # groups taken for gathered while cut off, and when
        self._unavailable: frozenset[str] = frozenset()
        self._is_out_of_reach = False  # it has said that it takes no jobs, since it is cut off
        self._given_up: set[Objective] = set()
        self._membership = Membership(me, database.names, lease_s, picture.frame_s)
        self.present = self.organisation
        self._led = self._groups_led()
        planned = {group: agreement.rests_on[group] for group in self._led if group in agreement.rests_on}
        self.planner = MissionPlanner(me, mission.social_domain, beliefs, strategy, planned)
        self.planner.take_on(group for group in self._led if group in self.missions)
        self._consultation = Consultation(beliefs, database)
        self._plays_role = beliefs.model.tbox.attribute_named("playsRole").uid
        self._negotiation = Negotiation(me, strategy, self.organisation, beliefs, rally_points_m, self._jobs)

    @property
    def missions(self) -> Mapping[str, str]:
        """What each group is to do, by its name, as far as it is known."""
        return missions_of(self.organisation.groups.values(), self._beliefs)

    def objectives_of(self, vehicle: str) -> tuple[Objective, ...]:
        """Objectives of all roles that ``vehicle`` plays."""
        played = {(one.group, one.role) for one in self.present.roles_of(vehicle)}
        return tuple(one for one in self._objectives.values() if (one.group, one.role) in played)

    def leads(self, group: str) -> bool:
        """True if this vehicle is a head of ``group`` and has the social layer to lead it."""
        return group in self._led

    def _groups_led(self) -> tuple[str, ...]:
        if not self.database[self.me].social_layer:
            return ()
        return tuple(group for group in self.present.groups if self.me in self.present.heads(group))

    def _work(self, positions_m: Mapping[str, Point]) -> dict[str, Work]:
        jobs, done = jobs_left(self._jobs, self._beliefs)
        return works(self.present, self.database, jobs, done, positions_m, self._takes_no_jobs)

    # Hearing -------------------------------------------------------------------------------------

    def consider(self, changes: Sequence[Change], told: bool = True) -> bool:
        """Take note of changed facts; True if activities rest on them and have to be chosen anew.

        Organisational facts wait for the end of the round. A mission for a group that this vehicle leads makes planning
        due now, and so does a fact that one of its plans rests on.

        Args:
            changes: of the world model.
            told: False if this vehicle keeps to itself what it states.
        """
        alone = self.is_cut_off and not told
        for change in changes:
            self._consultation.note(change, alone)
            self._negotiation.note(change)
            self.planner.note(change)
        keys = self._beliefs.keys_of(changes)
        if any(attribute == "available" for attribute, _ in keys):
            self._unavailable = frozenset(
                name for name in self.database if self._beliefs.get(("available", name)) is False
            )
        if not self._meetings.isdisjoint(keys):
            if alone:
                self._met_alone |= {name: changes[0].block.time_s for attribute, name in keys & self._meetings}
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
        met_s = {
            group: None if self._is_undone(group) else self._beliefs.observed_s(("gatheredAt", group))
            for group in self.organisation.groups
        }

        def follows_all(group: str, when_s: float) -> bool:
            before = (met_s[other] for other in self._meets_after.get(group, ()))
            return all(before_s is None or before_s <= when_s for before_s in before)

        return {group for group, when_s in met_s.items() if when_s is not None and follows_all(group, when_s)}

    def _is_undone(self, group: str) -> bool:
        """True if this vehicle took the group for gathered while it was cut off, and is so no longer."""
        if self.is_cut_off or group not in self._met_alone:
            return False
        return self._beliefs.observed_s(("gatheredAt", group)) == self._met_alone[group]

    # Who is there --------------------------------------------------------------------------------

    @property
    def is_cut_off(self) -> bool:
        """True while this vehicle has heard nobody at all for a lease: its orders are for itself alone."""
        return self._membership.cut_off

    @property
    def _takes_no_jobs(self) -> frozenset[str]:
        """Vehicles that take no jobs; one that is cut off still takes those that it gives itself."""
        return self._unavailable - {self.me} if self._is_out_of_reach and self.is_cut_off else self._unavailable

    def look_around(self, now_s: float) -> Review:
        """End of a round: see who is there. Where somebody is not, others take the roles, and heads plan anew."""
        was_cut_off = self.is_cut_off
        changes = self._membership.look_around(now_s, self._picture.peers.heard_s)
        moved = {*changes.absent, *changes.present}
        if not moved:
            return Review()
        facts: list[Fact] = []
        undone = Agreed(self.organisation)
        if self.is_cut_off and not was_cut_off:
            facts = self._fall_out()
        elif was_cut_off and not self.is_cut_off:
            undone = self._consultation.come_back(self.organisation)
            self.organisation = undone.organisation
            self._picture.groups.gathered = self._gathered()
            facts = self._come_back()
        roles = [one for one in self.organisation.assignments if one.vehicle in moved]
        keys = {("members", f"{one.group}.{one.role}") for one in [*roles, *undone.assigned, *undone.left]}
        stale = self._drop_activities(keys | {("gatheredAt", group) for group in self._met_alone})
        before = self.present
        self._renew()
        for group in {one.group for one in roles}.intersection(self._led):
            self.planner.replace_who_left(group)
        own = [one for one in undone.assigned if one.vehicle == self.me]
        left = [one for one in undone.left if one.vehicle == self.me]
        due = stale or before.roles_of(self.me) != self.present.roles_of(self.me)
        return Review(changes, facts, own, left, due)

    def _renew(self) -> None:
        """The organisation or who is there has changed."""
        self.present = self._membership.seen(self.organisation, self.database[self.me].social_layer)
        before, self._led = self._led, self._groups_led()
        if before != self._led:
            self.planner.lead(self._led, [one for one in self._led if one not in before and one in self.missions])

    def _fall_out(self) -> list[Fact]:
        """What a vehicle that is cut off tells those who may still hear it: it takes no jobs and leads no longer."""
        facts: list[Fact] = []
        for group in self.organisation.groups.values():
            role = group.head_role
            if role is None or not group.succession or not self.organisation.plays(self.me, group.name, role):
                continue
            facts.append(self._beliefs.fact(self.me, "leftRole", group.path(role)))
            left, _ = self.organisation.leave_role(self.me, group.name, role)
            then = role_after(self.database, self.me, group, left)
            if then is not None:
                facts.insert(0, self._beliefs.fact(self.me, "playsRole", group.path(then.role)))
        if self.me not in self._unavailable:
            self._is_out_of_reach = True
            facts.append(self._beliefs.fact(self.me, "available", False))
        return facts

    def _come_back(self) -> list[Fact]:
        """What a vehicle that hears others again tells them: it takes jobs again."""
        if not self._is_out_of_reach:
            return []
        self._is_out_of_reach = False
        return [self._beliefs.fact(self.me, "available", True)]

    def claims(self) -> list[list[Fact]]:
        """End of a round: claims to lead groups without a head, where this vehicle is the first to succeed."""
        if self.is_cut_off:
            return []
        claimed = []
        for group in self.present.groups.values():
            if not group.succession or not self.present.is_member(self.me, group.name):
                continue
            if any(self.database[name].social_layer for name in self.present.heads(group.name)):
                continue
            if successor(group, self.present, self.database, self._unavailable) == self.me:
                term = self._consultation.headship.next_term(group.name)
                facts = (group.name, HEADED_BY, self.me), (group.name, HEAD_TERM, term)
                claimed.append([self._beliefs.fact(*fact) for fact in facts])
        return claimed

    # The end of a round --------------------------------------------------------------------------

    @property
    def consultation_due(self) -> bool:
        """True if something was said of roles or objectives that does not count yet."""
        return self._consultation.is_due

    def consult(self) -> Consulted:
        """End of a round: what was said in it of roles and objectives counts from now on."""
        agreed = self._consultation.end(self.organisation, self._membership.absent, self._takes_no_jobs)
        self.organisation = agreed.organisation
        self._objectives |= {(one.group, one.role, one.name): one for one in agreed.objectives}
        self.planner.end_round()
        self._renew()
        for one in agreed.left:
            if self.leads(one.group):
                self.planner.replace_who_left(one.group)
        moved = [*agreed.assigned, *agreed.left]
        stale = self._drop_activities({("members", f"{one.group}.{one.role}") for one in moved})
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
        unheard = {name: roles for name, roles in peers.unheard.items() if name not in self._membership.absent}
        stated = []
        for said in self._negotiation.negotiate(now_s, work, peers.heard_s, unheard, calls):
            is_order = any(attribute in ROLE_ATTRIBUTES for _, attribute, _ in said.facts)
            facts = self._in_place_of_the_absent(self._beliefs.fact(*fact) for fact in said.facts)
            stated.append((facts, said.told and not (is_order and self.is_cut_off)))
        return stated

    def _in_place_of_the_absent(self, facts: Iterable[Fact]) -> list[Fact]:
        """The same facts, and before each that gives away a role held by the absent, that these leave it."""
        stated: list[Fact] = []
        for fact in facts:
            if fact[1] == self._plays_role:
                group, role = self._beliefs.name(fact[2]).split(".")
                holders = self.organisation.members(group, role)
                specification = self.organisation.groups[group].role(role)
                is_full = specification is not None and specification.maximum == len(holders)
                if is_full and self._membership.absent.issuperset(holders):
                    path = f"{group}.{role}"
                    stated += [self._beliefs.fact(name, "leftRole", path) for name in holders]
            stated.append(fact)
        return stated

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
        planned = self.planner.plan(self, self.missions, work, self._objectives.values())
        return replace(planned, facts=self._in_place_of_the_absent(planned.facts))

    def findings(self, motion: Motion) -> list[Fact]:
        """What this vehicle concludes as the leader of its groups, as facts."""
        facts: list[Fact] = []
        idle_since_s = self._picture.groups.idle_since_s
        work = self._work({}) if self._led else {}
        for name in self._led:
            if self._is_work_left(work[name]):
                idle_since_s.pop(name, None)
            else:
                idle_since_s.setdefault(name, self._picture.body.now_s)
            if self._holds(work[name]):
                continue
            group = self.present.groups[name]
            facts += self._facts_of(self._found(group, motion))
        return facts

    def _found(self, group: Group, motion: Motion) -> Sequence[Finding]:
        expected = "a list of Finding"
        try:
            found = tuple(self._mission.findings(group, self.present, self._beliefs, self._picture, motion))
        except Exception as error:
            raise broken_promise(self._mission_name, "findings", expected, error) from error
        if found and not all(isinstance(one, Finding) for one in found):
            raise broken_promise(self._mission_name, "findings", expected, found)
        return found

    def _facts_of(self, findings: Sequence[Finding]) -> list[Fact]:
        return [self._beliefs.fact(one.subject, one.attribute, one.value) for one in findings]

    def has_met(self, group: str) -> bool:
        """True if this vehicle takes ``group`` for gathered."""
        return group in self._picture.groups.gathered

    def gives_out(self, group: str) -> bool:
        """True while ``group`` has work that this vehicle still has to give out or to see done.

        Work that nobody present is able to do is none.
        """
        return group in self._negotiation.holding and self._is_work_left(self._work({})[group])

    @staticmethod
    def _is_work_left(work: Work) -> bool:
        """True while somebody present holds a job that is not done, or is able to do one."""
        return any(work.holders(role) or any(work.able(one, role) for one in work.workers) for role in work.unfinished)

    def _holds(self, work: Work) -> bool:
        """True while a group still has work to hand out or to confirm, so that it does not count as gathered."""
        name = work.group.name
        if name in self._negotiation.holding and self._is_work_left(work):
            return True
        unheard = frozenset(self._picture.peers.unheard) - self._membership.absent
        return self.leads(name) and self.planner.waits_for(unheard, work.done)

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
                    for member in self.present.members(role.split(".")[0]):
                        given.setdefault(member, set())
        given.pop(self.me, None)
        return given

    def resign(self) -> list[Fact]:
        """Leave all roles: a vehicle that has to look after itself is of no use to its groups, now and later."""
        self._is_out_of_reach = False
        return [*self._leaving(self.organisation.roles_of(self.me)), self._beliefs.fact(self.me, "available", False)]

    def failed(self, objective: Objective) -> list[Fact]:
        """What to make known once it is clear that this vehicle cannot do what ``objective`` takes.

        It takes no jobs any more and leaves those that it has, but it stays with its groups. Empty if it has said so.
        """
        if objective in self._given_up:
            return []
        self._given_up.add(objective)
        self._is_out_of_reach = False
        with_job = {(g.name, role.name) for g in self.organisation.groups.values() for role in g.roles if role.job}
        with_job.add((objective.group, objective.role))
        roles = [one for one in self.organisation.roles_of(self.me) if (one.group, one.role) in with_job]
        return [*self._leaving(roles), self._beliefs.fact(self.me, "available", False)]

    def _leaving(self, roles: Iterable[RoleAssignment]) -> list[Fact]:
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
            return self.present.members(*key[1].split("."))
        if self._met_alone and key[0] == "gatheredAt" and self._is_undone(key[1]):
            return default
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
