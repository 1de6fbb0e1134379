"""Sample inputs of the checks: random fleets, two kinds of jobs, a small mission."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

from missions.mapping import MappingMission
from missions.mapping.jobs import SurveyJob
from missions.mapping.sensors import SwathSettings
from missions.scenarios import Scenario, load
from remoras.beliefs import Key
from remoras.database import AUVDatabase, VehicleData
from remoras.decision_timeout import InTime
from remoras.organisation import Group, Organisation, RoleSpecification
from remoras.social.negotiation import negotiated_attributes
from remoras.strategy import Heard, Move, Negotiator, Situation, Statement, Strategy
from remoras.work import Job, Outlook, Point, Work
from worldmodel import Attribute, ValueKind, core_ontology_paths, ontology_path, read_tbox

ROLES = ("playsRole", "leftRole")


@dataclass(frozen=True)
class Visit:
    """Stay at a place: a job of another kind than a survey."""

    name: str
    place_m: Point
    stay_s: float = 60.0
    needs: tuple[str, ...] = ()
    greatest_depth_m: float = 0.0

    @property
    def done(self) -> Key:
        """Completion fact."""
        return "jobDone", self.name

    def is_able(self, data: VehicleData) -> bool:
        """True for a vehicle with sufficient depth limit."""
        return data.depth_limit_m >= self.greatest_depth_m

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """Time and place after the visit; None if unable."""
        return outlook.stayed(self.place_m, self.stay_s, data) if self.is_able(data) else None


TBOX = read_tbox(*core_ontology_paths(), ontology_path("help"), *MappingMission.vocabulary)

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
"""Two kinds of jobs; one visit needs another, and some exceed the depth limit of vehicles."""
SWATHS_M = st.sampled_from([(25.0,), (20.0,), ()])
POINTS_M = st.tuples(st.floats(-300.0, 300.0), st.floats(-300.0, 300.0))


@st.composite
def vehicles(draw: st.DrawFn, name: str) -> VehicleData:
    """Sample a vehicle."""
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
    """Sample a fleet of one to five vehicles with any roles; some lack a sensor."""
    return AUVDatabase(tuple(draw(vehicles(name)) for name in NAMES[: draw(st.integers(1, len(NAMES)))]))


@st.composite
def works_of(
    draw: st.DrawFn, group: Group, organisation: Organisation, database: AUVDatabase, jobs: Mapping[str, Job]
) -> Work:
    """Sample known positions and finished jobs."""
    positions_m = draw(st.dictionaries(st.sampled_from(database.names), POINTS_M))
    done = draw(st.frozensets(st.sampled_from(sorted(jobs)), max_size=1))
    return Work(group, organisation, database, jobs, done, positions_m)


@st.composite
def organisations(draw: st.DrawFn, formed: Organisation, database: AUVDatabase) -> Organisation:
    """Sample additional job roles of members in ``formed``."""
    for group in GROUPS:
        for name in formed.members(group.name):
            for role in group.roles:
                if role.job is not None and database[name].can_play(group.name, role.name) and draw(st.booleans()):
                    formed, _ = formed.assign(name, group.name, role.name)
    return formed


def _instances(of_class: int, database: AUVDatabase) -> Sequence[str]:
    return {
        "Vehicle": database.names,
        "Role": [*FULL_ROLES, *3 * [f"Operational.{role}" for role in ALLOCATED]],  # negotiated roles are more frequent
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
    """Sample any facts valid in the ontology, from any sender: the exchange filters no others."""
    kinds = []
    for attribute in map(TBOX.attribute_named, negotiated_attributes(strategy, jobs, TBOX)):
        subjects = list(_instances(attribute.domain, database))
        # Replies to own statements are more frequent.
        subjects += 3 * [name for name in mentioned if name in subjects]
        fact = st.tuples(st.sampled_from(subjects), st.just(attribute.name), _value(attribute, database))
        kinds.append(fact)
    facts = st.lists(st.one_of(kinds), min_size=1, max_size=3).map(tuple)
    message = st.builds(Heard, st.sampled_from(database.names), st.floats(0.0, 100.0), facts)
    return st.lists(message, max_size=9).map(tuple)


# A small mission ----------------------------------------------------------------------------------


def small_patches(name: str, *settings: str) -> Scenario:
    """Load a scenario with six patches and a strategy."""
    file = Path(__file__).with_name("small-patches.toml")
    return load(str(file), [("--set", setting) for setting in (f"strategy.name={name}", *settings)])


class Watched(InTime):
    """Strategy wrapper that records all moves of its negotiators."""

    def __init__(self, strategy: Strategy) -> None:
        super().__init__(strategy)
        self.moves: list[tuple[str, str, Situation, Move]] = []
        """(vehicle, group, situation, move)"""

    def negotiator(self, me: str, group: Group) -> Negotiator | None:
        made = super().negotiator(me, group)
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


def role_facts(statements: Sequence[Statement]) -> Iterator[tuple[str, str, str, str]]:
    """Yield (vehicle, attribute, group, role) of all statements on roles."""
    for statement in statements:
        for subject, attribute, value in statement.facts:
            if attribute in ROLES:
                group, _, role = str(value).partition(".")
                yield subject, attribute, group, role
