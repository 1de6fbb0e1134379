"""GRAPE: anonymous hedonic game; each vehicle joins its best coalition until all agree.

A partition maps vehicles to jobs. Every vehicle holds one with an evolution count and a time stamp. An unsatisfied
vehicle joins the coalition with the best gain if strictly better than its own, which increments the count, and
broadcasts. Of own and received partitions the higher count wins, then the higher stamp; adopting another's makes the
vehicle unsatisfied. If gains fall with coalition size, this ends in a Nash-stable partition. The game continues from
the current partition when jobs end or appear, or vehicles are lost.

Ours, for work that takes time and packet loss: a vehicle finishes a begun job. A job begins once its coalition is
stable for ``settle_rounds``. A partition is one block, so the fleet has to be small.

Source: Jang, Shin, Tsourdos 2018, Anonymous hedonic game for task allocation in a large-scale multiple agent system,
IEEE Transactions on Robotics 34 (6), algorithms 1 and 2.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from exchange.arithmetic import distance
from remoras.organisation import Group, RoleSpecification
from remoras.strategies.negotiator import Helped, Member, frames, taking
from remoras.strategy import Declaration, Heard, Move, Situation, Statement
from remoras.work import Outlook, Work

MOST_EVOLVED, MOST_STAMP = 65535, 1048575
"""Maxima that a fact can hold."""


class Player(Member["Grape"]):
    """One vehicle in the game."""

    def __init__(self, me: str, group: Group, strategy: Grape) -> None:
        super().__init__(me, group, strategy)
        self._partition: dict[str, str] = {}  # roles by vehicle
        self._age = (0, 0)  # how often the partition has evolved, and its stamp
        self._known: object = None
        self._is_satisfied = self._is_told = False
        self._stood: tuple[str | None, int] = (None, 0)  # the own coalition, and the round since which it has been

    def negotiate(self, situation: Situation) -> Move:
        """Process partitions, join the best coalition, begin its job once stable, report changes."""
        work, now = situation.work, situation.round
        for message in situation.heard:
            self._hear(message)
        self._keep_what_is_left(work)
        current, crowded = self._kept(work, self._partition)
        if current is not None:
            self._join(current.name, situation)
        elif not self._is_satisfied:
            self._join(self._best(situation, crowded), situation)
        self._is_satisfied = True
        statements = [self._leaves(role.name) for role in crowded]
        own = self._partition.get(self._me)
        if own != self._stood[0]:
            self._stood = own, now
        if current is None and own is not None and now - self._stood[1] >= self._with.settle_rounds:
            statements.append(self._takes(own))
        if work.unfinished and not (self._is_told and now % self._with.repeat_rounds):
            self._is_told = True
            statements.append(self._message())
        return Move(tuple(statements), holding=bool(work.unfinished))

    def division(self) -> Mapping[str, str]:
        """Return one vehicle at each job."""
        return {role: vehicle for vehicle, role in self._partition.items()}

    # Partition

    def _hear(self, message: Heard) -> None:
        values = {(subject, attribute): value for subject, attribute, value in message.facts}
        evolved, stamp = values.get((message.issuer, "claimsOf")), values.get((message.issuer, "worksSince"))
        if evolved is None or stamp is None or (int(evolved), int(stamp)) <= self._age:
            return
        places = {vehicle: str(path).partition(".") for (vehicle, name), path in values.items() if name == "worksOn"}
        if any(group != self._group.name for group, _, _ in places.values()):
            return
        self._partition = {vehicle: role for vehicle, (_, _, role) in places.items()}
        self._age, self._is_satisfied = (int(evolved), int(stamp)), False

    def _keep_what_is_left(self, work: Work) -> None:
        present = {data.name for data in work.workers}
        left = {role.name: role.job for role in work.unfinished}
        self._partition = {v: role for v, role in self._partition.items() if v in present and role in left}
        known = work.done, frozenset(present), tuple(role.name for role in work.open)
        if known != self._known:
            self._known, self._is_satisfied = known, False

    def _join(self, role: str | None, situation: Situation) -> None:
        if role == self._partition.get(self._me):
            return
        if role is None:
            del self._partition[self._me]
        else:
            self._partition[self._me] = role
        work = situation.work
        # Unique, unlike the random numbers of the paper: no two partitions tie.
        stamp = situation.round * len(work.database) + work.database[self._me].node
        self._age = min(MOST_EVOLVED, self._age[0] + 1), min(MOST_STAMP, stamp)
        self._is_told = False

    # Utility

    def _best(self, situation: Situation, left: Sequence[RoleSpecification]) -> str | None:
        own = self._partition.get(self._me)
        best, most = None, 0.0
        for role in situation.work.open:
            gain = -math.inf if role in left else self._gain_s(role, situation)
            if gain > most or (gain == most and role.name == own):
                best, most = role.name, gain
        return best

    def _gain_s(self, role: RoleSpecification, situation: Situation) -> float:
        work, n = situation.work, sum(p == role.name for v, p in self._partition.items() if v != self._me) + 1
        data, here = work.database[self._me], Outlook(situation.now_s, work.position_m(self._me))
        after = work.after(here, data, role)
        if after is None or (role.maximum is not None and n > role.maximum) or not work.affords(here, data, role):
            return -math.inf
        way_s = distance(here.position_m, work.job(role).place_m) / data.transit_speed_mps
        work_s = max(0.0, after.free_s - here.free_s - way_s)
        # Reward over participants, less travel: equation 32 of the paper, plus the work, in seconds.
        return (self._with.reward_s + work_s) / n - way_s

    def _message(self) -> Statement:
        evolved, stamp = self._age
        places = [(vehicle, "worksOn", self._group.path(role)) for vehicle, role in sorted(self._partition.items())]
        return Statement(((self._me, "claimsOf", evolved), (self._me, "worksSince", stamp), *places))


@dataclass(frozen=True, slots=True)
class Grape(Helped):
    """Anonymous hedonic game; see the module docstring."""

    reward_s: Annotated[
        float, Field(ge=0.0, le=1e6, description="reward of each job in addition to its duration (s)")
    ] = 1000.0
    settle_rounds: Annotated[int, frames("for which a coalition must stand before its job starts", 0)] = 1
    repeat_rounds: Annotated[int, frames("after which the partition is repeated")] = 4

    name: ClassVar[str] = "grape"
    member = Player
    planned: ClassVar[Declaration] = taking(
        "Jang, Shin, Tsourdos 2018 (GRAPE)",
        {
            "claimsOf": "how often the partition that follows has evolved; not acknowledged",
            "worksSince": "its time stamp",
            "worksOn": "at which job the partition has a vehicle",
        },
    )


GRAPE = Grape()
