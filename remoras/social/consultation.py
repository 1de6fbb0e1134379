"""Consultation: requests about roles and objectives take effect at the end of their frame.

In a TDMA frame every vehicle transmits once, so vehicles assigned in different slots start together. Requests take
effect in the world model's order of facts, not in the order of reception, and only if ``remoras.authority`` permits
them; the newest one about a subject is valid. Missions take effect at once: planning them takes the rest of the frame.
Requests are deferred while facts may still arrive that permit them: leadership, membership, absence of a leader.

A formation of a group at run time has a number, one more than the last; its dissolution has the same. The greatest one
received is valid, of equal ones that of the lowest node. Requests older than the newest formation are ignored.

Requests of an isolated vehicle take effect for that vehicle alone. When it reconnects, it undoes its role changes and
sends the objectives and missions that it gave.

Holders of a role with a job or a limited number of holders are a function of all valid instructions, in any order of
reception (``holders_after``). Where only leaders assign jobs, their assignment displaces holders from before their term
or restart, since the leader may not know the earlier assignment.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace

from remoras.authority import NOBODY, Act, Request, may_assign
from remoras.organisation import Group, Organisation, Outcome, RoleKey
from remoras.organisation.leadership import (
    Age,
    Claim,
    Claimed,
    excluded_by_leading,
    next_term,
    playing,
    read_claim,
    role_after,
    successor,
    yielding_above,
)  # fmt: skip
from remoras.social.view import (
    NEVER,
    UNCHANGED,
    DatedRequest,
    Formation,
    Holding,
    Instruction,
    Isolated,
    Now,
    View,
)

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
"""Refusals that facts received later may revert."""
FOR_ALL = frozenset({Act.SUCCEED, Act.CREATE, Act.DISSOLVE})
"""Acts without effect if an isolated vehicle states them for itself."""
TENABLE = frozenset({Outcome.SUCCESS, Outcome.NO_ROOM})
"""Outcomes that count for the holders of a role, at once or after a vacancy."""
LAWFUL = UNCHANGED | {Outcome.SUCCESS, Outcome.NO_ROOM, Outcome.UNAVAILABLE, Outcome.NOT_IN_GROUP}
"""Outcomes of requests that their issuers are authorised to make."""


# From one view to the next ------------------------------------------------------------------------


def consult(before: View, stated: Iterable[DatedRequest], alone: Collection[DatedRequest], now: Now) -> View:
    """Apply the requests of a round, and own ones for this isolated vehicle ``alone``."""
    leadership = before.leadership.miss(now.absent)
    view = replace(before, leadership=leadership, now=now, rulings=(), unlawful=frozenset())
    for request in _in_order(stated):
        view = _count(view, request)
    view = _crown_all(view)
    for name in sorted(view.availability.news):
        for group in view.organisation.groups:
            view = renew(view, group, name)
    if view.availability.news:
        view = replace(view, availability=replace(view.availability, news=NOBODY))
    is_due = view.organisation is not before.organisation or view.leadership is not before.leadership
    # The changes may permit deferred requests; only a new formation permits more of them after that.
    while is_due:
        formations, waiting = view.formations, _in_order(view.waiting.values())
        view = replace(view, waiting={})
        for request in waiting:
            view = _count(view, request, again=True)
        is_due = view.formations is not formations
        view = _crown_all(view)
    if not (view.isolated.taken or view.isolated.displaced):
        view = let_in(view)
    return _count_alone(view, alone) if alone else view


def give_missions(before: View, stated: Iterable[DatedRequest], alone: bool, now: Now) -> View:
    """Apply missions given to groups, at once; arguments as in ``consult``."""
    view = replace(before, now=now, rulings=(), unlawful=frozenset())
    for request in stated:
        view = _count(view, request, alone)
        view = _kept(view, request) if alone else view
    return view


def come_back(before: View, me: str) -> View:
    """Undo the role changes that ``me`` made while isolated."""
    isolated = Isolated(orders=before.isolated.orders)
    view = replace(before, now=Now(), rulings=(), unlawful=frozenset(), isolated=isolated)
    for role in before.isolated.taken:
        view = view.leave(Request(me, Act.RELEASE, role.group, role.role, role.vehicle))
    for role in before.isolated.displaced:
        view = view.assign(Request(me, Act.ASSIGN, role.group, role.role, role.vehicle))
    return view


def _in_order(stated: Iterable[DatedRequest]) -> list[DatedRequest]:
    by_age = {request.age: request for request in stated}
    return [by_age[age] for age in sorted(by_age)]


def _count_alone(before: View, stated: Iterable[DatedRequest]) -> View:
    view = before
    for request in _in_order(stated):
        if request.asked.act not in FOR_ALL:
            view = _kept(_count(view, request, alone=True), request)
    taken, displaced, orders = view.isolated
    n_assigned, n_left = len(before.assigned), len(before.left)
    left = view.left[n_left:]
    displaced = tuple(dict.fromkeys([*displaced, *(role for role in left if role not in taken)]))
    taken = tuple(dict.fromkeys([*(role for role in taken if role not in left), *view.assigned[n_assigned:]]))
    return replace(view, isolated=Isolated(taken, displaced, orders))


def _kept(view: View, request: DatedRequest) -> View:
    if request.asked.assignee:
        return view
    return replace(view, isolated=view.isolated._replace(orders=(*view.isolated.orders, request)))


# Requests of members ------------------------------------------------------------------------------


def _count(view: View, request: DatedRequest, alone: bool = False, again: bool = False) -> View:
    """Apply a request if its issuer is authorised (or ``alone``) and no newer one is valid."""
    age, asked = request.age, request.asked
    if asked.act in (Act.CREATE, Act.DISSOLVE):
        return _form(view, request, again)
    if age < view.formations.get(asked.group, NEVER).since:
        return view  # it refers to an earlier formation
    if asked.act in (Act.RELEASE, Act.SUCCEED):
        view, is_assent = _assent(view, request, alone)
        if is_assent:
            return view
    if asked.group in view.rules.at_sea:
        view = replace(view, at_sea={**view.at_sea, age: request})
    is_old = asked.act is not Act.SUCCEED and not alone and view.newest.get(asked.about, age) > age
    is_of_few = not alone and is_limited(view, asked)
    if is_old and not is_of_few:
        return view

    def led(vehicle: str, group: str) -> bool:
        return view.organisation.is_member(vehicle, group) if alone else view.leadership.led(vehicle, group, age)

    yielding = view.now.absent | yielding_to(view, asked, age)
    unavailable = NOBODY if is_of_few else view.now.unavailable  # ``settle`` asks who took jobs when
    organisation = view.organisation
    if asked.act is Act.SUCCEED:
        group = view.group(asked.group)
        left = [role for role in group.succession if view.stated(asked.group, role, asked.issuer) > age]
        if not left and view.leadership.has_led(asked.issuer, asked.group, age):
            left = [group.head_role or ""]
        organisation = playing(organisation, asked.issuer, asked.group, left)
    outcome = may_assign(asked, organisation, view.rules, led, yielding, unavailable)
    if outcome not in LAWFUL:
        return _refused(view, request, outcome, not alone, again or is_old)
    if asked.act is Act.SUCCEED:
        return _succeed(view, request, again)
    is_settled = is_of_few and outcome in TENABLE
    if is_settled:
        view = settle(view, asked, age)
    if not alone and not is_old:
        view = replace(view, newest={**view.newest, asked.about: age})
    return view if is_old or is_settled else _take(view, asked, outcome, age, yielding)


def _refused(view: View, request: DatedRequest, why: Outcome, wait: bool, again: bool) -> View:
    if why in MAY_COME and wait:
        view = replace(view, waiting={**view.waiting, request.age: request})
    if request.asked.act is Act.SUCCEED and why is Outcome.OUTSIDE and (claim := _claim_of(view, request)) is not None:
        view = _known(view, request.asked.group, claim)
    return view if again else view.refuse(request, why)


def _take(view: View, asked: Request, outcome: Outcome, age: Age, yielding: frozenset[str]) -> View:
    if outcome is Outcome.SUCCESS and asked.assignee:
        return view.do(asked, age, yielding)
    if outcome is Outcome.SUCCESS and asked.act is Act.MISSION:
        group = asked.group
        missions = {*view.missions.get(group, ()), asked.argument}
        in_order = tuple(sorted(missions, key=lambda mission: view.stated(group, "mission", mission)))
        return replace(view, missions={**view.missions, group: in_order}).note(asked, outcome)
    return view.note(asked, outcome)


# Groups at sea ------------------------------------------------------------------------------------


def _form(view: View, request: DatedRequest, again: bool) -> View:
    """Form or dissolve a group, unless unauthorised or superseded; earlier requests become void."""
    age, asked, number = request.age, request.asked, request.number
    is_over, name, rules = asked.act is Act.DISSOLVE, asked.group, view.rules
    rank = 0 if is_over else -rules.database[asked.issuer].node
    formation, organisation = Formation(number or 0, is_over, rank, age), view.organisation
    if number is not None and formation[:3] <= view.formations.get(name, NEVER)[:3]:
        return view
    if not is_over and name in rules.at_sea:
        organisation = organisation.without_group(name)
    leadership = view.leadership
    outcome = may_assign(asked, organisation, rules, lambda v, group: leadership.led(v, group, age))
    if outcome is not Outcome.SUCCESS or number is None:
        return _refused(view, request, Outcome.NO_AUTHORITY if number is None else outcome, True, again)
    leadership = leadership.begin(name, None if is_over else asked.assignee, age)
    view = replace(view, formations={**view.formations, name: formation}, leadership=leadership)
    if name in view.organisation.groups:
        for role in [role for v in view.organisation.members(name) for role in view.organisation.roles_of(v, name)]:
            view = view.leave(Request(asked.issuer, Act.RELEASE, name, role.role, role.vehicle))
        view = replace(view, organisation=view.organisation.without_group(name))
        view = view.note(replace(asked, act=Act.DISSOLVE), Outcome.SUCCESS)
    if not is_over:
        view = replace(view, organisation=view.organisation.form(rules.at_sea[name])).note(asked, outcome)
        view = view.assign(replace(asked, act=Act.ASSIGN))
    # Requests about the new formation may have been received before it: they are evaluated again.
    since = {age_of: other for age_of, other in view.at_sea.items() if other.asked.group != name or age_of > age}
    isolated = view.isolated
    return replace(
        view,
        newest={subject: age_of for subject, age_of in view.newest.items() if subject[0] != name},
        holdings={place: holding for place, holding in view.holdings.items() if place[0] != name},
        missions={group: missions for group, missions in view.missions.items() if group != name},
        at_sea=since,
        waiting={**view.waiting, **{age_of: other for age_of, other in since.items() if other.asked.group == name}},
        greatest={group: claim for group, claim in view.greatest.items() if group != name},
        crowned={group: claim for group, claim in view.crowned.items() if group != name},
        isolated=Isolated(
            tuple(role for role in isolated.taken if role.group != name),
            tuple(role for role in isolated.displaced if role.group != name),
            tuple(order for order in isolated.orders if order.asked.group != name),
        ),
    )


# Claims -------------------------------------------------------------------------------------------


def _claim_of(view: View, request: DatedRequest) -> Claim | None:
    if request.number is None:
        return None
    return read_claim(Claim(request.number, -request.fact.target), view.greatest.get(request.asked.group))


def _known(view: View, group: str, claim: Claim) -> View:
    # Valid or not: its issuer and its first receivers may act on it.
    return replace(view, greatest={**view.greatest, group: max(claim, view.greatest.get(group, claim))})


def _assent(view: View, request: DatedRequest, alone: bool) -> tuple[View, bool]:
    """End the term of a leader that leaves its role or acknowledges another; True of the latter."""
    asked, age, leadership = request.asked, request.age, view.leadership
    if asked.act is Act.RELEASE:
        if asked.issuer == asked.assignee and view.is_head(asked) and not alone:
            view = replace(view, leadership=leadership.change(asked.group, asked.issuer, False, age))
        return view, False
    if asked.issuer == asked.assignee or _claim_of(view, request) is None:
        return view, False
    leadership = leadership.change(asked.group, asked.issuer, False, age, asked.assignee)
    return replace(view, leadership=leadership), leadership.has_claimed(asked.issuer, asked.group)


def _succeed(view: View, request: DatedRequest, again: bool) -> View:
    """Record a leadership claim; the greatest valid claim makes its vehicle the leader."""
    asked, age, now = request.asked, request.age, view.now
    if request.number is None:
        return view.refuse(request, Outcome.NO_AUTHORITY)
    claim = _claim_of(view, request)
    if claim is None:
        return _refused(view, request, Outcome.TERM_LEAPS, True, again)
    # Vehicles without a social layer never lead, so they block no claim. Before ``began_s`` this vehicle was away and
    # cannot judge who was present.
    plain = frozenset(name for name, data in view.rules.database.items() if not data.social_layer)
    excused = now.absent | plain | (now.missed if age[0] < now.began_s else NOBODY)
    claimed = Claimed(claim, age, asked.assignee)
    leadership = view.leadership.claim(asked.group, claimed, excused, _by_leading(view, asked))
    view = replace(_known(view, asked.group, claim), leadership=leadership)
    if not leadership.counts(asked.group, claimed):
        why = Outcome.HEAD_PRESENT if leadership.is_member(asked.group, claimed) else Outcome.OUTSIDE
        view = view if again else view.refuse(request, why)  # leadership keeps the claim, and judges it again
    return renew(_crown(view, asked.group), asked.group, asked.assignee)  # it led for some time, even if not now


def _by_leading(view: View, asked: Request) -> str | None:
    """Return the group through whose leadership alone the claimant is a member; None if none."""
    roles = view.organisation.roles_of(asked.assignee, asked.group)
    if all(view.leadership.is_claim(view.stated(asked.group, role.role, role.vehicle)) for role in roles):
        return view.came_in.get((asked.group, asked.assignee))
    return None


def _crown_all(view: View) -> View:
    for group in view.leadership.claimed:
        view = _crown(view, group)
    return view


def _crown(view: View, group: str) -> View:
    """Install the vehicle of the greatest valid claim; without one, restore the previous leader."""
    leading = view.leadership.leading.get(group)
    claim = None if leading is None else leading.claim
    if claim == view.crowned.get(group):
        return view
    view = replace(view, crowned={**view.crowned, group: claim})
    head = view.leadership.without_claims(group) if leading is None else (leading.vehicle, leading.since)
    return view if head is None else renew(_enthrone(view, view.group(group), *head), group, head[0])


def _enthrone(view: View, group: Group, vehicle: str, age: Age) -> View:
    """Make a vehicle the leader, also in the role of the group above that its role requires."""
    # The previous leader takes a role of the succession.
    database, head_role = view.rules.database, group.head_role or ""
    before = [name for name in view.organisation.heads(group.name) if name != vehicle]
    view = _hand_over(view, Request(vehicle, Act.SUCCEED, group.name, head_role, vehicle), before, age)
    role = group.role(head_role)
    if role is not None and role.played_by is not None and database[vehicle].can_play(*role.played_by):
        above, other = role.played_by
        led = [name for name in database.names if view.leadership.has_led(name, group.name, age)]
        if not view.organisation.is_member(vehicle, above):
            view = replace(view, came_in={**view.came_in, (above, vehicle): group.name})
        holders = yielding_above(view.group(above), other, {*before, *led}, view.organisation)
        view = _hand_over(view, Request(vehicle, Act.SUCCEED, above, other, vehicle), holders, age)
    for name in before:
        next_role = role_after(database, name, group, view.organisation)
        if next_role is not None:
            after = view.overrule(Request(vehicle, Act.ASSIGN, next_role.group, next_role.role, next_role.vehicle), age)
            stepped_down = {**view.stepped_down, (group.name, name): next_role}
            view = view if after is view else replace(after, stepped_down=stepped_down)
    # It leaves the role that it took when stepping down earlier: vehicles that missed that step must obtain the same
    # organisation.
    next_role = view.stepped_down.get((group.name, vehicle))
    if next_role is not None:
        stepped_down = {place: role for place, role in view.stepped_down.items() if place != (group.name, vehicle)}
        view = replace(view, stepped_down=stepped_down)
        leaves = Request(vehicle, Act.RELEASE, next_role.group, next_role.role, vehicle)
        if view.leadership.is_claim(view.stated(*leaves.about)):
            view = replace(view, newest={**view.newest, leaves.about: age}).leave(leaves)
    for excluded in excluded_by_leading(group, vehicle, view.organisation):
        view = view.overrule(Request(vehicle, Act.RELEASE, excluded.group, excluded.role, vehicle), age)
    return view


def _hand_over(view: View, to: Request, holders: Collection[str], age: Age) -> View:
    newest = dict(view.newest)
    for name in (*holders, to.assignee):
        if view.leadership.is_claim(view.stated(to.group, to.role, name)):
            newest[to.group, to.role, name] = age  # a lesser claim gave or took the role
    view = replace(view, newest=newest)
    for name in holders:
        if name != to.assignee:
            view = view.overrule(Request(to.issuer, Act.RELEASE, to.group, to.role, name), age)
    return view.overrule(to, age)


def claims(view: View, me: str, present: Organisation, headed: Collection[str] = ()) -> dict[str, int]:
    """Return the groups that a vehicle claims to lead, each with the encoded term of the claim.

    It claims where no leader is present and it is first in the succession, or where a greater claim disputes its lead.
    ``present`` lacks absent vehicles; ``headed`` are groups with a present leader that ``present`` lacks.
    """
    database, claimed = view.rules.database, dict[str, int]()
    for group in present.groups.values():
        if not group.succession or group.name in headed or not present.is_member(me, group.name):
            continue
        heads = [name for name in present.heads(group.name) if database[name].social_layer]
        if me in heads:
            leads = view.greatest.get(group.name) != view.crowned.get(group.name)  # a greater claim is not valid
        else:
            leads = not heads and successor(group, present, database, view.availability.unavailable) == me
        if leads:
            claimed[group.name] = next_term(view.greatest.get(group.name))
    return claimed


# Holders of roles ---------------------------------------------------------------------------------


def holders_after(
    instructions: Iterable[Instruction],
    room: float,
    led_since: Callable[[Instruction], Age | None] = lambda instruction: None,
) -> tuple[set[str], list[str]]:
    """Return holders after all instructions, and waiting vehicles, newest first.

    An assignment gets a vacancy or waits; when a holder leaves, the newest waiting vehicle is admitted. ``led_since``
    gives the start of the term of an instruction's leader, which displaces earlier holders; None without one.
    """
    holders: dict[str, bool] = {}  # True: admitted from the waiting vehicles
    waiting: dict[str, Age] = {}
    given_at: dict[str, Age] = {}
    for instruction in sorted(instructions):
        age, gives, name = instruction
        waiting.pop(name, None)
        if gives:
            since = led_since(instruction)
            given_at[name] = age
            let_in = [holder for holder, was_let_in in holders.items() if was_let_in and holder != name]
            if name in holders or len(holders) < room:
                holders[name] = False
            elif let_in:
                # An admission is provisional: a later assignment displaces it, back to the waiting vehicles.
                del holders[let_in[0]]
                waiting[let_in[0]] = given_at[let_in[0]]
                holders[name] = False
            elif since is not None and all(
                given_at[holder] < since or is_of_earlier_life(given_at[holder], age) for holder in holders
            ):
                holders = {name: False}
            else:
                waiting[name] = age
        elif holders.pop(name, None) is not None and waiting:
            newest = max(waiting, key=lambda vehicle: waiting[vehicle])
            del waiting[newest]
            holders[newest] = True
    return set(holders), sorted(waiting, key=lambda vehicle: waiting[vehicle], reverse=True)


def is_of_earlier_life(before: Age, after: Age) -> bool:
    """Return whether the issuer has restarted since ``before`` and may not remember it."""
    return before[1] == after[1] and before[2] < after[2]


def is_limited(view: View, asked: Request) -> bool:
    """Return whether a request concerns a role with a job or a limited number of holders."""
    group = view.group(asked.group)
    # No vehicle waits for the leader's role of a group with a succession: the successor claims it.
    is_claimed = asked.role == group.head_role and bool(group.succession)
    if asked.act not in (Act.ASSIGN, Act.RELEASE) or is_claimed:
        return False
    role = group.role(asked.role)
    return role is not None and (role.maximum is not None or role.job is not None)


def yielding_to(view: View, asked: Request, age: Age) -> frozenset[str]:
    """Return the holders assigned before the issuer's term, which its assignment displaces."""
    since = _led_since(view, asked, age)
    if since is None:
        return NOBODY
    holders = view.organisation.members(asked.group, asked.role)
    return frozenset(name for name in holders if view.stated(asked.group, asked.role, name) < since)


