"""Social layer: the flotilla as an organisation, and the missions it performs (REMORAS, section IV).

Its eight modules, by the paper's names, and where they are:

* AUV database: ``database``, data of the vehicles;
* optimiser of organisational performances: ``strategy``, which allocates roles;
* groups and roles: ``organisation``, which vehicles belong to and play which;
* missions: ``missions``, what each group is to do;
* mission planner: ``MissionPlanner``, which turns the missions of the groups that this vehicle leads into objectives;
* individual objectives of a vehicle and collective objectives of a role: ``objectives_of``.

Organisational data are facts of the world model and travel as such; ``consultation`` says from when they count, and
``Standing`` who of the members is there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from remoras.activities import ActivitySet, Objective
from remoras.authority import Rules, Ruling
from remoras.beliefs import Beliefs, Fact, Key
from remoras.database import AUVDatabase
from remoras.mission import SocialPart
from remoras.motion import Motion
from remoras.organisation import Organisation
from remoras.picture import Picture
from remoras.social.agreement import Agreement
from remoras.social.conclusions import Conclusions, Gatherings
from remoras.social.leadership import LEFT_ROLE, ROLE_ATTRIBUTES
from remoras.social.membership import NO_CHANGES, Lease
from remoras.social.negotiation import Negotiation
from remoras.social.orders import aims
from remoras.social.planning import Deliberation, MissionPlanner, OwnFacts, missions_of
from remoras.social.pursuit import Pursuit
from remoras.social.requests import HAS_MISSION
from remoras.social.standing import Footing, Patience, Seen, Standing, patience_with
from remoras.social.workload import Workload
from remoras.strategy import Strategy
from remoras.work import IS_IMPOSSIBLE, UNABLE_TO, Awaited, Point, Work, vehicles_taken
from worldmodel import Change


class Considered(NamedTuple):
    """What facts that changed, or the end of a round, mean for this vehicle.

    Attributes:
        activities_due: True if its activities have to be chosen anew.
        rulings: what became of requests, in its view.
    """

    activities_due: bool
    rulings: Sequence[Ruling]


NOTHING_CONSIDERED = Considered(False, ())
NOBODY_THERE = "nobody who is there is able to do it"


@dataclass(frozen=True, slots=True)
class Review:
    """What a look around at the end of a round has shown.

    Attributes:
        events: "absent" or "present", and the peer that has become so.
        facts: what this vehicle tells the others about itself on falling out and on coming back.
        rulings: what counts no longer, or again, now that it has come back.
        activities_due: True if its activities have to be chosen anew.
        passed_on: what those who are absent now have told, and cannot repeat; each fact by itself.
    """

    events: tuple[tuple[str, str], ...]
    facts: list[Fact]
    rulings: Sequence[Ruling]
    activities_due: bool
    passed_on: list[Fact]


class SocialLayer:
    """Organisation, missions and objectives as one vehicle sees them.

    ``organisation`` is what was agreed, ``present``, by which the vehicle acts, the same without the absent. ``facts``
    are what its plans are made of; ``planner`` and ``pursuit`` carry out those of its groups and its own. It
    ``says_impossible`` what it and others are not able to do, if its mission has the words.

    Args:
        me: own name.
        database: static data of all vehicles.
        beliefs: facts of this vehicle.
        mission: turns missions into objectives and objectives into activities.
        strategy: forms the organisation and allocates roles.
        agreement: what was agreed before the mission.
        rally_points_m: by name.
        picture: what is known of the peers; its part ``groups`` is written here and nowhere else.
        lease: how long a peer counts as present of which there is no word; until_s: the mission's end.
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
        self.finished: list[Objective] = []
        self._beliefs = beliefs
        self._mission = mission
        self._mission_name = f"mission {type(mission).__name__}"
        self._picture = picture
        self._rallies_m = rally_points_m
        picture.facts = beliefs
        self.objectives = {
            (objective.group, objective.role, objective.name): objective for objective in agreement.objectives
        }
        self._founding = frozenset(agreement.objectives)
        self._jobs = mission.jobs
        self.conclusions = Conclusions(me, mission, self._mission_name, beliefs)
        self._gatherings = Gatherings(beliefs, [group.name for group in agreement.groups], agreement.meets_after)
        rules = Rules(database, self._declaration.authorities, self._jobs, agreement.supervisors, agreement.at_sea)
        self.standing = Standing(
            me, rules, beliefs, agreement.organisation, lease or Lease(math.inf, picture.frame_s), until_s
        )
        self._workload = Workload(me, rules, mission, beliefs, self.standing.reports)
        self.pursuit = Pursuit(database[me], mission, self._mission_name, self._workload.has_words)
        self.says_impossible = self._workload.has_words
        self._impossible: dict[str, frozenset[str]] = {}  # by group that it leads, as it has seen last
        self.judged: list[tuple[str, list[Fact]]] = []
        """What it has to say of jobs being impossible or not: in words, and as facts."""
        self._led = self.standing.led
        self._is_news = True  # since the last round, of what its groups rest on
        planned = {group: agreement.plans[group] for group in self._led if group in agreement.plans}
        self.planner = MissionPlanner(me, mission.social_domain, beliefs, strategy, planned, agreement.at_sea)
        self.planner.resume(self.facts)
        self.planner.take_on(group for group in self._led if group in self.missions)
        self._negotiation = Negotiation(me, strategy, self.organisation, beliefs, rally_points_m, rules)
        noted = self.standing.attributes | self._negotiation.attributes
        self._attributes: set[int | None] = {self._gatherings.attribute, *noted}
        self._attribute_uids = {attribute.name: attribute.uid for attribute in beliefs.model.tbox.attributes}
        self._await_facts([*self.planner.rests_on, *(job.done for job in self._jobs.values())])
        if self._declaration.meets and not self._negotiation.takes_part:
            self._negotiation.expect_away(self._work().values())

    @property
    def organisation(self) -> Organisation:
        """Groups and roles as agreed."""
        return self.standing.organisation

    @property
    def present(self) -> Organisation:
        """Groups and roles that the vehicle acts on: without the absent; where it is cut off, it leads itself."""
        return self.standing.present

    @property
    def facts(self) -> OwnFacts:
        """What its plans are made of, as it is now."""
        at, own = self.standing, (self._gatherings, self.standing.is_cut_off, self.planner, self.objectives)
        return OwnFacts(self._beliefs, self.database, at.present, at.view, *own)

    @property
    def missions(self) -> Mapping[str, tuple[str, ...]]:
        """What each group is to do, by its name, as far as it is known."""
        return missions_of(self.organisation.groups.values(), self.standing.view.missions)

    def objectives_of(self, vehicle: str) -> tuple[Objective, ...]:
        """Objectives of all roles that ``vehicle`` plays."""
        played = {(role.group, role.role) for role in self.present.roles_of(vehicle)}
        return tuple(objective for objective in self.objectives.values() if (objective.group, objective.role) in played)

    def leads(self, group: str) -> bool:
        """True if this vehicle is a head of ``group`` and has the social layer to lead it."""
        return group in self._led

    def _work(self, positions_m: Mapping[str, Point] | None = None, from_s: float = 0.0) -> Mapping[str, Work]:
        return self._workload.of_groups(self.standing.footing, self._picture, positions_m, from_s)

    # Hearing -------------------------------------------------------------------------------------

    def consider(self, changes: Sequence[Change], told: bool = True) -> Considered:
        """Take note of changed facts; those that are organisational wait for the end of the round, but for missions.

        Args:
            changes: of the world model.
            told: False if this vehicle keeps to itself what it states.
        """
        if self.conclusions.are_of_its_own:
            self.conclusions.note(changes)
        if self._workload.note(changes):
            for change in changes:
                self.planner.orders.note(change)
        if self._workload.is_anew:
            self._workload.is_anew, self._is_news = False, True
            self.planner.plan_again(self._led)
        if not self._is_concerned(changes):
            return NOTHING_CONSIDERED
        self._is_news = True
        alone = self.standing.is_cut_off and not told
        view = self.standing.hear(changes, alone)
        for change in changes:
            self._negotiation.note(change)
        keys = {key for key in self._beliefs.keys_of(changes) if key[0] != HAS_MISSION}
        keys.update(view.keys if view else ())
        if not self._gatherings.keys.isdisjoint(keys):
            if alone:
                self._gatherings.note_alone(keys, changes[0].block.time_s)
            self._picture.groups.gathered = self._gatherings.believed(self.standing.is_cut_off)
        self.planner.reconsider(keys, self._led, self.facts)
        if self.standing.is_cut_off and any(job.done in keys for job in self._jobs.values()):
            self.planner.plan_again(self._led)  # it is free for what others have left
        return Considered(self.pursuit.let_go(keys), view.rulings if view else ())

    def _await_facts(self, rested_on: Iterable[Any]) -> None:
        """Let the facts with these keys be considered from now on: plans rest on them."""
        kinds = {key[0] if isinstance(key, tuple) else key for key in rested_on}
        uids = self._attribute_uids
        self._attributes.update(uids[kind] for kind in kinds if kind in uids)

    def _is_concerned(self, changes: Sequence[Change]) -> bool:
        """True if any of the facts may matter here: most say where somebody is, and plans rest on them seldom."""
        attributes = self._attributes
        for change in changes:
            for fact in change.block.facts:
                if fact.attribute in attributes:
                    return True
        return False

    # Who is there --------------------------------------------------------------------------------

    def look_around(self, now_s: float) -> Review | None:
        """End of a round: see who is there; None if nothing changed. Roles of the absent fall free, heads replan."""
        before, standing = self.present, self.standing
        footing = standing.footing if standing.is_in_doubt else None  # before that it leaves nothing to others
        word_s, names = self._picture.peers.word_s, self.database.names
        heard_s = self._negotiation.heard_or_expected_s(word_s, names, now_s)
        seen = self.standing.look_around(now_s, heard_s, max(word_s.values(), default=0.0))
        if standing.is_in_doubt and footing is None:
            standing.be_patient(lambda at: self._patience(at, now_s))
        over = self._lose_patience(footing, now_s) if standing.is_cut_off else None
        if standing.is_in_doubt != (footing is not None):
            self.planner.plan_again(self._led)  # what it leaves to others, or no longer
        if seen is None and over is None:
            return None
        seen, self._is_news = seen or Seen(NO_CHANGES), True
        self._picture.groups.gathered = self._gatherings.believed(self.standing.is_cut_off)
        self._picture.groups.meets_unheard = self.standing.meets_unheard
        self._picture.groups.returned_s |= dict.fromkeys(seen.changes.present, now_s)
        events = tuple((event, peer) for event, peers in seen.changes._asdict().items() for peer in peers)
        moved = {peer for _, peer in events}
        roles = sorted(assignment for assignment in self.organisation.assignments if assignment.vehicle in moved)
        undone = [] if seen.undone is None else [*seen.undone.assigned, *seen.undone.left]
        keys = {("members", f"{role.group}.{role.role}") for role in [*roles, *undone]}
        stale = self.pursuit.let_go(keys | self._gatherings.concluded_alone | (over or set()))
        self._renew_leads()
        led = [role for role in roles if role.group in self._led]
        self.planner.lose((assignment for assignment in led if assignment.vehicle in seen.changes.absent), self.present)
        self.planner.plan_again({assignment.group for assignment in led if assignment.vehicle in seen.changes.present})
        passed_on = [] if self.standing.is_cut_off else self._workload.told_by(seen.changes.absent)
        passed_on += seen.orders
        is_due = stale or before.roles_of(self.me) != self.present.roles_of(self.me)
        return Review(events, seen.facts, seen.undone.rulings if seen.undone else (), is_due, passed_on)

    def _patience(self, at: Footing, now_s: float) -> Patience:
        """What it leaves to the others now that it hears nobody."""
        peers, whole = self._picture.peers, self._workload.whole(at)
        work = self._workload.of_groups(at, self._picture, peers.positions_m, now_s)
        of_groups = [(whole[name], left, self._negotiation.division(name)) for name, left in work.items()]
        return patience_with(of_groups, self.me, peers.known_s, self._rallies_m, now_s, self.standing.lease_s)

    def _lose_patience(self, before: Footing | None, now_s: float) -> set[Key] | None:
        """If it leaves something else to the others now: meetings that are over, since there is work for it after them.

        Args:
            before: what it acted on when it looked around last; None if it left nothing to others.
            now_s: end of the round.
        """
        now, over = self.standing.footing, set[Key]()
        if before is not None and (now.barred, now.takes_no_jobs) == (before.barred, before.takes_no_jobs):
            return None
        self.planner.plan_again(self._led)
        work = self._work() if not now.barred and self.me not in now.takes_no_jobs else {}
        for group in self._led:
            if group in work and work[group].has_something_left:
                over |= self._gatherings.begin(group, now_s)
                self._negotiation.begin(group)
        return over

    @property
    def is_silent(self) -> bool:
        """True while the strategy lets the vehicle send nothing."""
        return self._negotiation.silent

    def _renew_leads(self) -> None:
        """The organisation or who is there has changed: missions of groups that this vehicle leads now are due."""
        before, self._led = self._led, self.standing.led
        if before != self._led:
            self._negotiation.hold(set(self._led).difference(before))
            self.planner.lead(
                self._led, [group for group in self._led if group not in before and group in self.missions]
            )

    # The end of a round --------------------------------------------------------------------------

    def consult(self) -> Considered:
        """End of a round: what was said in it of roles and objectives counts from now on."""
        self._is_news, view = True, self.standing.agree()
        self._negotiation.disregard(view.unlawful)
        rulings = [ruling for ruling in view.rulings if not ruling.repeats(self.objectives)]
        left, objectives, renewed = view.left, view.objectives, view.renewed
        for group in renewed:
            self.planner.forget(group)
            self._negotiation.begin(group)
            self._gatherings.begin(group, self._picture.body.now_s)
        kept = {at: aim for at, aim in self.objectives.items() if aim.group not in renewed or aim in self._founding}
        self.objectives = kept | objectives
        over = self.conclusions.taken_back(objectives.values(), self._gatherings, self._workload, self._negotiation)
        self._picture.groups.gathered = self._gatherings.believed(self.standing.is_cut_off)
        self._renew_leads()
        self.planner.end_round(left, self.facts)
        self.planner.reconsider(view.keys | over, self._led, self.facts)
        self.planner.lose((assignment for assignment in left if assignment.group in self._led), self.present)
        moved = [*view.assigned, *left]
        stale = self.pursuit.let_go({("members", f"{role.group}.{role.role}") for role in moved} | over)
        return Considered(bool(objectives or stale or any(role.vehicle == self.me for role in moved)), rulings)

    def negotiate(self, now_s: float, motion: Motion, calls: Mapping[str, float]) -> list[tuple[list[Fact], bool]]:
        """End of a round: facts that this vehicle states together to organise its groups, and whether it tells them.

        Args:
            motion: of this vehicle.
            calls: how dissatisfied the vehicles are that call on this one, by name.
        """
        peers = self._picture.peers
        is_news, self._is_news = self._is_news or bool(peers.unheard or self.standing.absent), False
        stated = []
        if is_news:
            of_all = [*self.standing.claims(), self.standing.correction(), self._taken_back()]
            stated = [(facts, True) for facts in of_all if facts]
        if not (self._negotiation.takes_part or self._declaration.influences):
            return stated
        told_s = self._beliefs.model.quantise_time(now_s)
        work = self._work({**peers.positions_m, self.me: motion.position_m}, told_s)
        if self._declaration.influences:
            self._picture.groups.awaited, self._picture.groups.works = Awaited(work, self.me, now_s), work
        unheard = {name: roles for name, roles in peers.unheard.items() if name not in self.standing.absent}
        for statement in self._negotiation.negotiate(
            told_s, work, peers.known_s, unheard, calls, self.missions, peers.links, is_news
        ):
            is_order = any(attribute in ROLE_ATTRIBUTES for _, attribute, _ in statement.facts)
            facts = self.standing.in_place_of_the_absent(own := [self._beliefs.fact(*fact) for fact in statement.facts])
            self._negotiation.note_added(now_s, [fact for fact in facts if fact not in own])
            facts += aims(statement.facts, self.objectives.values(), self._founding, self._beliefs, self._mission)
            if not self.standing.is_said(facts):  # as its plan may have, before
                stated.append((facts, statement.told and not (is_order and self.standing.is_cut_off)))
        return stated

    def _taken_back(self) -> list[Fact]:
        """That vehicles which say that they take no jobs leave those that they have not heard to be theirs."""
        unheard = self._picture.peers.unheard
        names = [name for name in sorted(self.standing.takes_no_jobs) if name in unheard] if unheard else ()
        return [
            self._beliefs.fact(name, LEFT_ROLE, f"{role.group}.{role.role}")
            for name in names
            for role in self.organisation.roles_of(name)
            if role.group in self._led and f"{role.group}.{role.role}" in unheard[name]
            if (of := self.organisation.groups[role.group].role(role.role)) is not None and of.job
        ]

    def plan_missions(self) -> Deliberation:
        """Plan the missions that are due, and let the strategy allocate what the plans ask for."""
        work = self._work(dict(self._picture.peers.positions_m))
        planned = self.planner.plan(self.facts, self.missions, work, self.objectives.values())
        self._await_facts(self.planner.rests_on)
        facts = self.standing.in_place_of_the_absent(planned.facts)
        return replace(planned, facts=facts, parts=self.standing.by_receiver(facts, self._mission.is_individual))

    def findings(self, motion: Motion) -> list[Fact]:
        """What this vehicle concludes as the leader of its groups, as facts."""
        if not self._led:
            return []
        facts: list[Fact] = []
        work, standing = self._work(), self.standing
        present = standing.footing.present if standing.is_cut_off else standing.present
        for name in self._led:
            self._picture.groups.note_work(name, work[name].has_something_left, self._picture.body.now_s)
            if standing.is_patient:  # with its own work done it meets with whoever has come
                self._picture.groups.meets_unheard = not self._has_left(work[name])
            if self.says_impossible and not standing.is_patient:
                of = work[name]  # who is cut off may only not have come yet to what no other one does
                impossible = of.short_handed if standing.is_cut_off else of.impossible
                if impossible is not self._impossible.get(name):
                    self._see_what_is_impossible(of, impossible)
            if not self._holds(work[name]):
                facts += self.conclusions.of_head(name, present, self._picture, motion)
        return facts

    # What is beyond it, and beyond all ------------------------------------------------------------

    def job_of(self, objective: Objective) -> str | None:
        """The job of the role whose objective it is, if vehicles of this mission say what they are not able to do."""
        group = self.organisation.groups.get(objective.group)
        role = None if group is None else group.role(objective.role)
        return role.job if role is not None and self.says_impossible else None

    def unable_to(self, job: str) -> list[Fact]:
        """That each of its ways to do a job has failed; nothing if it lacks what the job takes, or has said so."""
        return [self._beliefs.fact(self.me, UNABLE_TO, job)] if self._workload.is_able(job) else []

    def leave(self) -> list[tuple[str, list[Fact]]]:
        """End of a round: jobs that it is not able to do, with the reason, and by which facts it leaves them."""
        works = self._work()
        if not (self.pursuit.hopeless or self._workload.is_hindered or any(of.short_handed for of in works.values())):
            return []
        left, hopeless = list[tuple[str, list[Fact]]](), {(of.group, of.role) for of in self.pursuit.hopeless}
        for name, work in works.items():
            for role in work.held_by(self.me):
                job, said = role.job or "", list[Fact]()
                if (name, role.name) in hopeless:
                    said = self.unable_to(job)
                if said or job in work.short_handed or not self._workload.is_able(job):
                    facts = [*said, self._beliefs.fact(self.me, LEFT_ROLE, f"{name}.{role.name}")]
                    left.append((f"{job}: {self._why_not(work, job) or 'no way left'}", facts))
        return left

    def _why_not(self, work: Work, job: str) -> str:
        """Why nobody does a job, in words."""
        few = [f"takes {vehicles_taken(work.jobs[job])} vehicles at once"] if job in work.short_handed else []
        return "; ".join([*few, *filter(None, [self._workload.why_not(job)])])

    def _see_what_is_impossible(self, work: Work, now: frozenset[str]) -> None:
        """Take note of the jobs of a group that nobody who is there is able to do, or that are possible again."""
        self._impossible[work.group.name] = now
        for job in [role.job or "" for role in work.unfinished]:
            if (job in now) is not bool(self._beliefs.get((IS_IMPOSSIBLE, job))):
                why = self._why_not(work, job) or NOBODY_THERE if job in now else "possible again"
                self.judged.append((f"{job}: {why}", [self._beliefs.fact(job, IS_IMPOSSIBLE, job in now)]))

    def gives_out(self, group: str) -> bool:
        """True while ``group`` has work, for somebody present, that this vehicle has to give out or to see done."""
        return group in self._negotiation.holding and self._has_left(self._work()[group])

    def _has_left(self, work: Work) -> bool:
        """True if a group has something left that this vehicle does not leave to others."""
        if not work.barred:
            return work.has_something_left
        return any(work.able(self.database[self.me], role) for role in work.unfinished)

    def _holds(self, work: Work) -> bool:
        """True while a group still has work to hand out or to confirm, so that it does not count as gathered."""
        if not self._has_left(work):
            return False
        name = work.group.name
        if name in self._negotiation.holding:
            return True
        unheard = frozenset(self._picture.peers.unheard) - self.standing.absent
        return self.leads(name) and self.planner.orders.waits_for(unheard, work.done)

    def addressed(self, change: Change) -> dict[str, set[str]]:
        """Who has to hear of a block of this vehicle's own, by name, and the roles that it gives them."""
        return self.standing.addressed(change, everybody=not self._declaration.planned_before)

    def completed(self, objective: Objective) -> list[Fact]:
        """What to make known when all has been done for ``objective``."""
        if facts := self.conclusions.completion(objective):
            self.finished.append(objective)
        return facts

    def activity_sets(self, position_m: Point) -> tuple[ActivitySet, ...]:
        """Activities by which it pursues its objectives; those under way stay while the facts do that they rest on."""
        sets = self.pursuit.sets(self.objectives_of(self.me), self.facts, position_m)
        self._await_facts(self.pursuit.rests_on)
        return sets
