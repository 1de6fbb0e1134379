"""Sample inputs of the checks: random fleets, a small mission, negotiators over a scripted exchange of statements.

Facts that the exchange acknowledges (roles, jobs that are done) are repeated until they get through; of all others the
latest on a subject is what counts, and it is lost unless it gets through at once. The jobs may be of any kind.
"""

import copy
import math
import tempfile
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tomli_w
from hypothesis import strategies as st

from exchange.acoustics.channel import Arrival
from missions.mapping import MappingMission
from missions.mapping.jobs import SurveyJob
from missions.mapping.sensors import SwathSettings
from missions.scenarios import Scenario, load, shipped
from remoras.beliefs import Key
from remoras.database import AUVDatabase, VehicleData
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.social.negotiation import negotiated_attributes
from remoras.strategy import (
    Declaration,
    Heard,
    Move,
    Negotiator,
    Situation,
    Statable,
    Statement,
    Strategy,
    adapt_roles,
    ask,
)
from remoras.work import Job, Outlook, Point, Work, precedence
from worldmodel import Attribute, ValueKind, core_ontology_paths, read_tbox

ROUND_S = 10.0
ROLES = ("playsRole", "leftRole")
RALLY_M = (0.0, 0.0)

Lost = Callable[[int, str, str], bool]
"""(round, sender, receiver) -> is what is sent then lost?"""


def never(number: int, sender: str, receiver: str) -> bool:
    """Lose nothing."""
    return False


@dataclass(frozen=True)
class Visit:
    """Going to a place and staying there for a while: a job of another kind than a survey."""

    name: str
    place_m: Point
    stay_s: float = 60.0
    needs: tuple[str, ...] = ()
    greatest_depth_m: float = 0.0

    @property
    def done(self) -> Key:
        """The fact that says that it is done."""
        return "jobDone", self.name

    def is_able(self, data: VehicleData) -> bool:
        """True for a vehicle that may dive so deep."""
        return data.depth_limit_m >= self.greatest_depth_m

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """When and where a vehicle is free after the visit; None if it is not able to make it."""
        if not self.is_able(data):
            return None
        way_s = math.dist(outlook.position_m, self.place_m) / data.transit_speed_mps
        return Outlook(outlook.free_s + way_s + self.stay_s, self.place_m)


def surveys(squares_m: Sequence[Point]) -> list[Job]:
    """Surveys of squares of 100 m, by their south-western corners."""
    return [
        SurveyJob(f"job {n}", ((x, y), (x, y + 100.0), (x + 100.0, y + 100.0), (x + 100.0, y)))
        for n, (x, y) in enumerate(squares_m)
    ]


def visits(places_m: Sequence[Point]) -> list[Job]:
    """Visits in any order."""
    return [Visit(f"job {n}", place_m) for n, place_m in enumerate(places_m)]


def ordered_visits(places_m: Sequence[Point]) -> list[Job]:
    """Visits of which every second one needs the one before it; the third of them needs the first too."""
    needs = {n: (f"job {n - 1}",) for n in range(1, len(places_m), 2)} | {2: ("job 0",)}
    return [Visit(f"job {n}", place_m, needs=needs.get(n, ())) for n, place_m in enumerate(places_m)]


def _vehicle(node: int, start_m: Point, playable_roles: tuple[str, ...]) -> VehicleData:
    return VehicleData(
        name=f"AUV{node:02d}",
        vehicle_type="AUV",
        node=node,
        social_layer=True,
        start_m=start_m,
        depth_m=20.0,
        depth_limit_m=100.0,
        transit_speed_mps=2.0,
        survey_speed_mps=1.5,
        turn_rate_radps=0.5,
        acceleration_mps2=0.5,
        energy_j=1.0e6,
        hotel_w=40.0,
        drag_w_per_mps3=15.0,
        transmit_j_per_bit=0.01,
        playable_roles=playable_roles,
        sensors=(SwathSettings(swath_m=25.0, speed_limit_mps=1.25),),
    )


KINDS_OF_JOBS: dict[str, Callable[[Sequence[Point]], list[Job]]] = {
    "surveys": surveys,
    "visits": visits,
    "ordered visits": ordered_visits,
}
"""Jobs of several kinds, made of places: a strategy divides them alike."""


