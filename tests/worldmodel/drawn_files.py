"""OWL files drawn at random of what is taken: expressions within each other, links that hang together, and facts."""

import random

from constructs import DEEP, DOUBLE, FACTS, PREFIXES, VALUES, WORDS, joined, on, within

CLASSES = ("Field", "DeepField", "Harbour", "Well", "Pump", "Valve", "Gear", "Found")
THINGS = ("north", "W1", "W2", "G1")
LINKS = ("in", "feeds", "near")
OF_LINKS = (
    "ex:in a owl:FunctionalProperty .",
    "ex:near a owl:SymmetricProperty .",
    "ex:near a owl:InverseFunctionalProperty .",
    "ex:works a owl:FunctionalProperty .",
    "ex:feeds owl:inverseOf ex:in .",
    "ex:in rdfs:subPropertyOf ex:near .",
    "ex:serves owl:propertyChainAxiom ( ex:in ex:near ) .",
    "ex:Well owl:disjointWith ex:Field .",
    "ex:Gear owl:disjointUnionOf ( ex:Pump ex:Valve ) .",
)
OF_VALUES = (
    on("depth", f"owl:someValuesFrom {DEEP}"),
    on("depth", f"owl:allValuesFrom {within('double', maxInclusive=DOUBLE.format(250))}"),
    on("works", "owl:hasValue true"),
    on("works", "owl:hasValue false"),
    on("state", 'owl:hasValue "open"'),
    on("count", f"owl:someValuesFrom {within('integer', minExclusive='2')}"),
    on("works", "owl:maxCardinality 1"),
)


def expression(rng: random.Random, depth: int = 2) -> str:
    """Return a class or an expression, with expressions in it."""
    kinds = ("class", "or", "and", "not", "some", "only", "has", "count", "one", "value") if depth else ("class",)
    kind, link = rng.choice(kinds), rng.choice(LINKS)
    if kind in ("or", "and"):
        how = "unionOf" if kind == "or" else "intersectionOf"
        return joined(how, expression(rng, depth - 1), expression(rng, depth - 1))
    if kind == "not":
        return f"[ a owl:Class ; owl:complementOf {expression(rng, depth - 1)} ]"
    if kind in ("some", "only"):
        how = "someValuesFrom" if kind == "some" else "allValuesFrom"
        return on(link, f"owl:{how} {expression(rng, depth - 1)}")
    if kind == "has":
        return on(link, f"owl:hasValue ex:{rng.choice(THINGS)}")
    if kind == "count":
        return on(link, rng.choice(("owl:maxCardinality 0", "owl:maxCardinality 1", "owl:minCardinality 1")))
    if kind == "one":
        return joined("oneOf", *(f"ex:{thing}" for thing in rng.sample(THINGS, 2)))
    return rng.choice(OF_VALUES) if kind == "value" else f"ex:{rng.choice(CLASSES)}"


def drawn_file(seed: int) -> str:
    """Return a file in Turtle."""
    rng = random.Random(seed)
    axioms = []
    for _ in range(rng.randint(2, 4)):
        draw = rng.random()
        if draw < 0.3:
            axioms.append(f"ex:{rng.choice(('Found', 'Harbour'))} owl:equivalentClass {expression(rng)} .")
        elif draw < 0.7:
            axioms.append(
                f"ex:{rng.choice(('Well', 'Field', 'DeepField', 'Pump'))} rdfs:subClassOf {expression(rng)} ."
            )
        else:
            axioms.append(rng.choice(OF_LINKS))
    links = (f"ex:{rng.choice(THINGS)} ex:{rng.choice(LINKS)} ex:{rng.choice(THINGS)} ." for _ in range(3))
    facts = " ".join(("ex:G1 a ex:Pump .", rng.choice(("", VALUES)), *links))
    return "\n".join((PREFIXES, WORDS, FACTS, facts, *axioms, ""))
