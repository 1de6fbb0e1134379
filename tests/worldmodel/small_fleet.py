"""A fleet of three vehicles, small enough for blocks drawn at random to contradict one another often."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

from worldmodel import (
    TYPE_UID,
    Block,
    Instance,
    Keeping,
    PropertyValue,
    TBox,
    Value,
    ValueKind,
    WorldModel,
    core_ontology_paths,
    merge,
    ontology_path,
    read_tbox,
)
from worldmodel.merge import CheckResult, check_fit, check_form
from worldmodel.ontology.fields import Grid

AREAS = Path(__file__).parent / "areas.ttl"
WRECKS = AREAS.with_name("wrecks.ttl")
TBOX = read_tbox(*core_ontology_paths(), ontology_path("bans"), AREAS, WRECKS)
N_ORIGINS = 3
PER_ORIGIN = 2
CLOCK = Grid(0.0, 0.1)


def class_uid(name: str) -> int:
    return TBOX.class_named(name).uid


def attribute_uid(name: str) -> int:
    return TBOX.attribute_named(name).uid


AUV, ASV, AREA, OBJECT = map(class_uid, ("AUV", "ASV", "Area", "ObjectOfInterest"))
WRECK, PIPELINE, AMPHORA = map(class_uid, ("Wreck", "Pipeline", "Amphora"))
POSITION, BATTERY, PLAYS_ROLE, AREA_DONE, CELL, CLASSIFICATION, LOCATION, COMPLETED, LENGTH, NEAR = map(
    attribute_uid,
    (
        "position",
        "batteryFraction",
        "playsRole",
        "areaDone",
        "mappedCell",
        "classification",
        "location",
        "missionCompleted",
        "length",
        "near",
    ),
)

BANNED_FROM = attribute_uid("bannedFrom")

INSTANCES = tuple(
    Instance(uid, class_uid(kind), name)
    for uid, (kind, name) in enumerate(
        [
            ("AUV", "auv-0"),
            ("AUV", "auv-1"),
            ("ASV", "asv-0"),
            ("Area", "bay"),
            ("Role", "explorer"),
            ("ObjectOfInterest", "echo"),
            ("Mission", "survey"),
        ]
    )
)
AUV_0, AUV_1, ASV_0, BAY, EXPLORER, ECHO, SURVEY = range(7)


def fleet_model(owner: int = 0, tbox: TBox = TBOX, **keeping: Any) -> WorldModel:
    kept = Keeping(**keeping)
    return WorldModel(
        tbox, owner, INSTANCES, n_origins=N_ORIGINS, run_time_instances_per_origin=PER_ORIGIN, keeping=kept
    )


def ban(model: WorldModel, origins: Iterable[int], from_s: float = 0.0) -> None:
    """Record bans of these origins by another one, of which at least one must remain."""
    banned = set(origins)
    issuer = next(origin for origin in range(N_ORIGINS) if origin not in banned)
    for n, origin in enumerate(sorted(banned)):
        merge(model, [block(issuer, 900 + n, 999, (origin, BANNED_FROM, from_s))])


def first_uid_of(origin: int) -> int:
    return len(INSTANCES) + origin * PER_ORIGIN


def block(origin: int, sequence: int, tick: int, *facts: tuple[int, int, Value], epoch: int = 0) -> Block:
    """A block at ``tick`` tenths of a second."""
    return Block(origin, sequence, CLOCK.value_at(tick), tuple(PropertyValue(*fact) for fact in facts), epoch)


def _values(attribute: int) -> st.SearchStrategy[Value]:
    kind, fields = TBOX.attributes[attribute].kind, TBOX.attributes[attribute].fields
    match kind:
        case ValueKind.TYPE:
            return st.sampled_from([OBJECT, WRECK, PIPELINE, AMPHORA, AUV])
        case ValueKind.LINK:
            return st.integers(0, len(INSTANCES) + N_ORIGINS * PER_ORIGIN - 1)
        case ValueKind.SYMBOL:
            return st.integers(0, len(TBOX.attributes[attribute].symbols) - 1)
        case ValueKind.BOOLEAN:
            return st.booleans()
        case ValueKind.NUMBER:
            return st.integers(0, 3).map(fields[0].decode)
        case ValueKind.POINT:
            return st.tuples(*(st.integers(0, 3).map(f.decode) for f in fields))


SUBJECTS = st.integers(0, len(INSTANCES) + N_ORIGINS * PER_ORIGIN - 1)
_OBJECTS = st.integers(ECHO, len(INSTANCES) + N_ORIGINS * PER_ORIGIN - 1)
_FACTS: st.SearchStrategy[tuple[int, int, Value]] = st.one_of(
    st.sampled_from([BATTERY, AREA_DONE, LOCATION, LENGTH, NEAR, COMPLETED, POSITION]).flatmap(
        lambda a: st.tuples(SUBJECTS, st.just(a), _values(a))
    ),
    st.sampled_from([LOCATION, LENGTH, NEAR]).flatmap(lambda a: st.tuples(_OBJECTS, st.just(a), _values(a))),
    st.tuples(_OBJECTS, st.just(TYPE_UID), _values(TYPE_UID)),
)

any_blocks = st.lists(
    st.builds(
        lambda origin, sequence, tick, facts, epoch: block(origin, sequence, tick, *facts, epoch=epoch),
        st.integers(0, N_ORIGINS - 1),
        st.integers(0, 3),
        st.integers(0, 5),
        st.lists(_FACTS, min_size=1, max_size=3),
        st.sampled_from([0, 0, 0, 1]),
    ),
    max_size=14,
)
"""Items of good form: they may wait, clash, or use a GUID twice."""


@st.composite
def sound_blocks(draw: st.DrawFn) -> list[Block]:
    """Blocks that all go in, in the order in which their origins recorded them."""
    models = [fleet_model(owner) for owner in range(N_ORIGINS)]
    blocks = []
    for _ in range(draw(st.integers(0, 12))):
        origin = draw(st.integers(0, N_ORIGINS - 1))
        model = models[origin]
        choices: list[tuple[int, int, Value]] = [
            (AUV_0, BATTERY, draw(st.floats(0, 1))),
            (ECHO, LOCATION, (draw(st.floats(-9, 9)), 1.0)),
            (BAY, CELL, float(draw(st.integers(0, 4095)))),
            (BAY, AREA_DONE, ASV_0),
            (ECHO, CLASSIFICATION, draw(st.integers(0, 3))),
            (SURVEY, COMPLETED, draw(st.booleans())),
            (AUV_1, PLAYS_ROLE, EXPLORER),
        ]
        facts = draw(st.lists(st.sampled_from(choices), min_size=1, max_size=3))
        if draw(st.booleans()) and (created := sum(b.facts[0].attribute == TYPE_UID for b in model.blocks())) < 2:
            uid = first_uid_of(origin) + created
            facts = [(uid, TYPE_UID, WRECK), (uid, LENGTH, 12.0), (ECHO, NEAR, uid), *facts]
        blocks.append(model.record(facts, draw(st.integers(0, 9)) / 10).block)
    return blocks


def picture(model: WorldModel) -> tuple[object, ...]:
    """All that a model answers, for comparing two of them."""
    slots = [(uid, a.uid) for uid in range(model.n_uids) for a in TBOX.attributes]
    return (
        model.state_hash(),
        list(model.blocks()),
        list(model.statuses()),
        model.digest(),
        dict(model.banned),
        [model.latest(*slot) for slot in slots],
        [tuple(model.history(*slot)) for slot in slots],
        [model.instance(uid) for uid in range(model.n_uids)],
        [model.class_mask(uid) for uid in range(model.n_uids)],
        [model.instances_of(c.uid) for c in TBOX.classes],
        sorted(model.arrivals.waiting | model.arrivals.refused),
    )


def codes(faults: Iterable[object]) -> list[str]:
    return [fault.code.name for fault in faults]  # type: ignore[attr-defined]


def check(model: WorldModel, checked: Block) -> CheckResult:
    """Both checks of a block, as merge makes them."""
    faults = check_form(model, checked)
    return CheckResult(faults) if faults else check_fit(model, checked)