@dataclass
class Member:
    """What one vehicle knows and does."""

    negotiator: Negotiator | None
    organisation: Organisation
    position_m: Point
    positions_m: dict[str, Point] = field(default_factory=dict)
    heard_s: dict[str, float] = field(default_factory=dict)
    heard: list[Heard] = field(default_factory=list)
    unheard: list[tuple[str, Heard]] = field(default_factory=list)  # acknowledged facts on their way, by receiver
    done: set[str] = field(default_factory=set)
    planned_on: frozenset[str] = frozenset()  # of the jobs that others need, those known done when it planned last
    at: tuple[str, float] | None = None  # job, and when it will have been done
    way: tuple[float, Point, Point] = (0.0, RALLY_M, RALLY_M)  # since when, from where and whereto it is at the job
    finished: list[str] = field(default_factory=list)


class Team:
    """Vehicles that do jobs; each is at the jobs of its roles one after another, the oldest first."""

    def __init__(self, strategy: Strategy, starts_m: Sequence[Point], jobs: Sequence[Job], lost: Lost) -> None:
        roles = tuple(RoleSpecification(f"Role{n}", 1, 1, job=job.name) for n, job in enumerate(jobs))
        head = RoleSpecification("Head", 1, 1, head=True, founding=True)
        self.group = Group("Team", (head, RoleSpecification("Hand", 1, founding=True), *roles), "rally")
        self.database = AUVDatabase(
            tuple(
                _vehicle(n, start_m, ("Head" if n == 0 else "Hand", *(role.name for role in roles)))
                for n, start_m in enumerate(starts_m)
            )
        )
        self.jobs = {job.name: job for job in jobs}
        self.too_early: list[str] = []
        """Jobs that somebody began before what they need was done."""
        self._strategy, self._lost, self._round = strategy, lost, 0
        organisation = strategy.form(self.database, [self.group])
        for assignment in strategy.adapt(Work(self.group, organisation, self.database, self.jobs)):
            organisation, _ = organisation.assign(assignment.vehicle, assignment.group, assignment.role)
        self.members = {
            name: Member(strategy.negotiator(name, self.group), organisation, data.start_m)
            for name, data in self.database.items()
        }

    @property
    def done(self) -> bool:
        """True once all jobs are done."""
        return set(self.finished) == set(self.jobs)

    @property
    def finished(self) -> Counter[str]:
        """How often each job was done."""
        return Counter(job for member in self.members.values() for job in member.finished)

    def run(self, rounds: int) -> None:
        """Let all negotiate for so many rounds."""
        for _ in range(rounds):
            self.round()

    def round(self) -> None:
        """One TDMA frame: all state something, all that is not lost is heard, all move on."""
        self._round += 1
        now_s = ROUND_S * self._round
        told = {name: self._stated(name, member, now_s) for name, member in self.members.items()}
        for name, member in self.members.items():
            told[name] += self._planned(name, member, now_s)
            told[name] += self._progress(name, member, now_s)
        declaration = self._strategy.declaration
        if not declaration.tells:
            return
        for name, sender in self.members.items():
            sender.unheard += [(r, h) for h in told[name] if self._is_kept(h) for r in self.members if r != name]
            for receiver, member in self.members.items():
                if receiver != name and not (declaration.communicates and self._lost(self._round, name, receiver)):
                    due = [heard for to, heard in sender.unheard if to == receiver]
                    sender.unheard = [(to, heard) for to, heard in sender.unheard if to != receiver]
                    member.heard_s[name], member.positions_m[name] = now_s, sender.position_m
                    for heard in due + [heard for heard in told[name] if not self._is_kept(heard)]:
                        self._hear(member, heard)

    def _work(self, name: str, member: Member) -> Work:
        positions_m = {**member.positions_m, name: member.position_m}
        return Work(self.group, member.organisation, self.database, self.jobs, frozenset(member.done), positions_m)

    def _stated(self, name: str, member: Member, now_s: float) -> list[Heard]:
        if member.negotiator is None:
            return []
        heard, member.heard = tuple(member.heard), []
        work = self._work(name, member)
        situation = Situation(now_s, self._round, work, RALLY_M, heard, dict(member.heard_s))
        told = []
        for statement in ask(self._strategy.name, member.negotiator, situation).statements:
            for fact in statement.facts:
                self._take(member, fact)
            if statement.told:
                told.append(Heard(name, now_s, statement.facts))
        return told

    def _planned(self, name: str, member: Member, now_s: float) -> list[Heard]:
        """The head plans anew, as a social layer does, when a job is done that others need."""
        needed = frozenset(job for _, job in precedence(self.group, self.jobs)) & member.done
        if needed == member.planned_on or name not in member.organisation.heads("Team"):
            return []
        member.planned_on = needed
        told = []
        for role in adapt_roles(self._strategy, self._work(name, member)):
            fact = role.vehicle, "playsRole", self.group.path(role.role)
            self._take(member, fact)
            told.append(Heard(name, now_s, (fact,)))
        return told

    def _progress(self, name: str, member: Member, now_s: float) -> list[Heard]:
        """Go on with the job at hand; what is finished is told."""
        held = [
            role.job
            for role in self.group.roles
            if role.job not in (None, *member.done) and member.organisation.plays(name, "Team", role.name)
        ]
        told = []
        if member.at is not None:
            since_s, (from_x_m, from_y_m), (x_m, y_m) = member.way
            gone = min(1.0, (now_s - since_s) / (member.at[1] - since_s)) if member.at[1] > since_s else 1.0
            member.position_m = from_x_m + gone * (x_m - from_x_m), from_y_m + gone * (y_m - from_y_m)
        if member.at is not None and member.at[0] in held and member.at[1] <= now_s:
            job = member.at[0]
            member.finished.append(job)
            member.done.add(job)
            held.remove(job)
            told.append(Heard(name, now_s, ((job, self.jobs[job].done[0], name),)))
        if member.at is None or member.at[0] not in held:
            member.at = None
            if held:
                begun = self.jobs[held[0] or ""]
                if not set(self.finished).issuperset(begun.needs):
                    self.too_early.append(begun.name)
                then = begun.after(Outlook(now_s, member.position_m), self.database[name])
                assert then is not None
                member.at, member.way = (begun.name, then.free_s), (now_s, member.position_m, then.position_m)
            else:
                member.position_m = RALLY_M
        return told

    def _hear(self, member: Member, heard: Heard) -> None:
        member.heard.append(heard)
        for fact in heard.facts:
            self._take(member, fact)

    def _take(self, member: Member, fact: Statable) -> None:
        subject, attribute, value = fact
        if attribute in ROLES:
            group, _, role = str(value).partition(".")
            change = member.organisation.assign if attribute == "playsRole" else member.organisation.leave_role
            member.organisation, _ = change(subject, group, role)
        elif self._is_done(fact):
            member.done.add(subject)

    def _is_done(self, fact: Statable) -> bool:
        return fact[0] in self.jobs and self.jobs[fact[0]].done == (fact[1], fact[0])

    def _is_kept(self, heard: Heard) -> bool:
        return heard.facts[0][1] in ROLES or self._is_done(heard.facts[0])


