"""Standing: the organisation as one vehicle knows it, and its own place in it.

What was agreed is one value, what the vehicle acts on another: the same without those who are absent. A vehicle that is
cut off tells those who may still hear it that it takes no jobs and leads no longer; then it leads itself, and what it
orders is for itself alone. When it hears somebody again, it lets go of what it took on alone and takes jobs again.

Patience: what a vehicle that is cut off leaves to the others, and until when.

It cannot know whether the others are lost or out of its reach. So it does its own jobs and goes to the meeting of its
groups. Until the others should have done what they have to do, and have come, their jobs are theirs; by then whoever
can come has come, and it meets with them, seen or not. Only when that has brought no contact either, it takes the
others to be lost and does what they have not told to be done.

A job is its holder's. Whose it is if nobody is known to have it all who are cut off have to see alike, whatever each
heard last: so it is whose the strategy's messages have made it, which all have heard again and again, and where they do
not say, what follows from what all have known since before the mission (`owners`). That counts from when a vehicle has
heard nobody for a part of a lease: what it took between then and the end of the lease nobody would know of.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from exchange.arithmetic import distance
from remoras.activities import Objective
from remoras.authority import NOBODY, Act, Request, Rules, may_assign
from remoras.beliefs import Beliefs, Fact
from remoras.organisation import Organisation, Outcome, RoleAssignment
from remoras.social.consultation import claims, come_back, consult, give_missions
from remoras.social.leadership import (
    HEAD_TERM,
    HEADED_BY,
    LEFT_ROLE,
    N_TERMS,
    PLAYS_ROLE,
    ROLE_ATTRIBUTES,
    stepping_down,
)  # fmt: skip
from remoras.social.membership import AWAY_FRAMES, DOUBT, NO_CHANGES, Changes, Lease, Membership, acted_on
from remoras.social.orders import by_receiver
from remoras.social.reports import SENSORS_WORK, Reports, takes_sensors
from remoras.social.requests import DatedRequest, Requests
from remoras.social.view import AVAILABLE, Now, View
from remoras.work import Outlook, Point, Work
from worldmodel import Block, Change

LATE = 1.2
"""A vehicle may take longer for what it has left, by this factor, than its data say."""


class Patience(NamedTuple):
    """What a vehicle that is cut off leaves to others.

    Attributes:
        theirs_until_s: until when the jobs of the others are theirs.
        ends_s: until when they are nobody's.
        barred: (vehicle, role) of jobs that are another's.
    """

    theirs_until_s: float = -math.inf
    ends_s: float = -math.inf
    barred: frozenset[tuple[str, str]] = frozenset()


def with_work(present: Organisation, organisation: Organisation, absent: Collection[str]) -> Organisation:
    """The organisation as a vehicle that is cut off acts on it, with the roles of the absent but those of heads."""
    for role in sorted(organisation.assignments):
        if role.vehicle in absent and role.role != organisation.groups[role.group].head_role:
            present, _ = present.assign(role.vehicle, role.group, role.role)
    return present


def owners(whole: Work) -> dict[str, str]:
    """Who is to do the job of each role that has no holder: the longest first, each goes to who would be done first.

    Args:
        whole: work of a group before the mission has begun.
    """
    owner_of: dict[str, str] = {}
    at = {data.name: Outlook(0.0, data.start_m) for data in whole.workers}

    def ends(role: str) -> list[tuple[float, str, Outlook]]:
        of = next(of for of in whole.roles if of.name == role)
        after = ((name, whole.after(here, whole.database[name], of)) for name, here in at.items())
        return [(then.free_s, name, then) for name, then in after if then is not None]

    takes_s = {role.name: min((end_s for end_s, *_ in ends(role.name)), default=0.0) for role in whole.roles}
    for role in sorted(takes_s, key=lambda name: (-takes_s[name], name)):
        if could := ends(role):
            _, owner_of[role], at[owner_of[role]] = min(could)
    return owner_of


def patience_with(
    all_work: Iterable[tuple[Work, Work, Mapping[str, str]]],
    me: str,
    known_s: Mapping[str, float],
    rallies_m: Mapping[str, Point],
    now_s: float,
    lease_s: float,
) -> Patience:
    """What a vehicle has that is cut off: by what it knew last of where the others were, and what they had to do.

    As all who are cut off at once notice it within a lease, they wait so much longer for each other, and for the ways
    from one meeting to the next.

    Args:
        all_work: of the groups, with those who are absent: before the mission has begun, and now; and who is to do
            the jobs of roles, by the strategy's messages.
        me: name of the vehicle.
        known_s: when each vehicle was heard of last.
        rallies_m: rally points by name.
        now_s: from when it leaves that to others.
        lease_s: how long a peer counts as present of which there is no word.
    """
    until_s, way_s, barred = now_s, 0.0, set[tuple[str, str]]()
    for whole, work, division in all_work:
        rally_m = rallies_m.get(work.group.rally_point or "")
        of_nobody = {**owners(whole), **division}
        of = {role.name: work.holders(role) or (of_nobody.get(role.name, ""),) for role in work.unfinished}
        for data in work.workers:
            barred |= {(data.name, role) for role, names in of.items() if data.name not in names}
            if data.name == me:
                continue
            since_s = known_s.get(data.name, 0.0)
            own = [role for role in work.unfinished if data.name in of[role.name]]
            end = work.after_all(Outlook(since_s, work.position_m(data.name)), data, own)
            way_m = 0.0 if rally_m is None else distance(end.position_m, rally_m)
            until_s = max(until_s, since_s + LATE * (end.free_s + way_m / data.transit_speed_mps - since_s))
        if rally_m is not None and me in work.members:
            way_m = max(distance(rally_m, other_m) for other_m in rallies_m.values())
            way_s = max(way_s, way_m / work.database[me].transit_speed_mps)
    return Patience(until_s, until_s + LATE * way_s + lease_s, frozenset(barred))


@dataclass(frozen=True, slots=True)
class Seen:
    """What a look around at the end of a round has shown.

    Attributes:
        changes: peers that have become absent and present.
        undone: the view in which roles count no longer, or again, now that this vehicle has come back; else None.
        facts: what it tells the others of itself on falling out and on coming back.
        orders: what it gave while it was cut off, told once it is back.
    """

    changes: Changes
    undone: View | None = None
    facts: list[Fact] = field(default_factory=list)
    orders: list[Fact] = field(default_factory=list)


class Footing(NamedTuple):
    """What the vehicle acts on.

    Attributes:
        present: the organisation without the absent.
        takes_no_jobs: vehicles that take none.
        is_cut_off: it hears nobody.
        barred: (vehicle, role) of jobs that it leaves to others, see ``remoras.social.standing``.
    """

    present: Organisation
    takes_no_jobs: frozenset[str]
    is_cut_off: bool
    barred: frozenset[tuple[str, str]] = frozenset()


class Standing:
    """Organisation, membership and availability as one vehicle sees them.

    Args:
        me: own name.
        rules: of who may change what, with the static data of all vehicles.
        beliefs: of the vehicle.
        organisation: as agreed before the mission.
        lease: how long a peer of which there is no word counts as present.
        until_s: end of the mission.

    Attributes:
        view: what counts of the organisation; organisation: the same, groups and roles alone.
        present: the organisation that the vehicle acts on.
        reports: what is known of the energy and the sensors of all.
        attributes: of the facts that it takes note of.
        lease_s: how long a peer counts as present, in any case, of which there is no word.
        is_cut_off: True while this vehicle has heard nobody at all for a lease: its orders are for itself alone.
        is_in_doubt: True from when it has heard nobody for a part of the lease: what is another's it takes no more.
    """

    def __init__(
        self,
        me: str,
        rules: Rules,
        beliefs: Beliefs,
        organisation: Organisation,
        lease: Lease,
        until_s: float = math.inf,
    ) -> None:
        self._me = me
        self._rules = rules
        self._database = database = rules.database
        self._beliefs = beliefs
        self._membership = Membership(me, database.names, lease)
        self.is_cut_off = False
        self.is_in_doubt = False
        self._is_out_of_reach = False  # it has said that it takes no jobs, since it is cut off
        self.lease_s, self._away_s = lease.longest_s, AWAY_FRAMES * lease.frame_s
        self._looked_s = self._was_away_s = self._began_s = 0.0
        self._missed = NOBODY
        self._assents: list[list[Fact]] = []
        self._given_up: set[Objective] = set()
        self.reports = Reports(beliefs, database, until_s)
        self._requests = Requests(beliefs, {**organisation.groups, **rules.at_sea})
        self._stated: list[DatedRequest] = []  # in this round
        self._stated_alone: list[DatedRequest] = []
        self._is_asked_again = False  # claims are, that were refused since their heads were there
        tbox = beliefs.model.tbox
        self._says_available, self._says_sensors = (tbox.attribute_named(a).uid for a in (AVAILABLE, SENSORS_WORK))
        self._plays_role = tbox.attribute_named(PLAYS_ROLE).uid
        self._is_misjudged = False  # before this vehicle began anew it has said that it takes no jobs
        self.attributes = self._requests.attributes | {self._says_available, self._says_sensors}
        self._patience = Patience()
        self._take_over(View.founded(organisation, rules))

    # What the vehicle acts on --------------------------------------------------------------------

    @property
    def absent(self) -> frozenset[str]:
        """Peers that are absent."""
        return self._membership.absent

    @property
    def takes_no_jobs(self) -> frozenset[str]:
        """Vehicles that take no jobs; one that is cut off still takes those that it gives itself."""
        unavailable = self.view.availability.unavailable
        return unavailable - {self._me} if self._is_out_of_reach and self.is_cut_off else unavailable

    @property
    def footing(self) -> Footing:
        """All that the work of its groups depends on."""
        if not self.is_in_doubt:
            return Footing(self.present, self.takes_no_jobs, False)
        if not self.is_cut_off:
            return Footing(self.present, self.takes_no_jobs, False, self._patience.barred)
        if not self.is_patient:
            return Footing(self.present, self.takes_no_jobs, True)
        if self.meets_unheard:
            return Footing(self.present, self.takes_no_jobs | {self._me}, True)
        return Footing(self._with_all, self.takes_no_jobs, True, self._patience.barred)

    @property
    def is_patient(self) -> bool:
        """True while it is cut off and leaves to others what it will do itself if they do not come."""
        return self.is_cut_off and self._looked_s < self._patience.ends_s

    @property
    def meets_unheard(self) -> bool:
        """True while it is patient and meets with whoever has come, heard or not."""
        return self.is_patient and self._looked_s >= self._patience.theirs_until_s

    @property
    def led(self) -> tuple[str, ...]:
        """Groups that this vehicle leads."""
        if not self._database[self._me].social_layer:
            return ()
        return tuple(group for group in self.present.groups if self._me in self.present.heads(group))

    @property
    def is_due(self) -> bool:
        """True if something was said that does not count yet."""
        return bool(self._stated or self._stated_alone or self._is_asked_again)

    @property
    def _now(self) -> Now:
        return Now(self.absent, self.takes_no_jobs, self._began_s, self._missed)

    def _take_over(self, view: View) -> None:
        """Act on a view from now on, and on who is there."""
        self.view, self.organisation = view, view.organisation
        leads_alone = self._database[self._me].social_layer
        self.present = acted_on(self.organisation, self._me, self.absent, self.is_cut_off, leads_alone)
        if self.is_cut_off:
            self._with_all = with_work(self.present, self.organisation, self.absent)

    def be_patient(self, patience: Callable[[Footing], Patience]) -> None:
        """The vehicle is in doubt, and has ``patience`` by the work of all."""
        at = self._with_all if self.is_cut_off else self.present
        self._patience = patience(Footing(at, self.takes_no_jobs, False))

    # The end of a round --------------------------------------------------------------------------

    def look_around(self, now_s: float, heard_s: Mapping[str, float], word_s: float) -> Seen | None:
        """End of a round: see who is there; None if all is as it was.

        Args:
            now_s: time of the end of the round.
            heard_s: when there was word of each peer last, or its silence meant nothing.
            word_s: when there was word of anybody last.
        """
        if now_s - self._looked_s > max(self._away_s, self.lease_s):
            self._began_s, self._was_away_s = now_s, self._looked_s
        self._looked_s = now_s
        if self._began_s > 0.0:
            missed = (name for name in self._database.names if heard_s.get(name, 0.0) <= self._was_away_s)
            self._missed = frozenset({self._me, *missed})
        changes = self._membership.look_around(now_s, heard_s, word_s)
        newest_s = max(self._began_s, max(heard_s.values(), default=0.0))
        self.is_in_doubt = self._membership.cut_off or now_s - newest_s >= DOUBT * self.lease_s
        if changes is NO_CHANGES:
            return None
        if changes.absent:
            self._is_asked_again = bool(self.view.leadership.claimed)
        was_cut_off, self.is_cut_off = self.is_cut_off, self._membership.cut_off
        facts: list[Fact] = []
        undone: View | None = None
        if self.is_cut_off and not was_cut_off:
            facts = [self._beliefs.fact(*fact) for fact in stepping_down(self._me, self.organisation, self._database)]
            if self._me not in self.view.availability.unavailable:
                self._is_out_of_reach = True
                facts.append(self._available(False))
        elif was_cut_off and not self.is_cut_off:
            undone = come_back(self.view, self._me)
            if self._is_out_of_reach:
                self._is_out_of_reach = False
                facts = [self._available(True)]
        self._take_over(undone or self.view)
        orders = [] if self.is_cut_off else self._untold()
        return Seen(changes, undone, facts, orders)

    def _untold(self) -> list[Fact]:
        """What the vehicle gave while it was cut off, of which nobody has heard: what it may still give."""
        isolated = self.view.isolated
        self.view = replace(self.view, isolated=isolated._replace(orders=()))
        facts = {order.asked: (order.fact.subject, order.fact.attribute, order.fact.value) for order in isolated.orders}
        return [fact for asked, fact in facts.items() if self._may_give(asked)]

    def _may_give(self, asked: Request) -> bool:
        """True if the others will let this vehicle give that, as far as it knows."""
        outcome = may_assign(asked, self.present, self._rules, lambda name, group: name in self.present.heads(group))
        return outcome is Outcome.SUCCESS

    def agree(self) -> View:
        """End of a round: what was said in it counts from now on."""
        before = self.organisation
        view = consult(self.view, self._stated, self._stated_alone, self._now)
        self._stated, self._stated_alone, self._is_asked_again = [], [], False
        for group, leading in view.leadership.leading.items():
            led, leads = (self._me in at.heads(group) for at in (before, view.organisation))
            if led and not leads and leading.vehicle != self._me:
                self._assents.append(self._leads(group, leading.vehicle, leading.claim.term % N_TERMS))
        self._take_over(view)
        return view

    def hear(self, changes: Iterable[Change], alone: bool) -> View | None:
        """Take note of what blocks say of the organisation, and let missions that they give to groups count at once.

        Args:
            changes: that the blocks made to the world model.
            alone: True if this vehicle states them for itself alone.

        Returns:
            The view with the missions; None if no group was given one.
        """
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
        """Take note of what a vehicle says of itself; what this one said before it began anew is over."""
        for position, fact in enumerate(block.facts):
            if fact.subject != block.origin or fact.attribute not in (self._says_available, self._says_sensors):
                continue
            availability, about = self.view.availability, (self._beliefs.name(block.origin), bool(fact.value))
            if fact.attribute == self._says_sensors:
                availability = availability.hear_of_sensors(*about, (*block.key, position))
                self.reports.note(availability.blind_since.keys())
            elif about[0] == self._me and block.epoch != self._beliefs.model.epoch:
                self._is_misjudged |= not fact.value
            else:
                availability = availability.hear(*about, (*block.key, position))
            self.view = replace(self.view, availability=availability)

    # What the vehicle states ---------------------------------------------------------------------

    def claims(self) -> list[list[Fact]]:
        """Claims to lead groups: without a head, where it is the first to succeed, or led by it in dispute.

        Who has claimed a group within a lease was there by then, whoever hears it or not. Before claims come assents to
        those of others for which this vehicle has stepped down.
        """
        assents, self._assents = self._assents, []
        if self.is_cut_off:
            return assents
        since_s, away = self._looked_s - self.lease_s, self.absent
        headed = {
            group
            for group, (_, age, name) in (self.view.leadership.leading.items() if away else ())
            if age[0] > since_s and name in away and name in self.organisation.heads(group)
        }
        claimed = claims(self.view, self._me, self.present, headed).items()
        return [*assents, *(self._leads(group, self._me, term) for group, term in claimed)]

    def _leads(self, group: str, vehicle: str, term: int) -> list[Fact]:
        """That a vehicle leads a group under a term: a claim of its own, or an assent to that of another."""
        return [self._beliefs.fact(group, HEADED_BY, vehicle), self._beliefs.fact(group, HEAD_TERM, term)]

    def _available(self, takes_jobs: bool) -> Fact:
        """Whether this vehicle takes jobs."""
        return self._beliefs.fact(self._me, AVAILABLE, takes_jobs)

    def _leaving(self, roles: Iterable[RoleAssignment]) -> list[Fact]:
        """This vehicle leaves these roles."""
        return [self._beliefs.fact(self._me, LEFT_ROLE, f"{role.group}.{role.role}") for role in roles]

    def correction(self) -> list[Fact]:
        """That this vehicle takes jobs, where others may hold what it said before it began anew; else nothing."""
        if not self._is_misjudged or self.is_cut_off:
            return []
        self._is_misjudged = False
        return [] if self._me in self.view.availability.unavailable else [self._available(True)]

    def is_said(self, facts: Iterable[Fact]) -> bool:
        """True if this vehicle has stated all of that in this round, and nothing of it otherwise since."""
        mine = (one.fact for one in self._stated if one.asked.issuer == self._me)
        last = {(fact.subject, fact.value): fact.attribute for fact in mine}
        return all(last.get((fact[0], fact[2])) == fact[1] for fact in facts)

    def in_place_of_the_absent(self, facts: Iterable[Fact]) -> list[Fact]:
        """The same facts, and before each that gives away a role held by the absent, that these leave it."""
        stated: list[Fact] = []
        for fact in facts:
            if fact[1] == self._plays_role:
                path = self._beliefs.name(fact[2])
                group, role = path.split(".")
                holders = self.organisation.members(group, role)
                specification = self.organisation.groups[group].role(role)
                if specification is not None and specification.maximum == len(holders) and self.absent >= set(holders):
                    stated += [self._beliefs.fact(name, LEFT_ROLE, path) for name in holders]
            stated.append(fact)
        return stated

    def resign(self) -> list[Fact]:
        """It leaves all roles: a vehicle that has to look after itself is of no use to its groups, now and later."""
        self._is_out_of_reach = False
        return [*self._leaving(self.organisation.roles_of(self._me)), self._available(False)]

    def give_up(self, objective: Objective, blind: bool = False) -> list[Fact]:
        """It cannot do what ``objective`` takes; empty if it has said so.

        It takes no jobs any more and leaves those that it has, but it stays with its groups. Where its sensors are to
        blame it says that, leaves the jobs that take sensors, and takes others.

        Args:
            objective: that it gives up.
            blind: True if its sensors were on for it and yielded nothing.
        """
        if objective in self._given_up:
            return []
        self._given_up.add(objective)
        if blind and self._takes_sensors(objective.group, objective.role):
            left = [
                role
                for role in self.organisation.roles_of(self._me)
                if (role.group, role.role) == (objective.group, objective.role)
                or self._takes_sensors(role.group, role.role)
            ]
            return [*self._leaving(left), self._beliefs.fact(self._me, SENSORS_WORK, False)]
        self._is_out_of_reach = False
        with_job = {(g.name, role.name) for g in self.organisation.groups.values() for role in g.roles if role.job}
        of = self.organisation.groups[objective.group].role(objective.role)
        if of is None or not of.founding:  # by its founding role it is with its group
            with_job.add((objective.group, objective.role))
        roles = [role for role in self.organisation.roles_of(self._me) if (role.group, role.role) in with_job]
        return [*self._leaving(roles), self._available(False)]

    def _takes_sensors(self, group: str, role: str) -> bool:
        of = self.organisation.groups.get(group)
        return of is not None and takes_sensors(self._rules, of, Request(self._me, Act.ASSIGN, group, role, self._me))

    def by_receiver(self, facts: Sequence[Fact], is_individual: Callable[[Objective], bool]) -> list[list[Fact]]:
        """What a plan comes down to in parts, by the vehicles that it concerns."""
        return by_receiver(facts, self._beliefs, self._requests.role_named, is_individual)

    def addressed(self, change: Change, everybody: bool) -> dict[str, set[str]]:
        """Vehicles that have to hear of a block of this vehicle's own, by name, and the roles that it gives them.

        What is said of a vehicle's roles concerns that vehicle; objectives alone concern the group.

        Args:
            change: that the block made.
            everybody: True if all members of a group have to hear of the objectives of its roles.
        """
        receivers: dict[str, set[str]] = {}
        groups: set[str] = set()
        for fact in change.block.facts:
            if (named := self._requests.role_named(fact)) is None:
                continue
            attribute, role = named
            if attribute in ROLE_ATTRIBUTES:
                roles = receivers.setdefault(self._beliefs.name(fact.subject), set())
                roles.update({role} if attribute == PLAYS_ROLE else ())
            else:
                groups.add(role.split(".")[0])
        if everybody and not receivers:
            receivers = {member: set() for group in groups for member in self.present.members(group)}
        receivers.pop(self._me, None)
        return receivers
