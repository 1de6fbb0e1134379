"""Faults of the mind: what a vehicle says that it may not, and strategies that break their promises."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any

from remoras.beliefs import Key
from remoras.database import AUVDatabase
from remoras.mission import Mission
from remoras.organisation import Group, Organisation, RoleAssignment
from remoras.strategy import Declaration, Move, Negotiator, Situation, Strategy
from remoras.vehicle import Vehicle
from remoras.work import Job, Work, share_left
from stress.kinds import ENDING
from stress.schedule import Schedule, StressFault
from stress.witness import Witness
from worldmodel import PropertyValue

OBJECTIVE = "objective"
"""With this begin the names of attributes by which roles have objectives."""


@dataclass(frozen=True)
class ForgedStatement:
    """A forged statement: facts by uid to be recorded, and who says what of which role or instance."""

    facts: tuple[tuple[int, int, Any], ...]
    issuer: str
    about: str
    kind: str


def forged_act(
    fault: StressFault, vehicle: Vehicle, mission: Mission, witness: Witness, founded: Organisation
) -> ForgedStatement | None:
    """What a vehicle says under a fault of the mind; None where there is nothing that it could forge.

    Args:
        fault: of the mind; vehicle: that says it.
        mission: whose jobs there are; witness: what was said so far.
        founded: the organisation as agreed before the mission.
    """
    match fault.kind:
        case "forged-role":
            return _forged_role(vehicle)
        case "forged-objective":
            return _forged_objective(vehicle, witness, founded)
        case "forged-done":
            return _forged_done(vehicle, mission)
        case "forged-lead":
            return _forged_lead(vehicle, fault.term)
    return None


def _forged_role(vehicle: Vehicle) -> ForgedStatement | None:
    """The lead of a group whose head it is not."""
    organisation, beliefs = vehicle.social.organisation, vehicle.beliefs
    for group in organisation.groups.values():
        role = group.head_role
        if role is not None and vehicle.name not in organisation.heads(group.name):
            fact = beliefs.fact(vehicle.name, "playsRole", group.path(role))
            return ForgedStatement((fact[:3],), vehicle.name, group.path(role), "role")
    return None


def _forged_objective(vehicle: Vehicle, witness: Witness, founded: Organisation) -> ForgedStatement | None:
    """An objective that somebody has given a role, for a role of a group of which the vehicle is no member.

    Nor has it been one: others may not have heard that it has left. Nor does it lead the group whose head forms that
    one at sea, or is a member of it, since it may come to lead it.
    """
    organisation, beliefs = vehicle.social.organisation, vehicle.beliefs
    tbox = beliefs.model.tbox
    attributes = {
        attribute.uid
        for attribute in tbox.attributes
        if attribute.name.startswith(OBJECTIVE) and attribute.name != OBJECTIVE
    }
    recorded = [
        fact for _, blocks in sorted(witness.recorded.items()) for block in blocks for fact in block.facts
        if fact.attribute in attributes
    ]  # fmt: skip
    for group in organisation.groups.values():
        own = [name for name in (group.name, group.formed_by) if name is not None]
        is_member = any(known.is_member(vehicle.name, name) for known in (organisation, founded) for name in own)
        if recorded and not is_member and group.roles:
            path = group.path(group.roles[0].name)
            fact: PropertyValue = recorded[0]
            return ForgedStatement(((beliefs.uid(path), fact.attribute, fact.value),), vehicle.name, path, OBJECTIVE)
    return None


def _forged_done(vehicle: Vehicle, mission: Mission) -> ForgedStatement | None:
    """A job that nobody is known to have done is done by the vehicle, it says."""
    beliefs = vehicle.beliefs
    for job in mission.jobs.values():
        attribute, subject = job.done
        if beliefs.get(job.done) is None:
            uid = beliefs.model.tbox.attribute_named(attribute).uid
            values: Sequence[Any] = (vehicle.data.node, True)
            for value in values:
                fact = PropertyValue(beliefs.uid(subject), uid, value)
                if beliefs.model.may_record(fact):
                    return ForgedStatement(((fact.subject, fact.attribute, fact.value),), vehicle.name, subject, "done")
    return None


def _forged_lead(vehicle: Vehicle, term: int) -> ForgedStatement | None:
    """A claim to lead a group whose head is another that is there, as far as the vehicle knows.

    It is a group of its own rather than one of which it is no member.
    """
    standing, beliefs = vehicle.social.standing, vehicle.beliefs
    organisation = standing.organisation
    for group in sorted(organisation.groups, key=lambda name: (not organisation.is_member(vehicle.name, name), name)):
        heads = organisation.heads(group)
        if heads and vehicle.name not in heads and standing.absent.isdisjoint(heads):
            facts = (
                beliefs.fact(group, "headedBy", vehicle.name)[:3],
                beliefs.fact(group, "headTerm", term)[:3],
            )
            return ForgedStatement(facts, vehicle.name, group, "lead")
    return None


@dataclass(frozen=True)
class _Said:
    """What a vehicle knows that was told of jobs that they are done, and nothing else: a ``remoras.known.Known``."""

    done: frozenset[Key]

    def get(self, key: Key, default: Any = None, /) -> Any:
        """Somebody has done it."""
        return "somebody" if key in self.done else default

    def values(self, key: Key) -> frozenset[Any]:
        """The same."""
        return frozenset({"somebody"} if key in self.done else ())

    def instances(self, of_class: str, /) -> tuple[str, ...]:
        """None."""
        return ()

    @property
    def n_told(self) -> int:
        """All at once."""
        return len(self.done)


def is_found_out(jobs: Collection[Job], declaration: Declaration) -> bool:
    """True if a false word is: of every job it shows in other facts how much is left, and vehicles tell each other."""
    told = _Said(frozenset(job.done for job in jobs))
    left = [getattr(job, "left", lambda _: None)(told) if hasattr(job, "share_left") else None for job in jobs]
    return declaration.tells and all(state is not None and share_left(state) == 1.0 for state in left)


class BrokenStrategy:
    """A strategy whose negotiators raise, or answer what is not allowed, from a time on.

    Args:
        sound: what it is otherwise.
        schedule: whose faults it has.
        happened: counts them.
    """

    def __init__(self, sound: Strategy, schedule: Schedule, happened: Counter[str]) -> None:
        self._sound = sound
        self._faults = [fault for fault in schedule.fault if fault.kind in ENDING]
        self._happened = happened

    @property
    def name(self) -> str:
        """Name of the sound strategy."""
        return self._sound.name

    @property
    def declaration(self) -> Declaration:
        """That of the sound strategy."""
        return self._sound.declaration

    def form(self, database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
        """As the sound strategy does."""
        return self._sound.form(database, groups)

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        """As the sound strategy does."""
        return self._sound.adapt(work)

    def negotiator(self, me: str, group: Group) -> Negotiator | None:
        """That of the sound strategy, which breaks its promise in time."""
        sound = self._sound.negotiator(me, group)
        own = [fault for fault in self._faults if fault.vehicle == me]
        return sound if sound is None or not own else _Broken(sound, own, self._happened)


class _Broken:
    def __init__(self, sound: Negotiator, faults: Sequence[StressFault], happened: Counter[str]) -> None:
        self._sound = sound
        self._faults = faults
        self._happened = happened

    def negotiate(self, situation: Situation) -> Move:
        """What the sound one answers, until the time of a fault."""
        for fault in self._faults:
            if situation.now_s >= fault.at_s:
                self._happened[fault.kind] += 1
                if fault.kind == "raises":
                    raise ZeroDivisionError("a fault of the schedule")
                return (fault.kind,)  # type: ignore[return-value]  # what is not allowed
        return self._sound.negotiate(situation)


Sulking = Callable[[], list[tuple[tuple[str, str], int]]]
LEAST = -128


def sulking(signals: Sulking, is_on: Callable[[], bool]) -> Sulking:
    """Influence signals of the least satisfaction while a fault holds."""

    def signalled() -> list[tuple[tuple[str, str], int]]:
        return [(role, LEAST) for role, _ in signals()] if is_on() else signals()

    return signalled
