"""Consultation: what is said in one TDMA frame about roles and objectives counts from its end.

In a frame every vehicle has had its say, so vehicles that hear their assignments in different slots of it start
together, and none acts on half a discussion. What was said counts in the world model's order of facts, whatever the
order in which it was heard, and only if ``remoras.authority`` grants it to its issuer. For the role of a vehicle, for
an objective of a role and for the mission of a group the newest statement counts. Refused for now is what rests on news
that may still come: that the issuer led the group, or that the assignee is a member. Who holds a job, or a role with
room for few, follows from all that was said of it, see ``remoras.social.role_holders``; of a head's role absent holders
make room. A claim to lead a group whose head is there is refused, and waits; of those that count the greatest does, see
``remoras.social.leadership``. The mission of a
group counts at once: to plan it takes the rest of the frame. Of what is said of a group formed at sea its newest
formation counts, see ``remoras.social.formations``.

What a vehicle states while it is cut off counts for itself alone; ``remoras.social.isolated`` undoes it.
"""

from __future__ import annotations

from remoras.authority import NOBODY, Act, Request, Rules, may_assign
from remoras.beliefs import Beliefs
from remoras.organisation import Group, Organisation, Outcome, RoleAssignment
from remoras.social.agreed import UNCHANGED, Agreed
from remoras.social.availability import Availability
from remoras.social.formations import Formations
from remoras.social.isolated import IsolatedChanges
from remoras.social.leadership import Age, Claimed, LeadershipHistory
from remoras.social.newest import Newest
from remoras.social.requests import Requests
from remoras.social.role_holders import RoleHolders
from remoras.social.succession import Claim, Headship, excluded_by_leading, playing, role_after, yielding_above
from worldmodel import Change, Observation

MAY_COME = frozenset(
    {
        Outcome.NOT_GROUP,
        Outcome.OUTSIDE,
        Outcome.NO_AUTHORITY,
        Outcome.NOT_OF_GROUP,
        Outcome.INCOMPATIBLE,
        Outcome.EXCLUDED,
        Outcome.TERM_LEAPS,
    }
)
"""Refusals that rest on what may be heard of later."""
FOR_ALL = frozenset({Act.SUCCEED, Act.CREATE, Act.DISSOLVE})
"""Acts of which nothing comes where a vehicle states them for itself alone."""
TENABLE = frozenset({Outcome.SUCCESS, Outcome.NO_ROOM})
"""Outcomes of what counts for who holds a role, now or once there is room."""
LAWFUL = UNCHANGED | {Outcome.SUCCESS, Outcome.NO_ROOM, Outcome.UNAVAILABLE, Outcome.NOT_IN_GROUP}
"""Outcomes of requests that their issuers had the right to make."""


def _age(observation: Observation) -> Age:
    """The world model's order of facts: that of their blocks, then position."""
    return *observation.block.key, observation.position