def settle(view: View, asked: Request, age: Age) -> View:
    """Add a request to its role, apply the resulting holders; note why an assignee is not one."""
    place = asked.group, asked.role
    holding, gives = _reconciled(view, place), asked.act is Act.ASSIGN
    stands = not _has_job(view, place) or _stands(view, asked, age)
    instructions, holders = dict(holding.instructions), holding.holders
    is_full = len(holders) >= _room(view, place) and asked.assignee not in holders
    if gives and stands and is_full and view.rules.authorities and holders <= view.now.absent:  # else leaders do
        for name in holders:
            instructions[Instruction(age, False, name)] = Request(asked.issuer, Act.RELEASE, *place, name)
    instructions[Instruction(age, gives, asked.assignee)] = asked
    view, follows, waiting = _follow(view, place, holding._replace(instructions=instructions), asked.issuer)
    for request in follows:
        view = view.do(request, age if request.about == asked.about else None)
    if asked.assignee in waiting:
        return view.note(asked, Outcome.NO_ROOM)
    if not stands:
        return view.note(asked, Outcome.UNAVAILABLE)
    is_outside = not follows and not view.organisation.is_member(asked.assignee, asked.group)
    return view.note(asked, Outcome.NOT_IN_GROUP) if is_outside else view


def renew(view: View, group: str, issuer: str) -> View:
    """Recompute holders of jobs after ``issuer`` claimed to lead, or changed its availability."""
    jobs = {role.name for role in view.group(group).roles if role.job is not None}
    follows: list[Request] = []
    for place in [place for place in view.holdings if place[0] == group and place[1] in jobs]:
        view, more, _ = _follow(view, place, _reconciled(view, place), issuer)
        follows += more
    for request in follows:
        view = view.do(request)
    return view