TBOX = read_tbox(*core_ontology_paths(), *MappingMission.vocabulary)

# Random fleets ------------------------------------------------------------------------------------

GROUPS = (
    Group("Coordination", (RoleSpecification("Tactician", 1, 1, head=True, founding=True),), "north pole"),
    Group(
        "Operational",
        (
            RoleSpecification("Coordinator", 1, 1, head=True, founding=True, played_by=("Coordination", "Tactician")),
            RoleSpecification("Performer", 1, founding=True),
            RoleSpecification("Cartographer", 1),
            RoleSpecification("LeftWinger", 1, 1, job="left"),
            RoleSpecification("RightWinger", 1, 1, job="right"),
            RoleSpecification("Sweeper", 1, 1, job="behind"),
        ),
        "south pole",
    ),
)
FOUNDERS = st.sampled_from(
    [("Performer",), ("Tactician", "Coordinator"), ("Tactician", "Coordinator", "Performer"), ()]
)
ALLOCATED = tuple(role.name for role in GROUPS[1].roles if not role.founding)
FULL_ROLES = tuple(f"{group.name}.{role.name}" for group in GROUPS for role in group.roles)
NAMES = tuple(f"AUV{number:02d}" for number in range(5))
SURVEYS: dict[str, Job] = {
    name: SurveyJob(name, ((x, y), (x, y + 100.0), (x + 100.0, y + 100.0), (x + 100.0, y)))
    for name, x, y in [("left", 100.0, 0.0), ("right", -200.0, 0.0), ("behind", 0.0, -200.0)]
}
VISITS: dict[str, Job] = {
    "left": Visit("left", (150.0, 50.0), greatest_depth_m=120.0),
    "right": Visit("right", (-150.0, 50.0), needs=("left",)),
    "behind": Visit("behind", (50.0, -150.0), stay_s=300.0),
}
WORLDS = {"surveys": SURVEYS, "visits": VISITS}
"""Jobs of two kinds; of the visits one needs another, and not every vehicle dives deep enough for all."""
SWATHS_M = st.sampled_from([(25.0,), (20.0,), ()])
POINTS_M = st.tuples(st.floats(-300.0, 300.0), st.floats(-300.0, 300.0))


