"""The seam of organisational strategies: how groups form and re-form, and who does which job.

A strategy runs inside a vehicle's social layer. It sees data that the whole fleet shares and what this vehicle
believes, never the truth. A Python caller passes the object; a scenario names it as ``package.module:object``. Who asks
it what, and when:

==============  ======================  ====================================================================
``form``        before the mission      who founds the groups; asked once for the whole fleet
``adapt``       mission of a group is   who gets which role; asked of the head of the group, before the
                planned                 mission if ``planned_before``
``negotiator``  before the mission      an object for one vehicle in one group that has jobs
``negotiate``   end of every TDMA       what this vehicle states next; asked of each of its negotiators
                frame
==============  ======================  ====================================================================

What a negotiator states are facts: they travel in the same packets and slots as everything else. ``form_groups``,
``adapt_roles`` and ``ask`` put these questions and hold the answers against the seam: a strategy that raises or answers
with something else is named in a ``PluginError``.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from exchange.peering.peers import PeerLinks
from remoras.authority import Authority
from remoras.contents import DONE, OBJECTIVES
from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, RoleAssignment
from remoras.plugins import answer, faults_of
from remoras.work import Point, Work

Statable = tuple[str, str, str | float | bool]
"""(subject, attribute, value) of a fact, by names."""

JOB_DONE = DONE
"""Key of a declaration's messages: a vehicle has done a job; the attributes of the mission's jobs take its place."""
OBJECTIVE = OBJECTIVES
"""Key of a declaration's messages: a role is given an objective; the mission has an attribute for each kind."""
INFLUENCE_SIGNAL = "influence signal"
"""Key of a declaration's messages: one signed byte for every role that the sender plays, in every slot."""


@dataclass(frozen=True, slots=True)
class Declaration:
    """What a strategy is and what it takes from the vehicles.

    Attributes:
        source: the publication it follows.
        messages: what its vehicles tell each other to organise themselves: attributes of the core ontology,
            ``JOB_DONE``, ``OBJECTIVE`` or ``INFLUENCE_SIGNAL``, and what each says.
        planned_before: missions are planned, and objectives known to all, before the mission; else heads plan them
            and tell the others.
        communicates: vehicles send packets at all.
        influences: vehicles send influence signals.
        meets: vehicles speak at meetings only; who has no part in them takes nobody's silence for absence.
        blocks_per_round: most blocks that a vehicle states in a round of consultation, for each job.
        sharing: of no strategy that is ranked: the class, ``remoras.bound.InstantSharing``, by which the vehicles of an
            upper bound know what no packet told them.
        authorities: what members may change that do not lead their group; without any the head alone gives out roles.
        private_jobs: whoever takes a job notes it for itself alone; what others believe of that is nobody's error.
    """

    source: str
    messages: Mapping[str, str]
    planned_before: bool = True
    communicates: bool = True
    influences: bool = False
    meets: bool = False
    blocks_per_round: int = 0
    sharing: Any = None  # it knows vehicles, and vehicles their strategy
    authorities: frozenset[Authority] = frozenset()
    private_jobs: bool = False

    @property
    def tells(self) -> bool:
        """True if others come to know what a vehicle tells: by packets, or at once."""
        return self.communicates or self.sharing is not None


@dataclass(frozen=True, slots=True)
class Statement:
    """Facts that a vehicle states together.

    Attributes:
        told: to the others too; else the vehicle only notes them for itself.
    """

    facts: tuple[Statable, ...]
    told: bool = True


@dataclass(frozen=True, slots=True)
class Heard:
    """Facts that a peer stated together."""

    issuer: str
    time_s: float
    facts: tuple[Statable, ...]


@dataclass(frozen=True, slots=True)
class Situation:
    """What a vehicle knows at the end of a round of consultation.

    Attributes:
        now_s: time that what is stated now will bear.
        round: number of the TDMA frame that ends, from 1.
        work: jobs of the group and who does them, with the vehicle's own position as it is.
        rally_m: where the group meets, if it does.
        heard: what peers stated of the strategy's attributes and of roles, since the last round.
        heard_s: when a packet of each peer was last heard, or of when its newest report is that others have passed on;
            peers never heard of are missing.
        unheard: peers that have not acknowledged roles which this vehicle stated they play, and these roles by
            ``Group.Role``.
        calls: by peer, how dissatisfied it is by its last influence signal, above 0 to 1; contented ones are missing.
        links: by peer, what the links from and to it lose, as far as this vehicle can tell.
    """

    now_s: float
    round: int
    work: Work
    rally_m: Point | None
    heard: tuple[Heard, ...]
    heard_s: Mapping[str, float]
    unheard: Mapping[str, Collection[str]] = field(default_factory=dict)
    calls: Mapping[str, float] = field(default_factory=dict)
    links: Mapping[str, PeerLinks] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Move:
    """What a vehicle makes of a round.

    Attributes:
        statements: what it states.
        holding: the group still has work to hand out, so it does not count as gathered.
        silent: the vehicle sends nothing; what it has to tell waits.
        expected: peers whose silence means nothing now: their lease begins when they are expected no longer.
        until_news: the vehicle has nothing to state, and would answer the same to any situation with the same roles in
            which nothing is heard and nobody is unheard: it is not asked before.
    """

    statements: tuple[Statement, ...] = ()
    holding: bool = False
    silent: bool = False
    expected: Collection[str] = ()
    until_news: bool = False