def let_in(view: View) -> View:
    """Admit waiting vehicles to vacancies, newest first; absent holders may be displaced."""
    follows: list[Request] = []
    for place in sorted(place for place, holding in view.holdings.items() if holding.is_crowded):
        holding = _reconciled(view, place)
        view = replace(view, holdings={**view.holdings, place: holding})
        n_free = math.inf if view.rules.authorities else _room(view, place) - len(holding.holders)
        waiting = _after(view, place, holding.instructions)[1]
        follows += [_last_given(holding, name) for number, name in enumerate(waiting) if number < n_free]
    for request in follows:
        view = view.assign(request)
    return view


def _follow(view: View, place: RoleKey, holding: Holding, issuer: str) -> tuple[View, list[Request], list[str]]:
    """Return the view with new holders of a role, the requests for them, and waiting vehicles."""
    holders, waiting = _after(view, place, holding.instructions)
    after = Holding(holding.instructions, frozenset(holders), bool(waiting))
    follows = [Request(issuer, Act.RELEASE, *place, name) for name in sorted(holding.holders - holders)]
    follows += [_last_given(holding, name) for name in sorted(holders - holding.holders)]
    return replace(view, holdings={**view.holdings, place: after}), follows, waiting


def _after(view: View, place: RoleKey, instructions: Mapping[Instruction, Request]) -> tuple[set[str], list[str]]:
    if not _has_job(view, place):
        return holders_after(instructions, _room(view, place))
    counting = [instruction for instruction, asked in instructions.items() if _stands(view, asked, instruction.age)]
    return holders_after(counting, _room(view, place), lambda last: _led_since(view, instructions[last], last.age))