@st.composite
def vehicles(draw: st.DrawFn, name: str) -> VehicleData:
    """Any vehicle."""
    return VehicleData(
        name=name,
        vehicle_type="AUV",
        node=int(name[-2:]),
        social_layer=draw(st.booleans()),
        start_m=draw(POINTS_M),
        depth_m=20.0,
        depth_limit_m=draw(st.sampled_from([100.0, 200.0])),
        transit_speed_mps=2.0,
        survey_speed_mps=1.5,
        turn_rate_radps=0.5,
        acceleration_mps2=0.5,
        energy_j=draw(st.sampled_from([1.0e6, 2.0e6])),
        hotel_w=40.0,
        drag_w_per_mps3=15.0,
        transmit_j_per_bit=0.01,
        playable_roles=(*draw(FOUNDERS), *draw(st.lists(st.sampled_from(ALLOCATED), unique=True))),
        sensors=tuple(SwathSettings(swath_m=s, speed_limit_mps=1.25) for s in draw(SWATHS_M)),
    )


@st.composite
def fleets(draw: st.DrawFn) -> AUVDatabase:
    """One to five vehicles, each able to play any roles or none, some without a sensor."""
    return AUVDatabase(tuple(draw(vehicles(name)) for name in NAMES[: draw(st.integers(1, len(NAMES)))]))


@st.composite
def works_of(
    draw: st.DrawFn, group: Group, organisation: Organisation, database: AUVDatabase, jobs: Mapping[str, Job]
) -> Work:
    """Positions of some vehicles are known, some jobs are done."""
    positions_m = draw(st.dictionaries(st.sampled_from(database.names), POINTS_M))
    done = draw(st.frozensets(st.sampled_from(sorted(jobs)), max_size=1))
    return Work(group, organisation, database, jobs, done, positions_m)


@st.composite
def organisations(draw: st.DrawFn, formed: Organisation, database: AUVDatabase) -> Organisation:
    """The organisation ``formed``, in which members have come to play further roles that they are able to play."""
    for group in GROUPS:
        for name in formed.members(group.name):
            for role in group.roles:
                if role.job is not None and database[name].can_play(group.name, role.name) and draw(st.booleans()):
                    formed, _ = formed.assign(name, group.name, role.name)
    return formed


def _instances(of_class: int, database: AUVDatabase) -> Sequence[str]:
    """Names of the instances of a class of the ontology."""
    return {
        "Vehicle": database.names,
        "Role": [*FULL_ROLES, *3 * [f"Operational.{role}" for role in ALLOCATED]],  # what is negotiated comes up often
        "Area": sorted(SURVEYS),
        "Job": sorted(SURVEYS),
        "Group": [group.name for group in GROUPS],
        "RallyPoint": ["north pole", "south pole"],
        "Mission": ["AreaMapping"],
    }.get(TBOX.classes[of_class].name, ["thing"])


def _value(attribute: Attribute, database: AUVDatabase) -> st.SearchStrategy[Any]:
    if attribute.kind is ValueKind.LINK:
        return st.sampled_from(_instances(attribute.range_class or 0, database))
    if attribute.kind is ValueKind.BOOLEAN:
        return st.booleans()
    bounds = attribute.fields[0]
    return st.integers(int(bounds.minimum), int(bounds.maximum))


