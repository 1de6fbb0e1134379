"""Protocol of organisational strategies: group formation, reorganisation, job assignment.

A strategy runs in a vehicle's social layer, on fleet-wide static data and the vehicle's beliefs, never on the truth. A
Python caller passes the object; a scenario names it as ``package.module:object``. Calls:

==============  ======================  ====================================================================
``form``        before the mission      initial roles; once for the whole fleet
``adapt``       planning of a group's   role assignments; by the leader of the group, before the mission if
                mission                 ``planned_before``
``negotiator``  before the mission      an object per vehicle and group with jobs
``negotiate``   end of every TDMA       next statements of the vehicle; for each of its negotiators
                frame
==============  ======================  ====================================================================

Statements are facts, sent in common packets and slots. ``form_groups``, ``adapt_roles`` and ``ask`` validate the
answers: an exception or invalid answer becomes a ``PluginError`` with the strategy's name.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar, Literal, NamedTuple, Protocol

from exchange.manager.peers import PeerLinks
from remoras.authority import Authority
from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, RoleAssignment
from remoras.plugins import answer, faults_of
from remoras.recorder import DONE, OBJECTIVES
from remoras.work import Point, Work
from worldmodel import ontology_path

Statable = tuple[str, str, str | float | bool]
"""(subject, attribute, value) of a fact, by names."""

JOB_DONE = DONE
"""Message key for finished jobs, replaced by the attributes of the mission's jobs."""
OBJECTIVE = OBJECTIVES
"""Message key for objectives of roles, replaced by the mission's attributes."""
INFLUENCE_SIGNAL = "influence signal"
"""Message key for one signed byte per own role and slot."""
HelpBy = Literal["none", "calls", "auction"]
"""Help for a vehicle that waits for another: none, by influence signals, or by an auction."""


@dataclass(frozen=True, slots=True)
class Declaration:
    """Properties of a strategy (``source``: its publication) and its demands on vehicles.

    Attributes:
        messages: meaning of each: attributes of the core ontology, ``JOB_DONE``, ``OBJECTIVE``, ``INFLUENCE_SIGNAL``.
        planned_before: True if missions are planned and known before the start; else leaders plan and send them.
        communicates: whether vehicles send packets.
        help: how waiting vehicles get help; with ``calls`` they send influence signals.
        meets: vehicles send at rendezvous only; others do not take their silence for absence.
        blocks_per_round: maximum number of blocks per vehicle, consultation round and job.
        sharing: for upper bounds, which are never ranked: the class ``remoras.fleet.instant_sharing.InstantSharing``.
        authorities: changes allowed to members other than the leader; by default only the leader assigns roles.
        private_jobs: vehicles record own jobs privately; contrary beliefs of others are no errors.

    >>> Declaration("my thesis", {JOB_DONE: "a job is done"}, help="calls").influences
    True
    """

    __pydantic_config__: ClassVar = {"strict": True, "revalidate_instances": "always"}  # for ``faults_of_strategy``

    source: str
    messages: Mapping[str, str]
    planned_before: bool = True
    communicates: bool = True
    help: HelpBy = "none"
    meets: bool = False
    blocks_per_round: int = 0
    sharing: Any = None  # untyped: avoids an import cycle
    authorities: frozenset[Authority] = frozenset()
    private_jobs: bool = False

    @property
    def tells(self) -> bool:
        """True if others learn a vehicle's statements, by packets or instantly."""
        return self.communicates or self.sharing is not None

    @property
    def influences(self) -> bool:
        """True if vehicles send influence signals."""
        return self.help == "calls"

    @property
    def vocabulary(self) -> tuple[Path, ...]:
        """Turtle files of the messages, besides the core ontology."""
        return (ontology_path("help"),) if self.help == "auction" else ()


@dataclass(frozen=True, slots=True)
class Statement:
    """Facts of one message; with ``told`` False only the vehicle itself records them.

    >>> Statement((("left", "jobDone", "AUV01"),)).told
    True
    """

    facts: tuple[Statable, ...]
    told: bool = True


@dataclass(frozen=True, slots=True)
class Heard:
    """Facts of one message received from a peer."""

    issuer: str
    time_s: float
    facts: tuple[Statable, ...]