def _stands(view: View, asked: Request, age: Age) -> bool:
    """Return whether an instruction about a job holds: its issuer led then, and the assignee took jobs."""
    if _is_for_heads(view, asked) and not view.leadership.led(asked.issuer, asked.group, age):
        return False
    return asked.act is not Act.ASSIGN or view.availability.takes(asked, view.group(asked.group), age, view.rules)


def _led_since(view: View, asked: Request, age: Age) -> Age | None:
    """Return the start of the issuer's term, where only leaders assign the role; else None."""
    is_order = asked.act is Act.ASSIGN and _is_for_heads(view, asked) and _has_job(view, (asked.group, asked.role))
    return view.leadership.since(asked.issuer, asked.group, age) if is_order else None


def _is_for_heads(view: View, asked: Request) -> bool:
    is_own = asked.issuer in ("", asked.assignee) and asked.act is Act.RELEASE
    return bool(asked.issuer and not is_own and not view.rules.authorities)


def _has_job(view: View, place: RoleKey) -> bool:
    role = view.group(place[0]).role(place[1])
    return role is not None and role.job is not None


def _room(view: View, place: RoleKey) -> float:
    role = view.group(place[0]).role(place[1])
    return math.inf if role is None or role.maximum is None else role.maximum


def _reconciled(view: View, place: RoleKey) -> Holding:
    # Leadership claims change holders without instructions.
    before, now = view.holdings.get(place, Holding({}, NOBODY)), frozenset(view.organisation.members(*place))
    instructions = dict(before.instructions)
    for name in sorted(before.holders ^ now):
        age = view.stated(*place, name)
        if name in now:
            instructions.setdefault(Instruction(age, True, name), Request("", Act.ASSIGN, *place, name))
        elif instructions.pop(Instruction(age, True, name), None) is None:
            instructions[Instruction(age, False, name)] = Request("", Act.RELEASE, *place, name)
    return Holding(instructions, now, before.is_crowded)


def _last_given(holding: Holding, name: str) -> Request:
    last = max(instruction for instruction in holding.instructions if instruction[1:] == (True, name))
    return holding.instructions[last]
