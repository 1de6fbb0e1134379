"""Strategies that break one rule each: they prove that the checks of conformance can fail."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

from pydantic import Field

from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, RoleAssignment
from remoras.strategies.allocation import at_work, open_roles, surveyors
from remoras.strategies.central import Central
from remoras.strategies.fixed_partition import FixedPartition
from remoras.strategies.founding import common_roles
from remoras.strategies.status_broadcast import StatusBroadcast
from remoras.strategy import Declaration, Evidence, Move, Negotiator, Situation, Statement


@dataclass(frozen=True, slots=True)
class Unexplained(Central):
    """Tells its vehicles something that the ontology has no word for."""

    declaration: ClassVar[Declaration] = replace(Central.declaration, messages={"whistle": "come here"})


@dataclass(frozen=True, slots=True)
class SecretSignals(Central):
    """Sends influence signals without a word about it."""

    declaration: ClassVar[Declaration] = replace(Central.declaration, influences=True)


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
    """Gives areas to vehicles of other groups too."""

    def adapt(self, group: Group, organisation: Organisation, evidence: Evidence) -> tuple[RoleAssignment, ...]:
        return tuple(
            RoleAssignment(group.name, role.name, data.name)
            for role, data in zip(open_roles(group, evidence), evidence.database.values(), strict=False)
            if data.can_play(role.name) and data.swath_m > 0.0
        )


@dataclass(frozen=True, slots=True)
class Doubled(FixedPartition):
    """Gives an area to everybody who is able to survey it."""

    def adapt(self, group: Group, organisation: Organisation, evidence: Evidence) -> tuple[RoleAssignment, ...]:
        return tuple(
            RoleAssignment(group.name, role.name, name)
            for role in open_roles(group, evidence)
            for name in organisation.members(group.name)
            if evidence.database[name].can_play(role.name) and evidence.database[name].swath_m > 0.0
        )


@dataclass(frozen=True, slots=True)
class ByHash(FixedPartition):
    """Gives an area to the first in a set, and so by the hashes of names."""

    def adapt(self, group: Group, organisation: Organisation, evidence: Evidence) -> tuple[RoleAssignment, ...]:
        members = surveyors(group, organisation, evidence.database)
        vacant = [role.name for role in open_roles(group, evidence)]
        able = {name: {data.name for data in members if data.can_play(name)} for name in vacant}
        found = [RoleAssignment(group.name, name, next(iter(able[name]))) for name in vacant if able[name]]
        areas = tuple(one for one in found if one not in organisation.assignments)
        return common_roles(group, organisation, evidence) + areas


PATIENCE_S = 300.0


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


class _Gullible(_Altered):
    """Plays whatever role anybody speaks of."""

    def altered(self, move: Move, situation: Situation) -> Move:
        roles = [str(value) for heard in situation.heard for _, what, value in heard.facts if what == "playsRole"]
        said = tuple(Statement(((self._me, "playsRole", role),)) for role in roles)
        return replace(move, statements=move.statements + said)


@dataclass(frozen=True, slots=True)
class Gullible(Central):
    def negotiator(self, me: str, group: Group) -> Negotiator:
        return _Gullible(Central.negotiator(self, me, group), me, group)


class _Endless(_Altered):
    """Always has something to give out."""

    def altered(self, move: Move, situation: Situation) -> Move:
        return replace(move, holding=True)


@dataclass(frozen=True, slots=True)
class Endless(Central):
    def negotiator(self, me: str, group: Group) -> Negotiator:
        return _Endless(Central.negotiator(self, me, group), me, group)


class _Fickle(_Altered):
    """Gives every area that it holds up in every frame, and takes it again."""

    def altered(self, move: Move, situation: Situation) -> Move:
        held = at_work(self._me, self._group, situation.organisation, situation.evidence)
        self._mine |= {self._group.path(role.name) for role in held}
        word = "leftRole" if situation.round % 2 else "playsRole"
        said = tuple(Statement(((self._me, word, role),)) for role in sorted(self._mine))
        return replace(move, statements=move.statements + said)

    _mine: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class Fickle(FixedPartition):
    declaration: ClassVar[Declaration] = replace(
        Central.declaration, messages={"playsRole": "now", "leftRole": "not now"}, blocks_per_round=1
    )

    def negotiator(self, me: str, group: Group) -> Negotiator:
        return _Fickle(_Idle(), me, group)


class _Resentful(_Altered):
    """Waits for ever once a peer has been silent."""

    def __init__(self, negotiator: Negotiator, me: str, group: Group) -> None:
        super().__init__(negotiator, me, group)
        self._offended = False

    def altered(self, move: Move, situation: Situation) -> Move:
        self._offended |= any(situation.now_s - heard_s > PATIENCE_S for heard_s in situation.heard_s.values())
        return replace(move, holding=move.holding or self._offended)


@dataclass(frozen=True, slots=True)
class Resentful(Central):
    def negotiator(self, me: str, group: Group) -> Negotiator:
        return _Resentful(Central.negotiator(self, me, group), me, group)


class _Talkative(_Altered):
    """Says everything three times in each round."""

    def altered(self, move: Move, situation: Situation) -> Move:
        told = tuple(Statement(((r.area, "knownDone", False),)) for r in self._group.roles if r.area is not None)
        return replace(move, statements=move.statements + 3 * told)


@dataclass(frozen=True, slots=True)
class Talkative(StatusBroadcast):
    def negotiator(self, me: str, group: Group) -> Negotiator:
        return _Talkative(StatusBroadcast.negotiator(self, me, group), me, group)


class _Undeclared(_Altered):
    """Tells what its strategy does not declare."""

    def altered(self, move: Move, situation: Situation) -> Move:
        return replace(
            move, statements=(*move.statements, Statement(((self._group.name, "hasMission", "AreaMapping"),)))
        )


@dataclass(frozen=True, slots=True)
class Undeclared(StatusBroadcast):
    def negotiator(self, me: str, group: Group) -> Negotiator:
        return _Undeclared(StatusBroadcast.negotiator(self, me, group), me, group)


class _Trusting(_Altered):
    """Takes it for granted that all others have been heard."""

    def altered(self, move: Move, situation: Situation) -> Move:
        others = [name for name in situation.organisation.members(self._group.name) if name != self._me]
        if situation.round > 100 and min(situation.heard_s[name] for name in others) < 0.0:
            return Move()
        return move


@dataclass(frozen=True, slots=True)
class Trusting(Central):
    def negotiator(self, me: str, group: Group) -> Negotiator:
        return _Trusting(Central.negotiator(self, me, group), me, group)


class _Waiting(_Altered):
    """Gives out nothing before somebody has said something."""

    def altered(self, move: Move, situation: Situation) -> Move:
        return move if situation.heard_s else Move(holding=True)


@dataclass(frozen=True, slots=True)
class Waiting(StatusBroadcast):
    def negotiator(self, me: str, group: Group) -> Negotiator:
        return _Waiting(StatusBroadcast.negotiator(self, me, group), me, group)


@dataclass(frozen=True, slots=True)
class Unable(Central):
    """Founds groups with whoever is there."""

    def form(self, database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
        founding = [(g.name, r.name) for g in groups for r in g.roles if r.founding]
        return Organisation.of(groups, [RoleAssignment(*one, name) for one in founding for name in database.names])


BY_HASH = ByHash()