class Waits(NamedTuple):
    """Waits for others, as the executive layer knows them.

    Attributes:
        calls: dissatisfaction by the last influence signal, in (0, 1]; satisfied peers are missing.
        own: roles (group, name) whose job makes no progress until another vehicle helps.
        ended: share of a wait that this vehicle would end by helping, less its satisfaction with its own work, 0..1; by
            caller and role.
    """

    calls: Mapping[str, float] = MappingProxyType({})
    own: tuple[tuple[str, str], ...] = ()
    ended: Callable[[str, str], float] = lambda caller, role: 0.0


NO_WAITS = Waits()


@dataclass(frozen=True, slots=True)
class Situation:
    """Knowledge of a vehicle at the end of a consultation round.

    Attributes:
        round: number of the ending TDMA frame, from 1; ``now_s`` is the time stamp of statements.
        work: jobs of the group, with the true own position; ``rally_m`` is its rally point, if any.
        heard: peers' statements on roles and attributes of the strategy, since the last round.
        heard_s: time of the latest information on each peer: last packet, or newest relayed report; missing if none.
        unheard: roles ``Group.Role`` assigned by this vehicle and not acknowledged, by peer.
        waits: own ones and those of peers.
        links: estimated losses of the links from and to each peer.

    >>> work = Work(Group("Divers"), Organisation(), AUVDatabase(()), jobs={})
    >>> Situation(30.0, 2, work, rally_m=None, heard=(), heard_s={}).work.is_begun
    False
    """

    now_s: float
    round: int
    work: Work
    rally_m: Point | None
    heard: tuple[Heard, ...]
    heard_s: Mapping[str, float]
    unheard: Mapping[str, Collection[str]] = field(default_factory=dict)
    waits: Waits = NO_WAITS
    links: Mapping[str, PeerLinks] = field(default_factory=dict)

    @property
    def calls(self) -> Mapping[str, float]:
        """Dissatisfaction of calling peers, see ``Waits``."""
        return self.waits.calls


@dataclass(frozen=True, slots=True)
class Move:
    """Result of a round.

    Attributes:
        holding: the group has work to assign, so it is not gathered.
        silent: the vehicle sends nothing; its data stay queued.
        expected: peers with expected silence: their lease starts afterwards.
        until_news: nothing to state, and the same answer for equal roles without statements or unacknowledged roles:
            skip calls until then.
        helping: (vehicle, role) of jobs that this vehicle is now to help with.

    >>> Move((Statement((("left", "jobDone", "AUV01"),)),), holding=True).silent
    False
    """

    statements: tuple[Statement, ...] = ()
    holding: bool = False
    silent: bool = False
    expected: Collection[str] = ()
    until_news: bool = False
    helping: tuple[tuple[str, str], ...] = ()


class Negotiator(Protocol):
    """One vehicle's part in assigning the jobs of one group; keeps state.

    With ``Declaration.private_jobs`` it may have ``division() -> Mapping[str, str]``: vehicle by role, as sent to all
    by the strategy's messages. It is called after part of a lease without reception; missing roles follow the prior
    knowledge.

    >>> class Idle(Negotiator):
    ...     def negotiate(self, situation):
    ...         return Move(until_news=True)
    >>> Idle().negotiate(None).statements
    ()
    """

    def negotiate(self, situation: Situation) -> Move:
        """Return the next statements."""


