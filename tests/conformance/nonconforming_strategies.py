"""Strategies that break one rule each: they prove that the checks of conformance can fail."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Annotated, Any, ClassVar

from pydantic import Field

from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, RoleAssignment
from remoras.strategies.central import Central
from remoras.strategies.fixed_partition import FixedPartition
from remoras.strategies.founding import common_roles
from remoras.strategies.status_broadcast import StatusBroadcast
from remoras.strategy import Declaration, Move, Negotiator, Situation, Statement, Strategy
from remoras.testing.strategies import OFTEN
from remoras.work import Work


@dataclass(frozen=True, slots=True)
class Unexplained(Central):
    """Tells its vehicles something that the ontology has no word for."""

    declaration: ClassVar[Declaration] = replace(Central().declaration, messages={"whistle": "come here"})


@dataclass(frozen=True, slots=True)
class SecretSignals(Central):
    """Sends influence signals without a word about it."""

    declaration: ClassVar[Declaration] = replace(Central().declaration, influences=True)


@dataclass(frozen=True, slots=True)
class Undescribed(Central):
    """Has a parameter that nobody explains."""

    haste: Annotated[int, Field(ge=0, le=9)] = 1


@dataclass(frozen=True, slots=True)
class Unbounded(Central):
    """Has a parameter without an upper bound."""

    haste: Annotated[float, Field(ge=0.0, description="how soon")] = 1.0


@dataclass(frozen=True, slots=True)
class WrongDefault(Central):
    """Has a parameter whose default is not among the values that it allows."""

    haste: Annotated[int, Field(ge=2, le=9, description="how soon")] = 1


@dataclass(frozen=True, slots=True)
class Outsiders(FixedPartition):
    """Gives jobs to vehicles of other groups too."""

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        pairs = zip(work.open, work.database.values(), strict=False)
        return tuple(work.assignment(role, data.name) for role, data in pairs if work.able(data, role))


@dataclass(frozen=True, slots=True)
class Doubled(FixedPartition):
    """Gives a job to everybody who is able to do it."""

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        pairs = product(work.open, work.members)
        return tuple(work.assignment(role, name) for role, name in pairs if work.able(work.database[name], role))


@dataclass(frozen=True, slots=True)
class Hasty(FixedPartition):
    """Gives out jobs before what they need is done."""

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        found = []
        for number, role in enumerate(work.unfinished):
            able = [data.name for data in work.workers if work.able(data, role)]
            found += [work.assignment(role, name) for name in able[number % len(able) :][:1]] if able else []
        return tuple(found)


@dataclass(frozen=True, slots=True)
class ByHash(FixedPartition):
    """Gives a job to the first in a set, and so by the hashes of names."""

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        able = {
            role: {data.name for data in work.workers if data.can_play(work.group.name, role.name)}
            for role in work.open
        }
        found = [work.assignment(role, next(iter(able[role]))) for role in work.open if able[role]]
        return common_roles(work) + tuple(one for one in found if one not in work.organisation.assignments)


PATIENCE_S = 150.0


class _Idle:
    """Has nothing to say."""

    def negotiate(self, situation: Situation) -> Move:
        return Move()


class _Altered:
    """A negotiator whose moves are altered."""

    def __init__(self, negotiator: Negotiator, me: str, group: Group) -> None:
        self._negotiator = negotiator
        self._me = me
        self._group = group

    def negotiate(self, situation: Situation) -> Move:
        return self.altered(self._negotiator.negotiate(situation), situation)

    def altered(self, move: Move, situation: Situation) -> Move:
        raise NotImplementedError


def altering(base: type[Strategy], kind: type[_Altered]) -> Any:
    """A strategy whose negotiators are altered."""

    def negotiator(self: Strategy, me: str, group: Group) -> Negotiator:
        return kind(base.negotiator(self, me, group), me, group)

    parts = {"negotiator": negotiator, "__module__": __name__, "__slots__": ()}
    return dataclass(frozen=True)(type(kind.__name__.removeprefix("_"), (base,), parts))


class _Skipping(_Altered):
    """Forgets one job."""

    def altered(self, move: Move, situation: Situation) -> Move:
        skipped = self._group.path(situation.work.roles[-1].name)
        kept = [said for said in move.statements if all(value != skipped for _, _, value in said.facts)]
        return replace(move, statements=tuple(kept))


Skipping = altering(Central, _Skipping)


class _Gullible(_Altered):
    """Plays whatever role anybody speaks of."""

    def altered(self, move: Move, situation: Situation) -> Move:
        roles = [str(value) for heard in situation.heard for _, what, value in heard.facts if what == "playsRole"]
        said = tuple(Statement(((self._me, "playsRole", role),)) for role in roles)
        return replace(move, statements=move.statements + said)


Gullible = altering(Central, _Gullible)


class _Presumptuous(_Altered):
    """Gives itself what it is able to do, without being asked."""

    def altered(self, move: Move, situation: Situation) -> Move:
        work = situation.work
        able = [role for role in work.open if work.able(work.database[self._me], role)]
        said = tuple(Statement(((self._me, "playsRole", self._group.path(role.name)),)) for role in able)
        return replace(move, statements=move.statements + said)


Presumptuous = altering(Central, _Presumptuous)


class _Fickle(_Altered):
    """Gives every job that it holds up in every frame, and takes it again, until it has done so often enough."""

    def altered(self, move: Move, situation: Situation) -> Move:
        if situation.round > 4 * OFTEN:
            return move
        self._mine |= {self._group.path(role.name) for role in situation.work.held_by(self._me)}
        word = "leftRole" if situation.round % 2 else "playsRole"
        said = tuple(Statement(((self._me, word, role),)) for role in sorted(self._mine))
        return replace(move, statements=move.statements + said)

    _mine: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class Fickle(FixedPartition):
    declaration: ClassVar[Declaration] = replace(
        Central().declaration, messages={"playsRole": "now", "leftRole": "not now"}, blocks_per_round=1
    )

    def negotiator(self, me: str, group: Group) -> Negotiator:
        return _Fickle(_Idle(), me, group)


class _Resentful(_Altered):
    """Lays down its work, and gives out none, once a peer has been silent."""

    def __init__(self, negotiator: Negotiator, me: str, group: Group) -> None:
        super().__init__(negotiator, me, group)
        self._offended = False

    def altered(self, move: Move, situation: Situation) -> Move:
        self._offended |= any(situation.now_s - heard_s > PATIENCE_S for heard_s in situation.heard_s.values())
        if not self._offended:
            return move
        held = situation.work.held_by(self._me)
        return Move(tuple(Statement(((self._me, "leftRole", self._group.path(role.name)),)) for role in held), True)


Resentful = altering(Central, _Resentful)


class _Talkative(_Altered):
    """Says everything three times in each round."""

    def altered(self, move: Move, situation: Situation) -> Move:
        told = tuple(Statement(((r.job, "knownDone", False),)) for r in self._group.roles if r.job is not None)
        return replace(move, statements=move.statements + 3 * told)


Talkative = altering(StatusBroadcast, _Talkative)


class _Undeclared(_Altered):
    """Tells what its strategy does not declare."""

    def altered(self, move: Move, situation: Situation) -> Move:
        told = Statement(((self._group.name, "hasMission", "AreaMapping"),))
        return replace(move, statements=(*move.statements, told))


Undeclared = altering(StatusBroadcast, _Undeclared)


class _Trusting(_Altered):
    """Takes it for granted that all others have been heard."""

    def altered(self, move: Move, situation: Situation) -> Move:
        others = [name for name in situation.work.members if name != self._me]
        if situation.round > 100 and min(situation.heard_s[name] for name in others) < 0.0:
            return Move()
        return move


Trusting = altering(Central, _Trusting)


class _Waiting(_Altered):
    """Gives out nothing before somebody has said something."""

    def altered(self, move: Move, situation: Situation) -> Move:
        return move if situation.heard_s else Move(holding=True)


Waiting = altering(StatusBroadcast, _Waiting)


@dataclass(frozen=True, slots=True)
class Unable(Central):
    """Founds groups with whoever is there."""

    def form(self, database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
        founding = [(g.name, r.name) for g in groups for r in g.roles if r.founding]
        return Organisation.of(groups, [RoleAssignment(*one, name) for one in founding for name in database.names])


BY_HASH = ByHash()
