"""Observations and actions: what a vehicle knows as arrays of fixed sizes, and what it may state as numbers.

All of an observation follows from one ``Situation``, which holds what the vehicle itself knows and nothing else. A row
of ``jobs`` belongs to a role of the group that has a job, in the order of the names of the jobs; a row of ``peers`` to
another vehicle that may have a part in them, in the order of the nodes. Rows without a job or a peer are 0, and so are
those of jobs that the vehicle does not know to exist.

Actions: 0 states nothing; ``TAKE + n`` takes the job of row n; ``LEAVE + n`` leaves it; ``AGAIN + n`` says again that
the vehicle has it. ``action_mask`` has a 1 for each that is sensible by what the vehicle believes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from operator import is_
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from remoras.errors import PluginError
from remoras.organisation import Group, RoleSpecification
from remoras.strategy import Move, Situation, Statement
from remoras.work import Outlook, Work, share_left

MOST_JOBS, MOST_PEERS = 20, 7
TAKE, LEAVE, AGAIN = 1, 1 + MOST_JOBS, 1 + 2 * MOST_JOBS
N_ACTIONS = 1 + 3 * MOST_JOBS
OWN = (
    "x_m", "y_m", "transit_mps", "survey_mps", "energy_share", "n_held", "free_after_s", "now_s", "round", "place",
    "n_members", "is_head", "n_unfinished", "rally_x_m", "rally_y_m",
)  # fmt: skip
"""Of the vehicle: where it is; its speeds by its data; share of its energy, 1 where it is enough; jobs that it holds,
and in how long it will have done them; the time; number of the TDMA frame; its place among the members, and how many
these are; whether it leads them; jobs not known to be done; the meeting place from here, 0 without one."""
JOB = (
    "known", "done", "open", "own", "n_others", "room", "share_left", "x_m", "y_m", "done_after_s", "holder_age_s",
)  # fmt: skip
"""Of each job: known to exist; known to be done; may be begun; held by this vehicle; other holders; room for another;
share left; its place from here; in how long it would be done if this vehicle did it next, 0 where it may not take it;
age of the last word of the other who holds it, 0 without one."""
PEER = (
    "known", "member", "word_age_s", "x_m", "y_m", "n_held", "job", "loss_from", "loss_to", "n_unheard", "call",
)  # fmt: skip
"""Of each peer: it is one; it is a member of the group as far as is known; age of its last word, since the start
without one; where it was last known to be, from here; jobs that it holds, and the row of the first, -1 without one;
estimated loss of the links from and to it; roles given to it that it has not acknowledged; how dissatisfied it is."""
X, Y, SHARE_LEFT, DONE_AFTER_S, HOLDER_AGE_S = map(
    JOB.index, ("x_m", "y_m", "share_left", "done_after_s", "holder_age_s")
)
Array: TypeAlias = "npt.NDArray[np.float64]"
Sight: TypeAlias = "dict[str, npt.NDArray[Any]]"


def unasked() -> Sight:
    """The observation of a vehicle that has nothing to decide: all 0, and action 0 alone allowed."""
    mask = np.zeros(N_ACTIONS, np.int8)
    mask[0] = 1
    return {
        "own": np.zeros(len(OWN)),
        "jobs": np.zeros((MOST_JOBS, len(JOB))),
        "peers": np.zeros((MOST_PEERS, len(PEER))),
        "action_mask": mask,
    }


def action_of(action: object, mask: npt.NDArray[Any]) -> int | None:
    """Number of an action; None if it is none, or outside of a mask.

    >>> mask = unasked()["action_mask"]
    >>> action_of(0, mask), action_of(1, mask), action_of(N_ACTIONS, mask), action_of("take", mask)
    (0, None, None, None)
    """
    if not isinstance(action, int | np.integer) or isinstance(action, bool):
        return None
    number = int(action)
    return number if 0 <= number < N_ACTIONS and mask[number] else None


@dataclass(frozen=True)
class Division:
    """Who does what as a vehicle knows it: what stays the same until it hears of a change.

    Attributes:
        rests_on: what it follows from.
        jobs: rows of the jobs, with places as they are on the map.
        mask: of the actions.
        held: roles that the vehicle plays, left: rows of unfinished jobs that somebody may do a part of.
        takeable: rows and roles that it may take; by_others: rows and holders of jobs that others hold.
        n_held: by peer, how many jobs it holds, and the row of the first.
        n_unfinished: jobs not known to be done.
    """

    rests_on: tuple[object, ...]
    jobs: Array
    mask: bytes
    held: list[RoleSpecification]
    left: list[tuple[int, str]]
    takeable: list[tuple[int, RoleSpecification]]
    by_others: list[tuple[int, list[str]]]
    n_held: dict[str, tuple[int, int]]
    n_unfinished: int


class Observer:
    """What one vehicle knows of one group, as arrays, and what its actions state.

    Args:
        me: name of the vehicle.
        group: whose jobs are divided.

    Raises:
        PluginError: the group has more jobs than there are rows.
    """

    def __init__(self, me: str, group: Group) -> None:
        self._me = me
        self._roles = sorted((role for role in group.roles if role.job), key=lambda role: (role.job or "", role.name))
        if len(self._roles) > MOST_JOBS:
            raise PluginError(f"group {group.name} has {len(self._roles)} jobs; allowed to learn on: {MOST_JOBS}")
        self._paths = [group.path(role.name) for role in self._roles]
        self._peers: tuple[str, ...] | None = None
        self._known: Division | None = None

    def observation(self, situation: Situation) -> Sight:
        """The arrays of a situation.

        Raises:
            PluginError: there are more peers than rows.
        """
        work, now_s, heard_s = situation.work, situation.now_s, situation.heard_s
        division = self._division(work)
        data, position_m = work.database[self._me], work.position_m(self._me)
        here, (x_m, y_m) = Outlook(now_s, position_m), position_m
        jobs = division.jobs.copy()
        n = len(self._roles)
        jobs[:n, X] -= x_m
        jobs[:n, Y] -= y_m
        for row, name in division.left:
            jobs[row, SHARE_LEFT] = share_left(work.jobs[name])
        for row, role in division.takeable:
            then = work.job(role).after(here, data)
            if then is not None:
                jobs[row, DONE_AFTER_S] = then.free_s - now_s
        for row, holders in division.by_others:
            jobs[row, HOLDER_AGE_S] = now_s - max([heard_s.get(name, 0.0) for name in holders])
        (rally_x_m, rally_y_m), held = situation.rally_m or position_m, division.held
        energy_j, members = work.energy_j.get(self._me), work.members
        own = (
            x_m, y_m, data.transit_speed_mps, data.survey_speed_mps,
            1.0 if energy_j is None else energy_j / data.energy_j,
            len(held), work.after_all(here, data, held).free_s - now_s if held else 0.0, now_s, situation.round,
            members.index(self._me), len(members), self._me in work.heads, division.n_unfinished,
            rally_x_m - x_m, rally_y_m - y_m,
        )  # fmt: skip
        peers = np.zeros((MOST_PEERS, len(PEER)))
        for number, (name, counted) in enumerate(division.n_held.items()):
            peer_x_m, peer_y_m = work.position_m(name)
            links = situation.links.get(name)
            peers[number] = (
                1.0, name in members, now_s - heard_s.get(name, 0.0), peer_x_m - x_m, peer_y_m - y_m, *counted,
                0.0 if links is None else links.incoming.p_reckoned,
                0.0 if links is None else links.outgoing.p_reckoned,
                len(situation.unheard.get(name, ())), situation.calls.get(name, 0.0),
            )  # fmt: skip
        mask = np.frombuffer(bytearray(division.mask), np.int8)
        return {"own": np.array(own, np.float64), "jobs": jobs, "peers": peers, "action_mask": mask}

    def _division(self, work: Work) -> Division:
        """Who does what; worked out anew once the vehicle has other beliefs of that."""
        rests_on = work.organisation, work.done, work.open, work.unable, work.barred
        known = self._known
        if known is None or not all(map(is_, known.rests_on, rests_on)):
            known = self._known = self._worked_out(work, rests_on)
        return known

    def _worked_out(self, work: Work, rests_on: tuple[object, ...]) -> Division:
        me, data, may_begin = self._me, work.database[self._me], {role.name for role in work.open}
        n_held = dict.fromkeys(self._peers_of(work), (0, -1))
        mask, n_unfinished = bytearray(N_ACTIONS), 0
        mask[0] = 1
        found = Division(rests_on, np.zeros((MOST_JOBS, len(JOB))), b"", [], [], [], [], n_held, 0)
        for row, role in enumerate(self._roles):
            job = work.jobs.get(role.job or "")
            if job is None:
                continue
            holders, is_done = work.holders(role), job.name in work.done
            others = [name for name in holders if name != me]
            is_own, has_room = len(others) < len(holders), role.maximum is None or len(holders) < role.maximum
            is_open = role.name in may_begin
            if not is_done:
                n_unfinished += 1
                found.left.append((row, job.name))
                if is_own:
                    found.held.append(role)
                    mask[LEAVE + row] = mask[AGAIN + row] = 1
                elif is_open and has_room and work.able(data, role):
                    found.takeable.append((row, role))
                    mask[TAKE + row] = 1
                if others:
                    found.by_others.append((row, others))
                for name in n_held.keys() & set(others):
                    n, first = n_held[name]
                    n_held[name] = n + 1, row if first < 0 else first
            found.jobs[row] = 1, is_done, is_open, is_own, len(others), has_room, 0, *job.place_m, 0, 0
        return replace(found, mask=bytes(mask), n_unfinished=n_unfinished)

    def move(self, action: object, mask: npt.NDArray[Any], situation: Situation) -> Move:
        """What an action states; one that is none, or outside of its mask, states nothing.

        Args:
            action: a whole number.
            mask: of the observation that it answers.
            situation: that this was made of.
        """
        statements: tuple[Statement, ...] = ()
        number = action_of(action, mask)
        if number:
            leaves = LEAVE <= number < AGAIN
            path = self._paths[(number - TAKE) % MOST_JOBS]
            statements = (Statement(((self._me, "leftRole" if leaves else "playsRole", path),)),)
        return Move(statements, holding=bool(situation.work.unfinished))

    def _peers_of(self, work: Work) -> tuple[str, ...]:
        """Other vehicles that are able to play some role with a job, in the order of the nodes."""
        if self._peers is None:
            names = [role.name for role in self._roles]
            self._peers = tuple(
                data.name
                for data in work.database.values()
                if data.name != self._me and any(data.can_play(work.group.name, name) for name in names)
            )
            if len(self._peers) > MOST_PEERS:
                raise PluginError(f"{self._me} has {len(self._peers)} peers; allowed to learn with: {MOST_PEERS}")
        return self._peers
