"""Social layer: the flotilla as an organisation and its missions (REMORAS, section IV).

Names of the paper: AUV database (``database``), optimiser of organisational performances (``strategy``), mission
planner (``MissionPlanner``), individual and collective objectives (``objectives_of``).

The vehicle acts on the agreed organisation without absent members. An isolated vehicle states that it takes no jobs and
leads no longer; then it leads itself with orders for itself alone. When it receives a peer again, it leaves the roles
taken alone and takes jobs again.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from remoras.activities import ActivitySet, Objective
from remoras.authority import Act, Rules, Ruling, may_assign
from remoras.beliefs import Beliefs, Fact, Key
from remoras.database import AUVDatabase
from remoras.mission_parts import SocialPart
from remoras.motion import Motion
from remoras.organisation import Outcome, RoleAssignment
from remoras.organisation.leadership import (
    HEAD_TERM,
    HEADED_BY,
    LEFT_ROLE,
    N_TERMS,
    PLAYS_ROLE,
    ROLE_ATTRIBUTES,
    stepping_down,
)  # fmt: skip
from remoras.organisation.membership import (
    NO_CHANGES,
    Changes,
    Footing,
    Lease,
    Membership,
    Patience,
    acted_on,
    patience_with,
    with_work,
)  # fmt: skip
from remoras.picture import Picture
from remoras.social.agreement import Agreement
from remoras.social.conclusions import Conclusions, Gatherings
from remoras.social.consultation import claims, come_back, consult, give_missions
from remoras.social.negotiation import Negotiation
from remoras.social.planning import Deliberation, MissionPlanner, Pursuit, aims, by_receiver, missions_of
from remoras.social.view import AVAILABLE, HAS_MISSION, DatedRequest, Now, Requests, View
from remoras.social.workload import SENSORS_WORK, Workload, takes_sensors
from remoras.strategy import Strategy, Waits
from remoras.work import IS_IMPOSSIBLE, UNABLE_TO, Computed, Point, Work, vehicles_taken
from worldmodel import Block, Change


class Considered(NamedTuple):
    """Effects of changed facts, or of the end of a round, on this vehicle."""

    activities_due: bool
    rulings: Sequence[Ruling]
    events: Sequence[tuple[str, str]] = ()  # ("absent" or "present", peer)
    facts: Sequence[Fact] = ()  # to state at isolation and reconnection
    passed_on: Sequence[Fact] = ()  # statements of vehicles now absent, to relay one by one


NOTHING_CONSIDERED = Considered(False, ())
NOBODY_THERE = "nobody who is there is able to do it"


class OwnFacts:
    """Beliefs of one vehicle plus social facts; see ``SocialPart.social_domain``."""

    def __init__(self, social: SocialLayer) -> None:
        self._of = social

    def get(self, key: Key, default: Any = None, /) -> Any:
        """Return the value of a fact, or ``default`` if unknown."""
        kind, subject = key
        social, beliefs = self._of, self._of.beliefs
        match kind:
            case "members":
                return social.present.members(*subject.split("."))
            case "lost":
                return social.planner.lost.get(subject, default)
            case "allocated":
                return subject in social.planner.allocated or default
            case "objective":
                group, role, name = subject.split(".")
                objective = social.objectives.get((group, role, name))
                return default if objective is None else objective.argument
            case "hasMission":
                return social.missions.get(subject, (default,))[-1]
            case "given":
                group, _, mission = subject.partition(".")
                return mission in social.missions.get(group, ()) or default
            case "formed":
                return subject in social.present.groups
            case "formation":
                return social.view.formation(subject) or default
            case "data":
                return social.database[subject]
            case "job":
                return social.workload.left(subject)
            case "instances":
                return beliefs.instances(subject)
            case "isA":
                return beliefs.is_a(*subject.rsplit(".", 1)) or default
        return default if social.gatherings.is_undone(key, social.is_cut_off) else beliefs.get(key, default)


class SocialLayer:
    """Organisation, missions and objectives as one vehicle sees them, until ``until_s``.

    ``view`` is the agreed organisation and its derivation. ``present`` is the one to act on: without the absent; if
    isolated (``is_cut_off``: no reception for a lease), led by this vehicle, with orders for itself alone. Only this
    class writes the part ``groups`` of ``picture``.
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
        lease: Lease | None = None,
        until_s: float = math.inf,
    ) -> None:
        self.me = me
        self.database = database
        self.strategy = strategy
        self._declaration = strategy.declaration
        self.facts = OwnFacts(self)
        self.finished: list[Objective] = []
        self.beliefs = beliefs
        self._mission = mission
        self._picture = picture
        self._rallies_m = rally_points_m
        picture.facts = beliefs
        self.objectives = {
            (objective.group, objective.role, objective.name): objective for objective in agreement.objectives
        }
        self._founding = frozenset(agreement.objectives)
        self._jobs = mission.jobs
        self.conclusions = Conclusions(me, mission, beliefs)
        self.gatherings = Gatherings(beliefs, [group.name for group in agreement.groups], agreement.meets_after)
        rules = Rules(database, self._declaration.authorities, self._jobs, agreement.supervisors, agreement.at_sea)
        self._rules, lease = rules, lease or Lease(math.inf, picture.frame_s)
        self._membership = Membership(me, database.names, lease)
        self.is_cut_off = False
        self.is_in_doubt = False
        """True while possibly isolated, after part of a lease; it then takes no jobs of others."""
        self._is_out_of_reach = False  # it has stated that it takes no jobs, because it is isolated
        self._assents: list[list[Fact]] = []
        self._given_up: set[Objective] = set()
        self._requests = Requests(beliefs, {**agreement.organisation.groups, **rules.at_sea})
        self._stated: list[DatedRequest] = []  # in this round
        self._stated_alone: list[DatedRequest] = []
        self._is_asked_again = False  # evaluate claims again that a present leader blocked
        self._is_misjudged = False  # it stated before a restart that it takes no jobs
        uids = self._uids = {attribute.name: attribute.uid for attribute in beliefs.model.tbox.attributes}
        self._patience = Patience()
        self._take_over(View.founded(agreement.organisation, rules))
        self.workload = Workload(me, rules, mission, beliefs, until_s)
        self.pursuit = Pursuit(database[me], mission, self.workload.has_words)
        self.says_impossible = self.workload.has_words
        self._impossible: dict[str, frozenset[str]] = {}  # infeasible jobs by group that it leads
        self.judged: list[tuple[str, list[Fact]]] = []
        """Reports about jobs that became infeasible or feasible: text and facts."""
        self._led = self._leads_now()
        self._is_news = True  # facts that its groups depend on have changed since the last round
        planned = {group: agreement.plans[group] for group in self._led if group in agreement.plans}
        self.planner = MissionPlanner(me, mission.social_domain, beliefs, strategy, planned, agreement.at_sea)
        self.planner.resume(self.facts)
        self.planner.take_on(group for group in self._led if group in self.missions)
        self._negotiation = Negotiation(me, strategy, self.organisation, beliefs, rally_points_m, rules)
        noted = self._requests.attributes | self._negotiation.attributes | {uids[AVAILABLE], uids[SENSORS_WORK]}
        self._attributes: set[int | None] = {self.gatherings.attribute, *noted}
        self._await_facts([*self.planner.rests_on, *(job.done for job in self._jobs.values())])
        if self._declaration.meets and not self._negotiation.takes_part:
            self._negotiation.expect_away(self._work().values())

    @property
    def missions(self) -> Mapping[str, tuple[str, ...]]:
        """Known missions of each group."""
        return missions_of(self.organisation.groups.values(), self.view.missions)

    def objectives_of(self, vehicle: str) -> tuple[Objective, ...]:
        """Return the objectives of all roles that ``vehicle`` holds."""
        played = {(role.group, role.role) for role in self.present.roles_of(vehicle)}
        return tuple(objective for objective in self.objectives.values() if (objective.group, objective.role) in played)

    def leads(self, group: str) -> bool:
        """Return whether this vehicle leads ``group`` and has the social layer."""
        return group in self._led

    def _work(self, positions_m: Mapping[str, Point] | None = None, from_s: float = 0.0) -> Mapping[str, Work]:
        return self.workload.of_groups(self.footing, self._picture, positions_m, from_s)

    # Basis for decisions -------------------------------------------------------------------------

    @property
    def absent(self) -> frozenset[str]:
        """Absent peers."""
        return self._membership.absent

    @property
    def takes_no_jobs(self) -> frozenset[str]:
        """Vehicles that take no jobs; an isolated one still takes those it gives itself."""
        unavailable = self.view.availability.unavailable
        return unavailable - {self.me} if self._is_out_of_reach and self.is_cut_off else unavailable

    @property
    def footing(self) -> Footing:
        """Basis for planning the work of its groups."""
        if not self.is_in_doubt:
            return Footing(self.present, self.takes_no_jobs, False)
        # No peer would know of a job taken between now and the end of the lease.
        if not self.is_cut_off:
            return Footing(self.present, self.takes_no_jobs, False, self._patience.barred)
        if not self.is_patient:
            return Footing(self.present, self.takes_no_jobs, True)
        if self.meets_unheard:
            return Footing(self.present, self.takes_no_jobs | {self.me}, True)
        return Footing(self._with_all, self.takes_no_jobs, True, self._patience.barred)

    @property
    def is_patient(self) -> bool:
        """True during the grace period: an isolated vehicle still leaves the jobs of others alone."""
        return self.is_cut_off and self._membership.looked_s < self._patience.ends_s

    @property
    def meets_unheard(self) -> bool:
        """True during the grace period after the others should have finished: reception is optional."""
        return self.is_patient and self._membership.looked_s >= self._patience.theirs_until_s

    def _leads_now(self) -> tuple[str, ...]:
        if not self.database[self.me].social_layer:
            return ()
        return tuple(group for group in self.present.groups if self.me in self.present.heads(group))

    @property
    def is_due(self) -> bool:
        """True if requests await the end of the round."""
        return bool(self._stated or self._stated_alone or self._is_asked_again)

    @property
    def _now(self) -> Now:
        return Now(self.absent, self.takes_no_jobs, self._membership.began_s, self._membership.missed)

    def _take_over(self, view: View) -> None:
        self.view, self.organisation = view, view.organisation
        leads_alone = self.database[self.me].social_layer
        self.present = acted_on(self.organisation, self.me, self.absent, self.is_cut_off, leads_alone)
        if self.is_cut_off:
            self._with_all = with_work(self.present, self.organisation, self.absent)

    # Reception -----------------------------------------------------------------------------------

    def consider(self, changes: Sequence[Change], is_sent: bool = True) -> Considered:
        """Process changed facts; organisational ones except missions await the end of the round."""
        if self.conclusions.are_of_its_own:
            self.conclusions.note(changes)
        if self.workload.note(changes):
            for change in changes:
                self.planner.orders.note(change)
        if self.workload.is_anew:
            self.workload.is_anew, self._is_news = False, True
            self.planner.plan_again(self._led)
        if not self._is_concerned(changes):
            return NOTHING_CONSIDERED
        self._is_news = True
        alone = self.is_cut_off and not is_sent
        view = self._hear(changes, alone)
        for change in changes:
            self._negotiation.note(change)
        keys = {key for key in self.beliefs.keys_of(changes) if key[0] != HAS_MISSION}
        keys.update(view.keys if view else ())
        if not self.gatherings.keys.isdisjoint(keys):
            if alone:
                self.gatherings.note_alone(keys, changes[0].block.time_s)
            self._picture.groups.gathered = self.gatherings.believed(self.is_cut_off)
        self.planner.reconsider(keys, self._led, self.facts)
        if self.is_cut_off and any(job.done in keys for job in self._jobs.values()):
            self.planner.plan_again(self._led)  # it is free for remaining jobs
        return Considered(self.pursuit.let_go(keys), view.rulings if view else ())

    def _hear(self, changes: Iterable[Change], alone: bool) -> View | None:
        missions: list[DatedRequest] = []
        for change in changes:
            self._note_availability(change.block)
            for request in self._requests.of(change.block):
                is_mission, group = request.asked.act is Act.MISSION, request.asked.group
                if is_mission and (group in self.organisation.groups or group not in self._rules.at_sea):
                    missions.append(request)
                elif not alone:
                    self._stated.append(request)
                elif not is_mission:
                    self._stated_alone.append(request)
        if not missions:
            return None
        self.view = give_missions(self.view, missions, alone, self._now)
        return self.view

    def _note_availability(self, block: Block) -> None:
        for position, fact in enumerate(block.facts):
            if fact.subject != block.origin or fact.attribute not in (self._uids[AVAILABLE], self._uids[SENSORS_WORK]):
                continue
            availability, statement = self.view.availability, (self.beliefs.name(block.origin), bool(fact.value))
            if fact.attribute == self._uids[SENSORS_WORK]:
                availability = availability.hear_of_sensors(*statement, (*block.key, position))
                self.workload.note_blind(availability.blind_since.keys())
            elif statement[0] == self.me and block.epoch != self.beliefs.model.epoch:
                # Its own statement from before a restart: corrected, not obeyed.
                self._is_misjudged |= not fact.value
            else:
                availability = availability.hear(*statement, (*block.key, position))
            self.view = replace(self.view, availability=availability)

    def _await_facts(self, rested_on: Iterable[Any]) -> None:
        kinds = {key[0] if isinstance(key, tuple) else key for key in rested_on}
        self._attributes.update(self._uids[kind] for kind in kinds if kind in self._uids)

    def _is_concerned(self, changes: Sequence[Change]) -> bool:
        # Most facts are positions, on which plans rarely depend.
        attributes = self._attributes
        for change in changes:
            for fact in change.block.facts:
                if fact.attribute in attributes:
                    return True
        return False

    # Membership ----------------------------------------------------------------------------------

    def look_around(self, now_s: float) -> Considered | None:
        """Update membership at the end of a round; free roles of the absent; None without changes."""
        before = self.present
        footing = self.footing if self.is_in_doubt else None  # otherwise it leaves nothing to others
        word_s, names = self._picture.peers.word_s, self.database.names
        heard_s = self._negotiation.heard_or_expected_s(word_s, names, now_s)
        changes = self._membership.look_around(now_s, heard_s, max(word_s.values(), default=0.0))
        self.is_in_doubt = self._membership.in_doubt
        undone, facts, orders = (None, [], []) if changes is NO_CHANGES else self._follow(changes)
        if self.is_in_doubt and footing is None:
            self._patience = self._patience_now(now_s)
        over = self._lose_patience(footing, now_s) if self.is_cut_off else None
        if self.is_in_doubt != (footing is not None):
            self.planner.plan_again(self._led)  # the jobs left to others have changed
        if changes is NO_CHANGES and over is None:
            return None
        self._is_news = True
        self._picture.groups.gathered = self.gatherings.believed(self.is_cut_off)
        self._picture.groups.meets_unheard = self.meets_unheard
        self._picture.groups.returned_s |= dict.fromkeys(changes.present, now_s)
        events = tuple((event, peer) for event, peers in changes._asdict().items() for peer in peers)
        moved = {peer for _, peer in events}
        roles = sorted(assignment for assignment in self.organisation.assignments if assignment.vehicle in moved)
        undone_roles = [] if undone is None else [*undone.assigned, *undone.left]
        keys = {("members", f"{role.group}.{role.role}") for role in [*roles, *undone_roles]}
        stale = self.pursuit.let_go(keys | self.gatherings.concluded_alone | (over or set()))
        self._renew_leads()
        led = [role for role in roles if role.group in self._led]
        self.planner.lose((assignment for assignment in led if assignment.vehicle in changes.absent), self.present)
        self.planner.plan_again({assignment.group for assignment in led if assignment.vehicle in changes.present})
        passed_on = [*([] if self.is_cut_off else self.workload.told_by(changes.absent)), *orders]
        is_due = stale or before.roles_of(self.me) != self.present.roles_of(self.me)
        return Considered(is_due, undone.rulings if undone else (), events, facts, passed_on)

    def _follow(self, changes: Changes) -> tuple[View | None, list[Fact], list[Fact]]:
        if changes.absent:
            # Claims that a leader now absent has blocked may become valid.
            self._is_asked_again = bool(self.view.leadership.claimed)
        was_cut_off, self.is_cut_off = self.is_cut_off, self._membership.cut_off
        facts: list[Fact] = []
        undone: View | None = None
        if self.is_cut_off and not was_cut_off:
            facts = [self.beliefs.fact(*fact) for fact in stepping_down(self.me, self.organisation, self.database)]
            if self.me not in self.view.availability.unavailable:
                self._is_out_of_reach = True
                facts.append(self._available(False))
        elif was_cut_off and not self.is_cut_off:
            undone = come_back(self.view, self.me)
            if self._is_out_of_reach:
                self._is_out_of_reach = False
                facts = [self._available(True)]
        self._take_over(undone or self.view)
        return undone, facts, [] if self.is_cut_off else self._untold()

    def _patience_now(self, now_s: float) -> Patience:
        footing = Footing(self._with_all if self.is_cut_off else self.present, self.takes_no_jobs, False)
        peers, whole = self._picture.peers, self.workload.whole(footing)
        work = self.workload.of_groups(footing, self._picture, peers.positions_m, now_s)
        of_groups = [(whole[name], left, self._negotiation.division(name)) for name, left in work.items()]
        return patience_with(of_groups, self.me, peers.known_s, self._rallies_m, now_s, self._membership.lease_s)

    def _lose_patience(self, before: Footing | None, now_s: float) -> set[Key] | None:
        now, over = self.footing, set[Key]()
        if before is not None and (now.barred, now.takes_no_jobs) == (before.barred, before.takes_no_jobs):
            return None
        self.planner.plan_again(self._led)
        work = self._work() if not now.barred and self.me not in now.takes_no_jobs else {}
        for group in self._led:
            if group in work and work[group].has_something_left:
                over |= self.gatherings.begin(group, now_s)
                self._negotiation.begin(group)
        return over

    @property
    def helping(self) -> Sequence[tuple[str, str, str]]:
        """Return (group, vehicle, role) of the jobs that the strategy has this vehicle help with."""
        return self._negotiation.helping

    @property
    def is_silent(self) -> bool:
        """True while the strategy forbids transmission."""
        return self._negotiation.silent

    def _renew_leads(self) -> None:
        before, self._led = self._led, self._leads_now()
        if before != self._led:
            self._negotiation.hold(set(self._led).difference(before))
            self.planner.lead(
                self._led, [group for group in self._led if group not in before and group in self.missions]
            )

    def _untold(self) -> list[Fact]:
        isolated = self.view.isolated
        self.view = replace(self.view, isolated=isolated._replace(orders=()))
        facts = {order.asked: (order.fact.subject, order.fact.attribute, order.fact.value) for order in isolated.orders}
        allowed = Outcome.SUCCESS
        return [fact for asked, fact in facts.items() if may_assign(asked, self.present, self._rules) is allowed]

    # The end of a round --------------------------------------------------------------------------

    def consult(self) -> Considered:
        """Apply the requests about roles and objectives at the end of a round."""
        self._is_news, view = True, self._agree()
        self._negotiation.disregard(view.unlawful)
        rulings = [ruling for ruling in view.rulings if not ruling.repeats(self.objectives)]
        left, objectives, renewed = view.left, view.objectives, view.renewed
        for group in renewed:
            self.planner.forget(group)
            self._negotiation.begin(group)
            self.gatherings.begin(group, self._picture.body.now_s)
        kept = {key: aim for key, aim in self.objectives.items() if aim.group not in renewed or aim in self._founding}
        self.objectives = kept | objectives
        over = self.conclusions.taken_back(objectives.values(), self.gatherings, self.workload, self._negotiation)
        self._picture.groups.gathered = self.gatherings.believed(self.is_cut_off)
        self._renew_leads()
        self.planner.end_round(left, self.facts)
        self.planner.reconsider(view.keys | over, self._led, self.facts)
        self.planner.lose((assignment for assignment in left if assignment.group in self._led), self.present)
        moved = [*view.assigned, *left]
        stale = self.pursuit.let_go({("members", f"{role.group}.{role.role}") for role in moved} | over)
        return Considered(bool(objectives or stale or any(role.vehicle == self.me for role in moved)), rulings)

    def _agree(self) -> View:
        before = self.organisation
        view = consult(self.view, self._stated, self._stated_alone, self._now)
        self._stated, self._stated_alone, self._is_asked_again = [], [], False
        for group, leading in view.leadership.leading.items():
            led, leads = (self.me in organisation.heads(group) for organisation in (before, view.organisation))
            if led and not leads and leading.vehicle != self.me:
                self._assents.append(self._leads(group, leading.vehicle, leading.claim.term % N_TERMS))
        self._take_over(view)
        return view

    def negotiate(self, now_s: float, motion: Motion, waits: Waits) -> list[tuple[list[Fact], bool]]:
        """Return facts to state at the end of a round, each list with whether to send it."""
        peers = self._picture.peers
        is_news, self._is_news = self._is_news or bool(peers.unheard or self.absent), False
        stated = []
        if is_news:
            of_all = [*self.claims(), self._correction(), self._taken_back()]
            stated = [(facts, True) for facts in of_all if facts]
        has_help = self._declaration.help != "none"
        if not (self._negotiation.takes_part or has_help):
            return stated
        told_s = self.beliefs.model.quantise_time(now_s)
        work = self._work({**peers.positions_m, self.me: motion.position_m}, told_s)
        if has_help:
            self._picture.groups.works = work
            self._picture.groups.awaited = Computed(work, lambda group: work[group].awaited(self.me, now_s))
        unheard = {name: roles for name, roles in peers.unheard.items() if name not in self.absent}
        for statement in self._negotiation.negotiate(told_s, work, peers, unheard, waits, self.missions, is_news):
            is_order = any(attribute in ROLE_ATTRIBUTES for _, attribute, _ in statement.facts)
            facts = self._in_place_of_the_absent(own := [self.beliefs.fact(*fact) for fact in statement.facts])
            self._negotiation.note_added(now_s, [fact for fact in facts if fact not in own])
            facts += aims(statement.facts, self.objectives.values(), self._founding, self.beliefs, self._mission)
            if not self._is_said(facts):  # its plan may have stated them
                stated.append((facts, statement.told and not (is_order and self.is_cut_off)))
        return stated

    def _taken_back(self) -> list[Fact]:
        unheard = self._picture.peers.unheard
        names = [name for name in sorted(self.takes_no_jobs) if name in unheard] if unheard else ()
        return [
            self.beliefs.fact(name, LEFT_ROLE, f"{role.group}.{role.role}")
            for name in names
            for role in self.organisation.roles_of(name)
            if role.group in self._led and f"{role.group}.{role.role}" in unheard[name]
            if (specification := self.organisation.groups[role.group].role(role.role)) is not None and specification.job
        ]

    def plan_missions(self) -> Deliberation:
        """Plan pending missions; let the strategy allocate the roles that the plans require."""
        work = self._work(dict(self._picture.peers.positions_m))
        planned = self.planner.plan(self.facts, self.missions, work, self.objectives.values())
        self._await_facts(self.planner.rests_on)
        facts = self._in_place_of_the_absent(planned.facts)
        parts = by_receiver(facts, self.beliefs, self._requests.role_named, self._mission)
        return replace(planned, facts=facts, parts=parts)

    def findings(self, motion: Motion) -> list[Fact]:
        """Return the facts that this vehicle infers as leader."""
        if not self._led:
            return []
        facts: list[Fact] = []
        work = self._work()
        present = self.footing.present if self.is_cut_off else self.present
        for name in self._led:
            self._picture.groups.note_work(name, work[name].has_something_left, self._picture.body.now_s)
            if self.is_patient:  # with its own work done, it meets the vehicles that have come
                self._picture.groups.meets_unheard = not self._has_left(work[name])
            if self.says_impossible and not self.is_patient:
                of_group = work[name]  # an isolated vehicle may not have reached jobs that it alone can do
                impossible = of_group.short_handed if self.is_cut_off else of_group.impossible
                if impossible is not self._impossible.get(name):
                    self._see_what_is_impossible(of_group, impossible)
            if not self._holds(work[name]):
                facts += self.conclusions.of_head(name, present, self._picture, motion)
        return facts

    # Statements ----------------------------------------------------------------------------------

    def claims(self) -> list[list[Fact]]:
        """Return acknowledgements of other leaders, then claims to lead groups; none if isolated."""
        assents, self._assents = self._assents, []
        if self.is_cut_off:
            return assents
        since_s, away = self._membership.looked_s - self._membership.lease_s, self.absent
        # A claim less than a lease old shows that its vehicle was present: no further claim meanwhile.
        headed = {
            group
            for group, (_, age, name) in (self.view.leadership.leading.items() if away else ())
            if age[0] > since_s and name in away and name in self.organisation.heads(group)
        }
        claimed = claims(self.view, self.me, self.present, headed).items()
        return [*assents, *(self._leads(group, self.me, term) for group, term in claimed)]

    def _leads(self, group: str, vehicle: str, term: int) -> list[Fact]:
        return [self.beliefs.fact(group, HEADED_BY, vehicle), self.beliefs.fact(group, HEAD_TERM, term)]

    def _available(self, takes_jobs: bool) -> Fact:
        return self.beliefs.fact(self.me, AVAILABLE, takes_jobs)

    def _leaving(self, roles: Iterable[RoleAssignment]) -> list[Fact]:
        return [self.beliefs.fact(self.me, LEFT_ROLE, f"{role.group}.{role.role}") for role in roles]

    def _correction(self) -> list[Fact]:
        if not self._is_misjudged or self.is_cut_off:
            return []
        self._is_misjudged = False
        return [] if self.me in self.view.availability.unavailable else [self._available(True)]

    def _is_said(self, facts: Iterable[Fact]) -> bool:
        mine = (request.fact for request in self._stated if request.asked.issuer == self.me)
        last = {(fact.subject, fact.value): fact.attribute for fact in mine}
        return all(last.get((fact[0], fact[2])) == fact[1] for fact in facts)

    def _in_place_of_the_absent(self, facts: Iterable[Fact]) -> list[Fact]:
        """Insert releases before facts that reassign roles held by absent vehicles."""
        stated: list[Fact] = []
        for fact in facts:
            if fact[1] == self._uids[PLAYS_ROLE]:
                path = self.beliefs.name(fact[2])
                group, role = path.split(".")
                holders = self.organisation.members(group, role)
                specification = self.organisation.groups[group].role(role)
                if specification is not None and specification.maximum == len(holders) and self.absent >= set(holders):
                    # Receivers that do not presume the holders absent would find no vacancy.
                    stated += [self.beliefs.fact(name, LEFT_ROLE, path) for name in holders]
            stated.append(fact)
        return stated

    def resign(self) -> list[Fact]:
        """Return facts by which the vehicle leaves all roles and takes no more jobs."""
        self._is_out_of_reach = False
        return [*self._leaving(self.organisation.roles_of(self.me)), self._available(False)]

    def give_up(self, objective: Objective, blind: bool = False) -> list[Fact]:
        """Return facts that declare an objective infeasible for this vehicle; empty if stated.

        It leaves its jobs and takes none, but stays in its groups; if ``blind``, only jobs that need sensors count.
        """
        if objective in self._given_up:
            return []
        self._given_up.add(objective)
        if blind and self._takes_sensors(objective.group, objective.role):
            held = self.organisation.roles_of(self.me)
            left = [role for role in held if self._takes_sensors(role.group, role.role)]
            return [*self._leaving(left), self.beliefs.fact(self.me, SENSORS_WORK, False)]
        self._is_out_of_reach = False
        with_job = {(g.name, role.name) for g in self.organisation.groups.values() for role in g.roles if role.job}
        specification = self.organisation.groups[objective.group].role(objective.role)
        if specification is None or not specification.founding:  # its founding role keeps it in the group
            with_job.add((objective.group, objective.role))
        roles = [role for role in self.organisation.roles_of(self.me) if (role.group, role.role) in with_job]
        return [*self._leaving(roles), self._available(False)]

    def _takes_sensors(self, group: str, role: str) -> bool:
        known = self.organisation.groups.get(group)
        return known is not None and takes_sensors(self._rules, known.role(role), self.me)

    def addressed(self, change: Change) -> dict[str, set[str]]:
        """Return receivers that must acknowledge an own block, with the roles that it gives them."""
        receivers: dict[str, set[str]] = {}
        groups: set[str] = set()
        for fact in change.block.facts:
            if (named := self._requests.role_named(fact)) is None:
                continue
            attribute, role = named
            if attribute in ROLE_ATTRIBUTES:
                roles = receivers.setdefault(self.beliefs.name(fact.subject), set())
                roles.update({role} if attribute == PLAYS_ROLE else ())
            else:
                groups.add(role.split(".")[0])
        if not receivers and not self._declaration.planned_before:
            # Objectives alone concern all members of the group.
            receivers = {member: set() for group in groups for member in self.present.members(group)}
        receivers.pop(self.me, None)
        return receivers

    # Infeasible jobs ------------------------------------------------------------------------------

    def job_of(self, objective: Objective) -> str | None:
        """Return the job of the objective's role, if vehicles of this mission report inability."""
        group = self.organisation.groups.get(objective.group)
        role = None if group is None else group.role(objective.role)
        return role.job if role is not None and self.says_impossible else None

    def unable_to(self, job: str) -> list[Fact]:
        """Return that all ways to do a job have failed; empty without the means or if reported."""
        return [self.beliefs.fact(self.me, UNABLE_TO, job)] if self.workload.is_able(job) else []

    def leave(self) -> list[tuple[str, list[Fact]]]:
        """Return the jobs to leave at the end of a round: reason and facts."""
        works = self._work()
        if not (self.pursuit.hopeless or self.workload.is_hindered or any(of.short_handed for of in works.values())):
            return []
        left, hopeless = list[tuple[str, list[Fact]]](), {(of.group, of.role) for of in self.pursuit.hopeless}
        for name, work in works.items():
            for role in work.held_by(self.me):
                job, reasons = role.job or "", list[Fact]()
                if (name, role.name) in hopeless:
                    reasons = self.unable_to(job)
                if reasons or job in work.short_handed or not self.workload.is_able(job):
                    facts = [*reasons, self.beliefs.fact(self.me, LEFT_ROLE, f"{name}.{role.name}")]
                    left.append((f"{job}: {self._why_not(work, job) or 'no way left'}", facts))
        return left

    def _why_not(self, work: Work, job: str) -> str:
        few = [f"takes {vehicles_taken(work.jobs[job])} vehicles at once"] if job in work.short_handed else []
        return "; ".join([*few, *filter(None, [self.workload.why_not(job)])])

    def _see_what_is_impossible(self, work: Work, now: frozenset[str]) -> None:
        self._impossible[work.group.name] = now
        for job in [role.job or "" for role in work.unfinished]:
            if (job in now) is not bool(self.beliefs.get((IS_IMPOSSIBLE, job))):
                why = self._why_not(work, job) or NOBODY_THERE if job in now else "possible again"
                self.judged.append((f"{job}: {why}", [self.beliefs.fact(job, IS_IMPOSSIBLE, job in now)]))

    def gives_out(self, group: str) -> bool:
        """Return whether ``group`` has work that this vehicle has to assign or to confirm."""
        return group in self._negotiation.holding and self._has_left(self._work()[group])

    def _has_left(self, work: Work) -> bool:
        if not work.barred:
            return work.has_something_left
        return any(work.able(self.database[self.me], role) for role in work.unfinished)

    def _holds(self, work: Work) -> bool:
        if not self._has_left(work):
            return False
        name = work.group.name
        if name in self._negotiation.holding:
            return True
        unheard = frozenset(self._picture.peers.unheard) - self.absent
        return self.leads(name) and self.planner.orders.waits_for(unheard, work.done)

    def completed(self, objective: Objective) -> list[Fact]:
        """Return the facts to state when ``objective`` is complete."""
        if facts := self.conclusions.completion(objective):
            self.finished.append(objective)
        return facts

    def activity_sets(self, position_m: Point) -> tuple[ActivitySet, ...]:
        """Return activities for its objectives; current ones stay while their facts are unchanged."""
        sets = self.pursuit.sets(self.objectives_of(self.me), self.facts, position_m)
        self._await_facts(self.pursuit.rests_on)
        return sets