class Negotiator(Protocol):
    """One vehicle's part in dividing the jobs of one group; it keeps what it has heard.

    Where members keep to themselves who does what (``Declaration.private_jobs``), a negotiator may have a second
    method, ``division() -> Mapping[str, str]``: names of the vehicles that are to do jobs, by role, as the messages of
    the strategy have told all. It is asked once the vehicle has heard nobody for a part of a lease; what it leaves out
    goes by what all knew before the mission.
    """

    def negotiate(self, situation: Situation) -> Move:
        """What to state now."""
        ...


class Strategy(Protocol):
    """An organisational strategy; its parameters are the fields of a frozen dataclass.

    All five members are compulsory. Strategies that differ only in how jobs are divided take ``form`` from
    ``remoras.strategies.founding`` and often ``adapt`` too::

        @dataclass(frozen=True, slots=True)
        class Mine:
            name: ClassVar[str] = "mine"
            declaration: ClassVar[Declaration] = Declaration(source="...", messages={JOB_DONE: "a job is done"})
            form = staticmethod(founded)
            adapt = staticmethod(common_roles)

            def negotiator(self, me: str, group: Group) -> Negotiator:
                return MyNegotiator(me, group)
    """

    @property
    def name(self) -> str:
        """Name by which results and figures show it."""
        ...

    @property
    def declaration(self) -> Declaration:
        """What it is and what it takes from the vehicles."""
        ...

    def form(self, database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
        """The organisation that is agreed before the mission: groups and their founding roles."""
        ...

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        """Roles that are allocated when the group's mission is planned, to members of the group only."""
        ...

    def negotiator(self, me: str, group: Group) -> Negotiator | None:
        """What ``me`` divides the jobs of ``group`` with during the mission; None if nothing is left to divide."""
        ...


def faults_of_strategy(found: Any) -> Iterator[str]:
    """What an object lacks to be a strategy, in words: parts, signatures, a name, a declaration."""
    yield from faults_of(found, Strategy, ("name", "declaration", "form", "adapt", "negotiator"))
    for part, expected in (("name", str), ("declaration", Declaration)):
        given = getattr(found, part, None)
        if given is not None and not isinstance(given, expected):
            yield f"{part} is {type(given).__name__}, expected {expected.__name__}"
    declaration = getattr(found, "declaration", None)
    if isinstance(declaration, Declaration) and declaration.sharing is not None:
        if not hasattr(declaration.sharing, "lease_frames"):
            yield f"declaration.sharing is {type(declaration.sharing).__name__}, expected the class InstantSharing"
        if declaration.communicates:
            yield "declaration.communicates is True: where all is known at once, a strategy sends no packets"


def form_groups(strategy: Strategy, database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
    """What ``strategy.form`` answers; raises PluginError if it raises or answers with something else."""
    return answer(
        f"strategy {strategy.name}",
        "form",
        "an Organisation",
        lambda found: isinstance(found, Organisation),
        lambda: strategy.form(database, groups),
    )


def adapt_roles(strategy: Strategy, work: Work) -> tuple[RoleAssignment, ...]:
    """What ``strategy.adapt`` answers, without roles that exclude what the vehicle plays or is given before.

    Raises:
        PluginError: it raises, or answers with something else.
    """
    found: tuple[RoleAssignment, ...] = answer(
        f"strategy {strategy.name}",
        "adapt",
        "a tuple of RoleAssignment",
        _are_assignments,
        lambda: strategy.adapt(work),
    )
    if not any(role.incompatible for role in work.group.roles):
        return found
    allowed, organisation = list[RoleAssignment](), work.organisation
    for assignment in found:
        role = work.group.role(assignment.role)
        if role is None or not organisation.is_excluded(assignment.vehicle, role):
            allowed.append(assignment)
            organisation, _ = organisation.assign(assignment.vehicle, assignment.group, assignment.role)
    return tuple(allowed)


def negotiator_of(strategy: Strategy, me: str, group: Group) -> Negotiator | None:
    """What ``strategy.negotiator`` answers; raises PluginError if it raises or answers with something else."""
    return answer(
        f"strategy {strategy.name}",
        "negotiator",
        "an object with negotiate(situation), or None",
        lambda found: found is None or callable(getattr(found, "negotiate", None)),
        lambda: strategy.negotiator(me, group),
    )


def ask(strategy: str, negotiator: Negotiator, situation: Situation) -> Move:
    """What a negotiator of ``strategy`` answers; raises PluginError if it raises or answers with something else."""
    expected = "a Move with statements of (subject, attribute, value)"
    return answer(f"strategy {strategy}", "negotiate", expected, _is_move, lambda: negotiator.negotiate(situation))


def division_of(strategy: str, negotiator: Negotiator) -> Mapping[str, str]:
    """What a negotiator's ``division`` answers, nothing if it has none; raises PluginError as ``ask`` does."""
    division = getattr(negotiator, "division", None)
    if division is None:
        return {}
    found: Mapping[str, str] = answer(
        f"strategy {strategy}", "division", "a mapping of names of roles to names of vehicles", _is_division, division
    )
    return found


def _is_division(found: Any) -> bool:
    return isinstance(found, Mapping) and all(isinstance(name, str) for pair in found.items() for name in pair)


def _are_assignments(found: Any) -> bool:
    return isinstance(found, tuple) and all(isinstance(assignment, RoleAssignment) for assignment in found)


def _is_move(found: Any) -> bool:
    return (
        isinstance(found, Move)
        and isinstance(found.statements, tuple)
        and all(isinstance(said, Statement) and all(map(_is_statable, said.facts)) for said in found.statements)
    )


def _is_statable(fact: Any) -> bool:
    match fact:
        case (str(), str(), str() | float() | int()):
            return isinstance(fact, tuple)
    return False