class Strategy(Protocol):
    """Organisational strategy; its parameters are the fields of a frozen dataclass.

    All five members are required. Strategies that differ in job assignment only reuse ``form`` of
    ``remoras.strategies.initial_roles`` and often its ``adapt``::

        @dataclass(frozen=True, slots=True)
        class Mine:
            name: ClassVar[str] = "mine"
            declaration: ClassVar[Declaration] = Declaration(source="...", messages={JOB_DONE: "a job is done"})
            form = staticmethod(founded)
            adapt = staticmethod(common_roles)

            def negotiator(self, me: str, group: Group) -> Negotiator:
                return MyNegotiator(me, group)

    >>> from remoras.strategies.cbba import STRATEGY
    >>> strategy: Strategy = STRATEGY
    >>> strategy.name, strategy.declaration.communicates, list(faults_of_strategy(strategy))
    ('cbba', True, [])
    """

    @property
    def name(self) -> str:
        """Name in results and figures."""

    @property
    def declaration(self) -> Declaration:
        """Properties of the strategy, and its demands on vehicles."""

    def form(self, database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
        """Return the initial organisation: groups with founding roles."""

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        """Return the role assignments of members when the group's mission is planned."""

    def negotiator(self, me: str, group: Group) -> Negotiator | None:
        """Return the negotiator of ``me`` for the jobs of ``group``; None if not needed."""


def faults_of_strategy(candidate: Any) -> Iterator[str]:
    """Yield the deficiencies of an object as a strategy, as text."""
    from pydantic import TypeAdapter, ValidationError

    yield from faults_of(candidate, Strategy, ("name", "declaration", "form", "adapt", "negotiator"))
    for part, expected in (("name", str), ("declaration", Declaration)):
        value = getattr(candidate, part, None)
        if value is not None and not isinstance(value, expected):
            yield f"{part} is {type(value).__name__}, expected {expected.__name__}"
    declaration = getattr(candidate, "declaration", None)
    if not isinstance(declaration, Declaration):
        return
    try:
        TypeAdapter(Declaration).validate_python(declaration)
    except ValidationError as error:
        for fault in error.errors():
            yield f"declaration.{fault['loc'][0]} is {fault['input']!r}; {fault['msg'].replace('I', 'i', 1)}"
    if declaration.sharing is not None:
        if not hasattr(declaration.sharing, "lease_frames"):
            yield f"declaration.sharing is {type(declaration.sharing).__name__}, expected the class InstantSharing"
        if declaration.communicates:
            yield "declaration.communicates is True; allowed: False, with instant sharing a strategy sends no packets"


def form_groups(strategy: Strategy, database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
    """Call ``strategy.form``; raise PluginError if it raises or returns another type."""
    asked = partial(strategy.form, database, groups)
    return answer(f"strategy {strategy.name}", "form", "an Organisation", Organisation, asked)


def adapt_roles(strategy: Strategy, work: Work) -> tuple[RoleAssignment, ...]:
    """Call ``strategy.adapt`` and drop incompatible assignments; errors as ``form_groups``."""
    expected, asked = "a tuple of RoleAssignment", partial(strategy.adapt, work)
    assignments = answer(f"strategy {strategy.name}", "adapt", expected, _are_assignments, asked)
    if not any(role.incompatible for role in work.group.roles):
        return assignments
    # Strategies need not know of incompatible roles. One after the other, since two new roles may exclude each other.
    allowed, organisation = list[RoleAssignment](), work.organisation
    for assignment in assignments:
        role = work.group.role(assignment.role)
        if role is None or not organisation.is_excluded(assignment.vehicle, role):
            allowed.append(assignment)
            organisation, _ = organisation.assign(assignment.vehicle, assignment.group, assignment.role)
    return tuple(allowed)


def negotiator_of(strategy: Strategy, me: str, group: Group) -> Negotiator | None:
    """Call ``strategy.negotiator``; raise PluginError if it raises or returns another type."""
    expected, asked = "an object with negotiate(situation), or None", partial(strategy.negotiator, me, group)

    def is_expected(made: object) -> bool:
        return made is None or callable(getattr(made, "negotiate", None))

    return answer(f"strategy {strategy.name}", "negotiator", expected, is_expected, asked)


def ask(strategy: str, negotiator: Negotiator, situation: Situation) -> Move:
    """Call ``negotiate``; raise PluginError if it raises or returns another type."""
    expected = "a Move with statements of (subject, attribute, value), flags True or False"
    return answer(f"strategy {strategy}", "negotiate", expected, _is_move, lambda: negotiator.negotiate(situation))


def division_of(strategy: str, negotiator: Negotiator) -> Mapping[str, str]:
    """Call ``division``, if any; raise PluginError as ``ask``."""
    division = getattr(negotiator, "division", None)
    if division is None:
        return {}
    expected = "a mapping of names of roles to names of vehicles"
    checked: Mapping[str, str] = answer(f"strategy {strategy}", "division", expected, _is_division, division)
    return checked


def _is_division(division: Any) -> bool:
    return isinstance(division, Mapping) and all(isinstance(name, str) for pair in division.items() for name in pair)


def _are_assignments(value: Any) -> bool:
    return isinstance(value, tuple) and all(isinstance(assignment, RoleAssignment) for assignment in value)


def _is_move(move: Any) -> bool:
    return (
        isinstance(move, Move)
        and all(isinstance(flag, bool) for flag in (move.holding, move.silent, move.until_news))
        and isinstance(move.statements, tuple)
        and all(isinstance(stated, Statement) and all(map(_is_statable, stated.facts)) for stated in move.statements)
    )


def _is_statable(fact: Any) -> bool:
    match fact:
        case (str(), str(), str() | float() | int()):
            return isinstance(fact, tuple)
    return False