class Consultation:
    """What one vehicle has heard and said in this round, and what counts from earlier ones.

    Args:
        beliefs: of the vehicle.
        rules: of who may change what.
        organisation: as agreed before the mission.
        availability: of all vehicles; it is read only, but for its news.
    """

    def __init__(self, beliefs: Beliefs, rules: Rules, organisation: Organisation, availability: Availability) -> None:
        self._rules = rules
        self._availability = availability
        self._groups = {**organisation.groups, **rules.at_sea}
        self.requests = Requests(beliefs, self._groups)
        self._pending: list[Observation] = []
        self._pending_alone: list[Observation] = []
        self._newest = Newest()
        self._waiting: list[Observation] = []  # refused for now
        self._is_asked_again = False
        self._plain = frozenset(name for name, data in rules.database.items() if not data.social_layer)
        self._began_s, self._missed = 0.0, NOBODY
        self._after: dict[tuple[str, str], RoleAssignment] = {}  # what heads took that stepped down
        self._came_in: dict[tuple[str, str], str] = {}  # by leading which group a vehicle came into another
        self._about: dict[str, dict[Age, Observation]] = {group: {} for group in rules.at_sea}  # heard of each
        self.isolated = IsolatedChanges()
        self._leadership = LeadershipHistory(organisation)
        self._role_holders = RoleHolders(
            rules, self._groups, organisation, self._newest, self._leadership, availability
        )
        self.formations = Formations(rules, self._leadership)
        self.headship = Headship()
        self.missions: dict[str, tuple[str, ...]] = {}
        """Missions that groups were given, by their names, in the order in which they were given last."""

    @property
    def is_due(self) -> bool:
        """True if something was said that does not count yet."""
        return bool(self._pending or self._pending_alone or self._is_asked_again)

    def miss(self) -> None:
        """Somebody is absent now: claims that were refused since their heads were there are asked again."""
        self._is_asked_again = bool(self._leadership.claimed)

    def begin_anew(self, began_s: float, missed: frozenset[str]) -> None:
        """This vehicle was away for a lease: of claims from that time it cannot say whether their heads were there.

        Args:
            began_s: until when it was away (s); missed: itself, and whom it has not heard since.
        """
        self._began_s, self._missed = began_s, missed

    @property
    def leading(self) -> dict[str, Claimed]:
        """The claim by which each group is led that somebody has claimed."""
        return self._leadership.leading

    def note(self, change: Change, alone: bool = False) -> None:
        """Keep what a block says of roles, objectives and heads until the end of the round.

        Args:
            change: that the block made to the world model.
            alone: True if this vehicle states it for itself alone, since it is cut off.
        """
        for position, fact in enumerate(change.block.facts):
            if self.requests.waits(fact):
                (self._pending_alone if alone else self._pending).append(Observation(change.block, position))

    # The end of a round --------------------------------------------------------------------------

    def end(self, agreed: Agreed) -> Agreed:
        """End of the round: what was said in it is added to what is ``agreed``, unless something newer counts."""
        organisation = agreed.organisation
        n_changes = self._leadership.n_changes
        self._is_asked_again = False
        self._leadership.miss(agreed.absent)
        pending, self._pending = sorted(self._pending, key=_age), []
        for observation in pending:
            self._count(observation, agreed)
        self._crown_all(agreed)
        for name in sorted(self._availability.news):
            for group in agreed.organisation.groups:
                self._renew(group, name, agreed)
        self._availability.news.clear()
        is_due = agreed.organisation is not organisation or self._leadership.n_changes != n_changes
        while is_due:
            n_renewed = len(agreed.formed) + len(agreed.dissolved)
            waiting, self._waiting = sorted(self._waiting, key=_age), []
            for observation in waiting:
                self._count(observation, agreed, again=True)
            is_due = len(agreed.formed) + len(agreed.dissolved) != n_renewed
            self._crown_all(agreed)
        if not self.isolated.has_changes:
            for asked in self._role_holders.waiting(agreed.organisation):
                agreed.assign(asked)
        alone, self._pending_alone = sorted(self._pending_alone, key=_age), []
        if alone:
            self._count_alone(alone, agreed)
        return agreed

    def give_missions(self, change: Change, agreed: Agreed, alone: bool = False) -> None:
        """Let the missions that a block gives to groups count, at once.

        Args:
            change: that the block made to the world model.
            agreed: what counts so far; what becomes of the missions is added.
            alone: True if this vehicle states it for itself alone, since it is cut off.
        """
        for position, fact in enumerate(change.block.facts):
            if self.requests.gives_mission(fact):
                said = Observation(change.block, position)
                if not self.formations.may_come(self.requests.of(said).group, agreed):
                    self._count(said, agreed, alone)
                    if alone:
                        self.isolated.give(self.requests.of(said), fact)
                elif not alone:
                    self._pending.append(said)

    # What members say ----------------------------------------------------------------------------

    def _count(self, observation: Observation, agreed: Agreed, alone: bool = False, again: bool = False) -> None:
        """Let a statement count if its issuer may make it and nothing newer counts.

        Args:
            observation: the statement.
            agreed: what counts so far.
            alone: True if the vehicle states it for itself alone: then it leads its groups itself.
            again: True if it was refused before.
        """
        asked, age = self.requests.of(observation), _age(observation)
        if asked.act in (Act.CREATE, Act.DISSOLVE):
            outcome = self.formations.settle(asked, self.requests.formation(observation), age, agreed)
            if outcome is Outcome.SUCCESS:
                self._begin(asked.group, age)
            elif outcome is not None:
                self._refuse(asked, outcome, observation, agreed, True, again)
            return
        if self.formations.is_of_earlier(asked.group, age) or self._assent(asked, observation, age, alone):
            return
        if asked.group in self._about:
            self._about[asked.group].setdefault(age, observation)
        is_old = asked.act is not Act.SUCCEED and not alone and self._newest.get(asked.about, age) > age
        is_limited = not alone and self._role_holders.is_about(asked)
        if is_old and not is_limited:
            return

        def led(vehicle: str, group: str) -> bool:
            return agreed.organisation.is_member(vehicle, group) if alone else self._leadership.led(vehicle, group, age)

        yielding = agreed.absent | self._role_holders.yielding(asked, age, agreed.organisation)
        unavailable = NOBODY if is_limited else agreed.unavailable  # role holders know who took jobs when
        organisation = agreed.organisation
        if asked.act is Act.SUCCEED:
            succession = self._groups[asked.group].succession
            left = [
                successor for successor in succession if self._newest.at(asked.group, successor, asked.issuer) > age
            ]
            if not left and self._leadership.has_led(asked.issuer, asked.group, age):
                left = [self._groups[asked.group].head_role or ""]
            organisation = playing(organisation, asked.issuer, asked.group, left)
        outcome = may_assign(asked, organisation, self._rules, led, yielding, unavailable)
        if outcome not in LAWFUL:
            self._refuse(asked, outcome, observation, agreed, not alone, again or is_old)
        elif asked.act is Act.SUCCEED:
            self._succeed(asked, observation, agreed, again)
        else:
            if is_limited and outcome in TENABLE:
                self._hold(asked, age, agreed)
            if not alone and not is_old:
                self._newest[asked.about] = age
            if not is_old and not (is_limited and outcome in TENABLE):
                self._take(asked, outcome, age, agreed, yielding)

    def _begin(self, group: str, age: Age) -> None:
        """A group was formed or dissolved: what was said of it before is over, what was said since is asked anew."""
        self._newest.forget(group)
        self._about[group] = {said: one for said, one in self._about[group].items() if said > age}
        others = [observation for observation in self._waiting if _age(observation) not in self._about[group]]
        self._waiting = [*others, *self._about[group].values()]
        self.headship.forget(group)
        self.missions.pop(group, None)
        self.isolated.forget(group)
        self._role_holders.forget(group)

    def _refuse(self, asked: Request, why: Outcome, said: Observation, agreed: Agreed, wait: bool, again: bool) -> None:
        """Reject a statement, temporarily if ``wait``; noted unless it is rejected ``again``."""
        if why in MAY_COME and wait:
            self._waiting.append(said)
        if asked.act is Act.SUCCEED and why is Outcome.OUTSIDE and (claim := self._claim_of(said, asked)) is not None:
            self.headship.note(asked.group, claim)
        if not again:
            agreed.refuse(asked, why, said)

    def _take(self, asked: Request, outcome: Outcome, age: Age, agreed: Agreed, yielding: frozenset[str]) -> None:
        """Do what was asked, or note why it is refused; where there is no room, in the place of who is ``yielding``."""
        if outcome is not Outcome.SUCCESS:
            agreed.note(asked, outcome)
        elif not asked.assignee:
            agreed.give(asked)
            if asked.act is Act.MISSION:
                given, of = {*self.missions.get(asked.group, ()), asked.argument}, asked.group
                self.missions[of] = tuple(
                    sorted(given, key=lambda objective: self._newest.at(of, "mission", objective))
                )
        else:
            done = agreed.assign(asked, yielding) if asked.act is Act.ASSIGN else agreed.leave(asked)
            if done is Outcome.SUCCESS and self._is_head(asked):
                self._leadership.change(asked.group, asked.assignee, asked.act is Act.ASSIGN, age)

    def _hold(self, asked: Request, age: Age, agreed: Agreed) -> None:
        """Settle who holds a role of limited size."""
        follows, refused = self._role_holders.settle(asked, age, agreed.organisation, agreed.absent)
        for request in follows:
            done = agreed.assign(request) if request.act is Act.ASSIGN else agreed.leave(request)
            if done is Outcome.SUCCESS and self._is_head(request) and request.about == asked.about:
                self._leadership.change(request.group, request.assignee, request.act is Act.ASSIGN, age)
        if refused is not None:
            agreed.note(asked, refused)
        elif not follows and not agreed.organisation.is_member(asked.assignee, asked.group):
            agreed.note(asked, Outcome.NOT_IN_GROUP)

    def _is_head(self, asked: Request) -> bool:
        """True if the role is that of the head of its group."""
        return asked.role == self._groups[asked.group].head_role

    # Claims --------------------------------------------------------------------------------------

    def _claim_of(self, said: Observation, asked: Request) -> Claim | None:
        """The claim that a statement makes or assents to; None if it says no term, or one that leaps."""
        claim = self.requests.claim(said)
        return None if claim is None else self.headship.read(asked.group, claim)

    def _assent(self, asked: Request, said: Observation, age: Age, alone: bool) -> bool:
        """True if a head says that another leads its group, so that it leads it no longer itself.

        If it leaves its role that is still to be done; it ends its lead though another may have its place by now.
        """
        if asked.act is Act.RELEASE and asked.issuer == asked.assignee and self._is_head(asked) and not alone:
            self._leadership.change(asked.group, asked.issuer, False, age)
        if asked.act is not Act.SUCCEED or asked.issuer == asked.assignee or self._claim_of(said, asked) is None:
            return False
        self._leadership.change(asked.group, asked.issuer, False, age, asked.assignee)
        return self._leadership.has_claimed(asked.issuer, asked.group)

    def _succeed(self, asked: Request, said: Observation, agreed: Agreed, again: bool) -> None:
        """Take note of a claim to lead a group: the greatest that counts makes its vehicle the head."""
        if self.requests.claim(said) is None:
            agreed.refuse(asked, Outcome.NO_AUTHORITY, said)
            return
        claim = self._claim_of(said, asked)
        if claim is None:
            self._refuse(asked, Outcome.TERM_LEAPS, said, agreed, True, again)
            return
        age = _age(said)
        excused = agreed.absent | self._plain | (self._missed if age[0] < self._began_s else NOBODY)
        self.headship.note(asked.group, claim)
        claimed = Claimed(claim, age, asked.assignee)
        if not self._leadership.claim(asked.group, claimed, excused, self._by_leading(asked, agreed.organisation)):
            why = Outcome.HEAD_PRESENT if self._leadership.is_member(asked.group, claimed) else Outcome.OUTSIDE
            self._refuse(asked, why, said, agreed, True, again)
        self._crown(asked.group, agreed)
        self._renew(asked.group, asked.assignee, agreed)  # it led for a while, if not now

    def _by_leading(self, asked: Request, organisation: Organisation) -> str | None:
        """The group by whose lead alone a vehicle is a member of the one that it claims; None if it is one anyway."""
        roles = organisation.roles_of(asked.assignee, asked.group)
        if all(self._leadership.is_claim(self._newest.at(asked.group, one.role, one.vehicle)) for one in roles):
            return self._came_in.get((asked.group, asked.assignee))
        return None

    def _crown_all(self, agreed: Agreed) -> None:
        """Let the claims that count now say who leads."""
        for group in self._leadership.claimed:
            self._crown(group, agreed)

    def _crown(self, group: str, agreed: Agreed) -> None:
        """Let whoever has made the greatest claim that counts lead a group; if none counts any more, who led before."""
        leading, of = self.leading.get(group), self._groups[group]
        if not self.headship.lead(group, None if leading is None else leading.claim):
            return
        if leading is not None:
            head, since = leading.vehicle, leading.since
        elif (before := self._leadership.without_claims(group)) is not None:
            head, since = before
        else:
            return
        self._enthrone(Request(head, Act.SUCCEED, group, of.head_role or "", head), of, since, agreed)
        self._renew(group, head, agreed)

    def _enthrone(self, asked: Request, group: Group, age: Age, agreed: Agreed) -> None:
        """Let the issuer lead a group, and play what its role takes in the group above; whoever led steps down.

        What it took when it stepped down before it leaves, so that it plays the same for who never heard of that.
        """
        vehicle = asked.assignee
        before = [name for name in agreed.organisation.heads(group.name) if name != vehicle]
        self._hand_over(asked, before, age, agreed)
        role = group.role(asked.role)
        if role is not None and role.played_by is not None:
            of_group, other = role.played_by
            if self._rules.database[vehicle].can_play(of_group, other):
                led = [name for name in self._rules.database.names if self._leadership.has_led(name, group.name, age)]
                if not agreed.organisation.is_member(vehicle, of_group):
                    self._came_in[of_group, vehicle] = group.name
                holders = yielding_above(self._groups[of_group], other, {*before, *led}, agreed.organisation)
                self._hand_over(Request(vehicle, Act.SUCCEED, of_group, other, vehicle), holders, age, agreed)
        for name in before:
            then = role_after(self._rules.database, name, group, agreed.organisation)
            if then is not None and self._newest.take((then.group, then.role, then.vehicle), age):
                self._after[group.name, name] = then
                agreed.assign(Request(vehicle, Act.ASSIGN, then.group, then.role, then.vehicle))
        then = self._after.pop((group.name, vehicle), None)
        if then is not None and self._leadership.is_claim(self._newest.at(then.group, then.role, vehicle)):
            self._newest[then.group, then.role, vehicle] = age
            agreed.leave(Request(vehicle, Act.RELEASE, then.group, then.role, vehicle))
        for assignment in excluded_by_leading(group, vehicle, agreed.organisation):
            if self._newest.take((assignment.group, assignment.role, assignment.vehicle), age):
                agreed.leave(Request(vehicle, Act.RELEASE, assignment.group, assignment.role, vehicle))

    def _renew(self, group: str, issuer: str, agreed: Agreed) -> None:
        """Let who holds the jobs of a group follow from all that was said of them, now that more is known."""
        for request in self._role_holders.renew(group, issuer, agreed.organisation):
            (agreed.assign if request.act is Act.ASSIGN else agreed.leave)(request)

    def _hand_over(self, to: Request, holders: list[str] | tuple[str, ...], age: Age, agreed: Agreed) -> None:
        """Let holders leave a role for another, unless a newer word says something else of one of them."""
        for name in (*holders, to.assignee):
            if self._leadership.is_claim(self._newest.at(to.group, to.role, name)):
                self._newest[to.group, to.role, name] = age  # it has or lacks the role by a lesser claim
        for name in holders:
            if name != to.assignee and self._newest.take((to.group, to.role, name), age):
                agreed.leave(Request(to.issuer, Act.RELEASE, to.group, to.role, name))
        if self._newest.take(to.about, age):
            agreed.assign(to)

    # Cut off -------------------------------------------------------------------------------------

    def _count_alone(self, pending: list[Observation], agreed: Agreed) -> None:
        """Let what the vehicle states for itself alone count, and note what is to be undone."""
        n_assigned, n_left = len(agreed.assigned), len(agreed.left)
        for observation in pending:
            asked = self.requests.of(observation)
            if asked.act not in FOR_ALL:
                self._count(observation, agreed, alone=True)
                self.isolated.give(asked, observation.fact)
        self.isolated.note(agreed, n_assigned, n_left)