def hearsay(
    strategy: Strategy, database: AUVDatabase, jobs: Mapping[str, Job], mentioned: Sequence[str]
) -> st.SearchStrategy[tuple[Heard, ...]]:
    """Any facts that the ontology allows, true or not, said by anybody: the exchange keeps out nothing else.

    Args:
        mentioned: what the vehicle has just spoken of itself; many answer to that.
    """
    kinds = []
    for attribute in map(TBOX.attribute_named, negotiated_attributes(strategy, jobs, TBOX)):
        subjects = list(_instances(attribute.domain, database))
        subjects += 3 * [name for name in mentioned if name in subjects]
        fact = st.tuples(st.sampled_from(subjects), st.just(attribute.name), _value(attribute, database))
        kinds.append(fact)
    said = st.lists(st.one_of(kinds), min_size=1, max_size=3).map(tuple)
    heard = st.builds(Heard, st.sampled_from(database.names), st.floats(0.0, 100.0), said)
    return st.lists(heard, max_size=9).map(tuple)


# A small mission ----------------------------------------------------------------------------------

N_PATCHES = 6
SHRUNK = 0.5
DURATION_S = 2400.0


def small_patches(name: str, *settings: str) -> Scenario:
    """Six of the thirteen patches of ``mapping-patches`` at half the scale, with the strategy of that name."""
    raw: dict[str, Any] = copy.deepcopy(tomllib.loads(shipped()["mapping-patches"].read_text(encoding="utf-8")))
    raw["area"] = raw["area"][::2][:N_PATCHES]
    for area in raw["area"]:
        area["corners_m"] = [[SHRUNK * x_m, SHRUNK * y_m] for x_m, y_m in area["corners_m"]]
    for rally in raw["rally_point"]:
        rally["position_m"] = [SHRUNK * x_m for x_m in rally["position_m"]]
    raw["world"]["cell_m"] *= SHRUNK
    raw["scenario"]["duration_s"] = DURATION_S
    kept = {area["name"] for area in raw["area"]}
    gone = set()
    for group in raw["group"]:
        gone |= {role["name"] for role in group["role"] if role.get("job", min(kept)) not in kept}
        group["role"] = [role for role in group["role"] if role["name"] not in gone]
    for vehicle in raw["vehicle"]:
        vehicle["playable_roles"] = [role for role in vehicle["playable_roles"] if role not in gone]
        if "sensor" in vehicle:
            vehicle["sensor"]["swath_m"] *= SHRUNK
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "small-patches.toml"
        file.write_text(tomli_w.dumps(raw), encoding="utf-8")
        return load(str(file), [("--set", setting) for setting in (f"strategy.name={name}", *settings)])


class Silent:
    """A channel that carries nothing."""

    def transmit(
        self, slot: int, sender: int, data: bytes, now_s: float, positions_m: Sequence[tuple[float, float]]
    ) -> list[Arrival]:
        """Let nobody hear it."""
        return []


@dataclass
class Watched:
    """The strategy, every move of its negotiators kept."""

    strategy: Strategy
    moves: list[tuple[str, str, Situation, Move]] = field(default_factory=list)
    """(vehicle, group, what it knew, what it made of it)"""

    @property
    def name(self) -> str:
        """Of the strategy."""
        return self.strategy.name

    @property
    def declaration(self) -> Declaration:
        """Of the strategy."""
        return self.strategy.declaration

    def form(self, database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
        """Let the strategy form the groups."""
        return self.strategy.form(database, groups)

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        """Let the strategy adapt roles."""
        return self.strategy.adapt(work)

    def negotiator(self, me: str, group: Group) -> Negotiator | None:
        """The negotiator of the strategy, of which each move is kept."""
        made = self.strategy.negotiator(me, group)
        return None if made is None else _WatchedNegotiator(made, me, group.name, self.moves)


@dataclass
class _WatchedNegotiator:
    negotiator: Negotiator
    me: str
    group: str
    moves: list[tuple[str, str, Situation, Move]]

    def negotiate(self, situation: Situation) -> Move:
        move = self.negotiator.negotiate(situation)
        self.moves.append((self.me, self.group, situation, move))
        return move


def role_facts(statements: Sequence[Statement]) -> Iterator[tuple[str, str, str]]:
    """(vehicle, group, role) of all that is stated about roles."""
    for statement in statements:
        for subject, attribute, value in statement.facts:
            if attribute in ("playsRole", "leftRole"):
                group, _, role = str(value).partition(".")
                yield subject, group, role
