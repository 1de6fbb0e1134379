"""Role holders: who holds a role with a job or with room for few, by all that was said of it, whatever was heard first.

An assignment finds room or waits. When a holder leaves, the newest of those that wait is let in, for want of newer
word: what is said later takes the room from it, and it waits again. Where heads alone give out jobs, holders that have
theirs from before a head led, or began anew, make room for whom it names: it may know nothing of what was told before,
and nobody would do what it gives out again. So this is a function of what was said and of no order.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

from remoras.authority import NOBODY, Act, Request
from remoras.organisation import Outcome, RoleKey
from remoras.social.leadership import Age
from remoras.social.view import Holding, Instruction, View


def holders_after(
    instructions: Iterable[Instruction],
    room: float,
    led_since: Callable[[Instruction], Age | None] = lambda instruction: None,
) -> tuple[set[str], list[str]]:
    """Who of at most ``room`` hold a role after all that was said of it, and who waits for room, the newest first.

    Args:
        instructions: in any order.
        room: for so many.
        led_since: since when the head that gave it has led: who holds the role from before makes room; or None.
    """
    holders: dict[str, bool] = {}  # with whether it was let in
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
    """True if whoever said the latter said the former before it began anew, and may know nothing of it."""
    return before[1] == after[1] and before[2] < after[2]


def is_limited(view: View, asked: Request) -> bool:
    """True if something is asked on which it depends who holds a role with a job or with room for few.

    Nobody waits for the role of a head that is succeeded: after it has left, the first in order claims the group.
    """
    group = view.group(asked.group)
    is_claimed = asked.role == group.head_role and bool(group.succession)
    if asked.act not in (Act.ASSIGN, Act.RELEASE) or is_claimed:
        return False
    role = group.role(asked.role)
    return role is not None and (role.maximum is not None or role.job is not None)


def yielding_to(view: View, asked: Request, age: Age) -> frozenset[str]:
    """Holders of a role that have it from before the issuer led, and make room for whom it names."""
    since = _led_since(view, asked, age)
    if since is None:
        return NOBODY
    holders = view.organisation.members(asked.group, asked.role)
    return frozenset(name for name in holders if view.stated(asked.group, asked.role, name) < since)


def settle(view: View, asked: Request, age: Age) -> View:
    """What is ``asked`` at ``age`` counts among all that was said of the role, and who holds it follows from that.

    If the vehicle in question does not get the role for now, it is noted why: it waits for room, or takes no jobs.
    """
    place = asked.group, asked.role
    holding, gives, stands = _reconciled(view, place), asked.act is Act.ASSIGN, _stands(view, asked, age)
    instructions, holders = dict(holding.instructions), holding.holders
    is_full = len(holders) >= _room(view, place) and asked.assignee not in holders
    if gives and stands and is_full and view.rules.authorities and holders <= view.now.absent:  # else heads say so
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
    """Who holds the jobs of a group follows from all that was said of them, now that more is known.

    Args:
        view: as it is.
        group: its name.
        issuer: that has claimed it, or of which it is known anew whether it takes jobs.
    """
    jobs = {role.name for role in view.group(group).roles if role.job is not None}
    follows: list[Request] = []
    for place in [place for place in view.holdings if place[0] == group and place[1] in jobs]:
        view, more, _ = _follow(view, place, _reconciled(view, place), issuer)
        follows += more
    for request in follows:
        view = view.do(request)
    return view


def let_in(view: View) -> View:
    """Who waits plays a role for which there is room now, the newest first: holders may have left otherwise.

    Where vehicles divide jobs among themselves, holders that are absent may make room.
    """
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
    """Releases and assignments by which those hold a role that are to, after all that was said of it; and who waits."""
    holders, waiting = _after(view, place, holding.instructions)
    after = Holding(holding.instructions, frozenset(holders), bool(waiting))
    follows = [Request(issuer, Act.RELEASE, *place, name) for name in sorted(holding.holders - holders)]
    follows += [_last_given(holding, name) for name in sorted(holders - holding.holders)]
    return replace(view, holdings={**view.holdings, place: after}), follows, waiting


def _after(view: View, place: RoleKey, instructions: Mapping[Instruction, Request]) -> tuple[set[str], list[str]]:
    """Who holds a role and who waits for room after all that counts of what was said of it."""
    counting = [instruction for instruction, asked in instructions.items() if _stands(view, asked, instruction.age)]
    return holders_after(counting, _room(view, place), lambda last: _led_since(view, instructions[last], last.age))


def _stands(view: View, asked: Request, age: Age) -> bool:
    """True unless the issuer, as is known now, led no more by then, or the assignee took no jobs."""
    if _is_for_heads(view, asked) and not view.leadership.led(asked.issuer, asked.group, age):
        return False
    return asked.act is not Act.ASSIGN or view.availability.takes(asked, view.group(asked.group), age, view.rules)


def _led_since(view: View, asked: Request, age: Age) -> Age | None:
    """Since when the issuer of an assignment has led, where heads alone give out the role; else None."""
    is_order = asked.act is Act.ASSIGN and _is_for_heads(view, asked)
    return view.leadership.since(asked.issuer, asked.group, age) if is_order else None


def _is_for_heads(view: View, asked: Request) -> bool:
    """True if heads alone may ask it: it gives out or takes back a role with a job that is another's."""
    role = view.group(asked.group).role(asked.role)
    is_own = asked.issuer in ("", asked.assignee) and asked.act is Act.RELEASE
    return bool(asked.issuer and role and role.job and not is_own and not view.rules.authorities)


def _room(view: View, place: RoleKey) -> float:
    role = view.group(place[0]).role(place[1])
    return math.inf if role is None or role.maximum is None else role.maximum


def _reconciled(view: View, place: RoleKey) -> Holding:
    """What was said of a role, with what has become of it by other ways, such as a claim to lead the group."""
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
