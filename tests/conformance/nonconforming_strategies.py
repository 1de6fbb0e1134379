"""Strategies that break one rule each: proof that the conformance checks can fail."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Annotated, Any, ClassVar

from pydantic import Field

from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, RoleAssignment
from remoras.strategies.central import Central
from remoras.strategies.fixed_partition import FixedPartition
from remoras.strategies.initial_roles import common_roles
from remoras.strategies.status_broadcast import StatusBroadcast
from remoras.strategy import Declaration, Move, Negotiator, Situation, Statement, Strategy
from remoras.testing.strategies import OFTEN
from remoras.work import Work


@dataclass(frozen=True, slots=True)
class Unexplained(Central):
    """Sends a fact without a term in the ontology."""

    declaration: ClassVar[Declaration] = replace(Central().declaration, messages={"whistle": "come here"})


@dataclass(frozen=True, slots=True)
class SecretSignals(Central):
    """Sends influence signals without a word about it."""

    declaration: ClassVar[Declaration] = replace(Central().declaration, help="calls")


@dataclass(frozen=True, slots=True)
class Powerless(StatusBroadcast):
    """Takes jobs without the authority to do so."""

    declaration: ClassVar[Declaration] = replace(StatusBroadcast().declaration, authorities=frozenset())


@dataclass(frozen=True, slots=True)
class Undescribed(Central):
    """Has a parameter without description."""

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
    """Assigns a job to every able vehicle."""

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        pairs = product(work.open, work.members)
        return tuple(work.assignment(role, name) for role, name in pairs if work.able(work.database[name], role))


@dataclass(frozen=True, slots=True)
class Hasty(FixedPartition):
    """Assigns jobs before their predecessors are done."""

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


@dataclass
class Altered:
    """A negotiator whose moves a function alters; ``memory`` is for what the function has to remember."""

    negotiator: Negotiator
    me: str
    group: Group
    alter: Callable[["Altered", Move, Situation], Move]
    memory: set[str] = field(default_factory=set)

    def negotiate(self, situation: Situation) -> Move:
        return self.alter(self, self.negotiator.negotiate(situation), situation)

    def states(self, move: Move, *facts: tuple[str, str, Any]) -> Move:
        """The move, and a statement of each fact."""
        return replace(move, statements=(*move.statements, *(Statement((fact,)) for fact in facts)))


def altering(base: type[Strategy], alter: Callable[[Altered, Move, Situation], Move], **parts: Any) -> Any:
    """A strategy whose moves a function alters."""

    def negotiator(self: Strategy, me: str, group: Group) -> Negotiator:
        return Altered(base.negotiator(self, me, group), me, group, alter)

    parts |= {"negotiator": negotiator, "__module__": __name__, "__slots__": ()}
    return dataclass(frozen=True)(type(alter.__name__, (base,), parts))


def skipping(of: Altered, move: Move, situation: Situation) -> Move:
    """Forget one job."""
    skipped = of.group.path(situation.work.roles[-1].name)
    kept = [said for said in move.statements if all(value != skipped for _, _, value in said.facts)]
    return replace(move, statements=tuple(kept))


def gullible(of: Altered, move: Move, situation: Situation) -> Move:
    """Play every role named in any message."""
    roles = [str(value) for heard in situation.heard for _, what, value in heard.facts if what == "playsRole"]
    return of.states(move, *((of.me, "playsRole", role) for role in roles))


def presumptuous(of: Altered, move: Move, situation: Situation) -> Move:
    """Take every feasible job without an order."""
    work = situation.work
    able = [role for role in work.open if work.able(work.database[of.me], role)]
    return of.states(move, *((of.me, "playsRole", of.group.path(role.name)) for role in able))


def fickle(of: Altered, move: Move, situation: Situation) -> Move:
    """Give every job that it holds up in every frame, and take it again, until it has done so often enough."""
    if situation.round > 4 * OFTEN:
        return Move()
    of.memory |= {of.group.path(role.name) for role in situation.work.held_by(of.me)}
    word = "leftRole" if situation.round % 2 else "playsRole"
    return of.states(Move(), *((of.me, word, role) for role in sorted(of.memory)))


def resentful(of: Altered, move: Move, situation: Situation) -> Move:
    """Lay down all work, and give out none, once a peer has been silent."""
    of.memory |= {name for name, heard_s in situation.heard_s.items() if situation.now_s - heard_s > PATIENCE_S}
    if not of.memory:
        return move
    held = situation.work.held_by(of.me)
    return of.states(Move(holding=True), *((of.me, "leftRole", of.group.path(role.name)) for role in held))


def talkative(of: Altered, move: Move, situation: Situation) -> Move:
    """Say everything three times in each round."""
    return of.states(move, *3 * [(role.job, "knownDone", False) for role in of.group.roles if role.job is not None])


def undeclared(of: Altered, move: Move, situation: Situation) -> Move:
    """Send facts that the strategy does not declare."""
    return of.states(move, (of.group.name, "hasMission", "AreaMapping"))


def trusting(of: Altered, move: Move, situation: Situation) -> Move:
    """Assume that a message of every peer was received."""
    others = [name for name in situation.work.members if name != of.me]
    return Move() if situation.round > 100 and min(situation.heard_s[name] for name in others) < 0.0 else move


def waiting(of: Altered, move: Move, situation: Situation) -> Move:
    """Assign nothing before the first message of a peer."""
    return move if situation.heard_s else Move(holding=True)


Skipping, Gullible, Presumptuous = (altering(Central, alter) for alter in (skipping, gullible, presumptuous))
Resentful, Trusting = altering(Central, resentful), altering(Central, trusting)
Talkative, Undeclared, Waiting = (altering(StatusBroadcast, alter) for alter in (talkative, undeclared, waiting))
FICKLE = replace(Central().declaration, messages={"playsRole": "now", "leftRole": "not now"}, blocks_per_round=1)
Fickle = altering(FixedPartition, fickle, declaration=FICKLE)


@dataclass(frozen=True, slots=True)
class Unable(Central):
    """Founds groups of arbitrary vehicles."""

    def form(self, database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
        founding = [(g.name, r.name) for g in groups for r in g.roles if r.founding]
        return Organisation.of(groups, [RoleAssignment(*one, name) for one in founding for name in database.names])


BY_HASH = ByHash()
