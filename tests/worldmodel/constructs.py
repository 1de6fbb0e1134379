"""Small OWL files, each with an axiom or a few: what an OWL 2 DL reasoner says of each is beside.

A case is what it is about, facts, the axiom, and what refuses it, if anything does. Without the axiom the facts mean
what ``hermit.json`` has of them; with it, the same or something else, which it has too. Names are different things
there as here: HermiT is told so.
"""

from typing import NamedTuple

PREFIXES = """@prefix ex: <https://example.org/wells#> .
@prefix rm: <https://w3id.org/remoras/marine#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix swrl: <http://www.w3.org/2003/11/swrl#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
"""
LINK = "a owl:ObjectProperty ; rdfs:domain owl:Thing ; rdfs:range owl:Thing"
WORDS = f"""
ex:Field a owl:Class . ex:DeepField a owl:Class ; rdfs:subClassOf ex:Field . ex:Harbour a owl:Class .
ex:Well a owl:Class . ex:Pump a owl:Class . ex:Valve a owl:Class . ex:Gear a owl:Class .
ex:Pump rdfs:subClassOf ex:Gear . ex:Valve rdfs:subClassOf ex:Gear .
ex:in {LINK} . ex:feeds {LINK} . ex:near {LINK} . ex:serves {LINK} .
ex:depth a owl:DatatypeProperty ; rdfs:domain owl:Thing ; rdfs:range xsd:double ;
    rm:minimum 0 ; rm:maximum 1000 ; rm:resolution 0.5 .
ex:count a owl:DatatypeProperty ; rdfs:domain owl:Thing ; rdfs:range xsd:integer ;
    rm:minimum 0 ; rm:maximum 100 ; rm:resolution 1 .
ex:works a owl:DatatypeProperty ; rdfs:domain owl:Thing ; rdfs:range xsd:boolean .
ex:state a owl:DatatypeProperty ; rdfs:domain owl:Thing ; rdfs:range [ a rdfs:Datatype ; owl:oneOf ( "open" "shut" ) ] .
ex:label a owl:DatatypeProperty ; rdfs:domain owl:Thing ; rdfs:range xsd:string ; rm:maxBytes 20 .
ex:Found a owl:Class .
"""
FACTS = """
ex:north a ex:Field . ex:W1 a ex:Well ; ex:in ex:north . ex:W2 a ex:Well .
"""


class Case(NamedTuple):
    """One axiom; ``refused`` is what the line that refuses it says, empty if it is taken.

    ``changes`` is False where nothing changes, neither here nor for HermiT; ``is_false`` is True where what is refused
    cannot be, by HermiT too: it is inconsistent, or a class of it is empty.
    """

    name: str
    facts: str
    axiom: str
    refused: str = ""
    changes: bool = True
    is_false: bool = False


def on(attribute: str, says: str) -> str:
    """Return a restriction."""
    return f"[ a owl:Restriction ; owl:onProperty ex:{attribute} ; {says} ]"


def found(expression: str) -> str:
    """Return a definition of the class Found."""
    return f"ex:Found owl:equivalentClass {expression} ."


def below(name: str, expression: str) -> str:
    """Return what all of a class are."""
    return f"ex:{name} rdfs:subClassOf {expression} ."


def joined(how: str, *parts: str) -> str:
    """Return an owl:intersectionOf, owl:unionOf or owl:oneOf."""
    return f"[ a owl:Class ; owl:{how} ( {' '.join(parts)} ) ]"


def within(datatype: str, **facets: str) -> str:
    """Return a restricted datatype."""
    listed = " ".join(f"[ xsd:{name} {value} ]" for name, value in facets.items())
    return f"[ a rdfs:Datatype ; owl:onDatatype xsd:{datatype} ; owl:withRestrictions ( {listed} ) ]"


SOME_FIELD = on("in", "owl:someValuesFrom ex:Field")
COMPLEMENT = "[ a owl:Class ; owl:complementOf ex:{} ]"
DEEP = within("double", minInclusive='"200"^^xsd:double')
VALUES = 'ex:W1 ex:depth "300"^^xsd:double ; ex:works true ; ex:state "open" ; ex:label "one" ; ex:count 3 .'
DOUBLE = '"{}"^^xsd:double'

CASES = (
    # individuals
    Case("individual", "", "ex:W3 a ex:Well ; ex:in ex:north ."),
    Case("individual with values", found(on("works", "owl:hasValue true")), "ex:W1 ex:works true ."),
    Case("individual of two classes in line", "", "ex:W3 a ex:DeepField , ex:Field , owl:NamedIndividual ."),
    Case("individual of two other classes", "", "ex:W1 a ex:Pump .", "W1: it is of 2 classes, none below the others"),
    Case("individual of an expression", "", f"ex:W1 a {SOME_FIELD} .", "W1: its class .* is not declared"),
    Case(
        "two values", "", f"ex:W1 ex:depth {DOUBLE.format(1)} , {DOUBLE.format(2)} .", "depth is .* and .*one literal"
    ),
    Case(
        "value of another datatype",
        "",
        "ex:W1 ex:depth 5 .",
        "W1: its depth is .*5.*; allowed: one literal of xsd:double",
    ),
    Case("value out of range", "", f"ex:W1 ex:depth {DOUBLE.format(-1)} .", "W1: its depth is .*-1"),
    Case("sameAs", "", "ex:W1 owl:sameAs ex:W2 .", "W1: owl:sameAs is not compiled"),
    Case("differentFrom", "", "ex:W1 owl:differentFrom ex:W2 .", changes=False),
    Case("AllDifferent", "", "[] a owl:AllDifferent ; owl:distinctMembers ( ex:W1 ex:W2 ) .", changes=False),
    Case("no class", "", "ex:W9 ex:in ex:north .", "W9: it has a value of ex:in, and is no individual"),
    Case("misspelt class", "", "ex:W9 a ex:Wel .", "W9: its class ex:Wel is not declared; did you mean 'Well'"),
    Case("misspelt attribute", "", "ex:W1 ex:inn ex:north .", "W1: ex:inn is not declared; did you mean 'in'"),
    Case("value of a class", "", "ex:Well ex:in ex:north .", "Well: it has a value of ex:in, and is no individual"),
    Case("nameless individual", "", "[] a ex:Well .", "it is an individual without a name"),
    Case(
        "negative assertion",
        "",
        "[] a owl:NegativePropertyAssertion ; owl:sourceIndividual ex:W2 ; owl:assertionProperty ex:in ; "
        "owl:targetIndividual ex:north .",
        "owl:NegativePropertyAssertion is not compiled",
    ),
    # classes
    Case("subClassOf", "", "ex:Well rdfs:subClassOf ex:Gear ."),
    Case("equivalent named class", "", "ex:Well owl:equivalentClass ex:Gear .", "same class as ex:"),
    Case("disjointWith", "", "ex:Well owl:disjointWith ex:Field ; rdfs:subClassOf ex:Gear ."),
    Case(
        "disjoint and both",
        below("Well", SOME_FIELD) + found(SOME_FIELD),
        "ex:Found owl:disjointWith ex:Well .",
        "Well",
        is_false=True,
    ),
    Case(
        "AllDisjointClasses",
        found(COMPLEMENT.format("Field")),
        "[] a owl:AllDisjointClasses ; owl:members ( ex:Well ex:Field ) .",
    ),
    Case(
        "disjointUnionOf",
        "ex:G1 a ex:Pump .",
        "ex:Gear owl:disjointUnionOf ( ex:Pump ex:Valve ) . " + found(COMPLEMENT.format("Valve")),
    ),
    Case("someValuesFrom", "", found(SOME_FIELD)),
    Case("someValuesFrom, necessary", found(on("in", "owl:someValuesFrom owl:Thing")), below("Well", SOME_FIELD)),
    Case(
        "someValuesFrom an expression",
        "",
        found(on("in", f"owl:someValuesFrom {joined('unionOf', 'ex:Field', 'ex:Harbour')}")),
    ),
    Case("intersectionOf", "", found(joined("intersectionOf", "ex:Well", SOME_FIELD))),
    Case("unionOf", "", found(joined("unionOf", "ex:Well", "ex:Pump"))),
    Case("unionOf, by cases", "ex:G1 a ex:Found .", found(joined("unionOf", "ex:Pump", "ex:Valve"))),
    Case(
        "unionOf, one left",
        "ex:G1 a ex:Found . ex:Well owl:disjointWith ex:Field . " + below("Found", "ex:Well"),
        below("Found", joined("unionOf", "ex:Field", "ex:Pump")),
    ),
    Case(
        "unionOf without equivalentClass",
        "",
        "ex:Found owl:unionOf ( ex:Well ex:Pump ) .",
        "owl:unionOf is not compiled",
    ),
    Case("complementOf", "ex:Well owl:disjointWith ex:Field .", found(COMPLEMENT.format("Field"))),
    Case(
        "complementOf, clash",
        "ex:D1 a ex:DeepField .",
        below("DeepField", COMPLEMENT.format("Field")),
        "DeepField",
        is_false=True,
    ),
    Case("oneOf", "", found(joined("oneOf", "ex:W1", "ex:north"))),
    Case(
        "oneOf, closed",
        "ex:W3 a ex:Found .",
        found(joined("oneOf", "ex:W1", "ex:W2")),
        "W3: no class is left",
        is_false=True,
    ),
    Case(
        "oneOf, what all are",
        "ex:W3 a ex:DeepField .",
        below("DeepField", joined("oneOf", "ex:W3")) + found("ex:DeepField"),
        "same class",
    ),
    Case(
        "oneOf of a class",
        "",
        found(joined("oneOf", "ex:Well", "ex:north")),
        "owl:oneOf names ex:Well, which is no individual",
    ),
    Case("allValuesFrom", "", below("Well", on("in", "owl:allValuesFrom ex:DeepField"))),
    Case(
        "allValuesFrom, clash",
        "ex:Harbour owl:disjointWith ex:Field .",
        below("Well", on("in", "owl:allValuesFrom ex:Harbour")),
        "north: it is",
        is_false=True,
    ),
    Case(
        "allValuesFrom with someValuesFrom",
        below("Well", on("feeds", "owl:someValuesFrom ex:Gear")) + found(on("feeds", "owl:someValuesFrom ex:Pump")),
        below("Well", on("feeds", "owl:allValuesFrom ex:Pump")),
    ),
    Case(
        "allValuesFrom, subsumed",
        below("Well", on("in", "owl:allValuesFrom ex:DeepField")),
        found(on("in", "owl:allValuesFrom ex:Field")),
    ),
    Case(
        "allValuesFrom, functional", "ex:in a owl:FunctionalProperty .", found(on("in", "owl:allValuesFrom ex:Field"))
    ),
    Case("hasValue individual", "", found(on("in", "owl:hasValue ex:north"))),
    Case("hasValue individual, necessary", found(SOME_FIELD), below("Well", on("in", "owl:hasValue ex:north"))),
    Case(
        "hasValue individual, on and on",
        "ex:in a owl:TransitiveProperty . ex:sea a ex:Field . ex:north ex:in ex:sea .",
        below("Well", on("in", "owl:hasValue ex:north")) + found(on("in", "owl:hasValue ex:sea")),
    ),
    Case(
        "allValuesFrom a union",
        "ex:Harbour owl:disjointWith ex:Field .",
        below("Well", on("in", f"owl:allValuesFrom {joined('unionOf', 'ex:DeepField', 'ex:Harbour')}")),
    ),
    Case(
        "complementOf a restriction",
        below("Pump", on("in", "owl:maxCardinality 0")) + "ex:P a ex:Pump .",
        found(f"[ a owl:Class ; owl:complementOf {SOME_FIELD} ]"),
    ),
    Case("unionOf restrictions", "", found(joined("unionOf", on("in", "owl:hasValue ex:north"), "ex:Pump"))),
    Case(
        "hasValue of nobody",
        "",
        found(on("in", "owl:hasValue ex:nort")),
        "names ex:nort, which is no individual.*'north'",
    ),
    Case("hasSelf", "", found(on("near", "owl:hasSelf true")), "its definition says owl:hasSelf"),
    Case("hasKey", "", "ex:Well owl:hasKey ( ex:label ) .", "Well: owl:hasKey is not compiled"),
    Case("anonymous subClassOf", "", f"{SOME_FIELD} rdfs:subClassOf ex:Found .", "of a class without a name"),
    Case("disjoint expression", "", f"ex:Found owl:disjointWith {SOME_FIELD} .", "the disjoint class"),
    # cardinalities
    Case("minCardinality 0", "", below("Well", on("in", "owl:minCardinality 0")), changes=False),
    Case("minCardinality 1", "", found(on("in", "owl:minCardinality 1"))),
    Case("minQualifiedCardinality 1", "", found(on("in", "owl:minQualifiedCardinality 1 ; owl:onClass ex:Field"))),
    Case("maxCardinality 0", "", below("Well", on("in", "owl:maxCardinality 0")), "W1: it is", is_false=True),
    Case(
        "maxCardinality 0, known",
        below("Pump", on("in", "owl:maxCardinality 0")) + " ex:P a ex:Pump .",
        found(on("in", "owl:allValuesFrom ex:Field")),
    ),
    Case(
        "maxQualifiedCardinality 0",
        found(COMPLEMENT.format("DeepField")),
        below("Well", on("in", "owl:maxQualifiedCardinality 0 ; owl:onClass ex:DeepField")),
    ),
    Case(
        "maxCardinality 1",
        "ex:south a ex:Field . ex:W1 ex:in ex:south .",
        below("Well", on("in", "owl:maxCardinality 1")),
        "W1: its links by in lead to 2",
        is_false=True,
    ),
    Case(
        "maxCardinality 1, what it is",
        below("Well", on("in", "owl:someValuesFrom ex:DeepField")),
        below("Well", on("in", "owl:maxCardinality 1")),
    ),
    Case(
        "cardinality 1",
        "",
        below("Well", on("in", "owl:qualifiedCardinality 1 ; owl:onClass owl:Thing"))
        + found(on("in", "owl:minCardinality 1")),
    ),
    Case(
        "cardinality 0",
        "",
        below("Pump", on("in", "owl:cardinality 0")) + "ex:P a ex:Pump ; ex:in ex:north .",
        "P: it is",
        is_false=True,
    ),
    Case(
        "cardinality 2",
        "",
        below("Well", on("in", "owl:minCardinality 2")),
        "owl:minCardinality of in is .*2.*; allowed: 0 or 1",
    ),
    Case(
        "maxQualifiedCardinality 1 of a part",
        "",
        below("Well", on("in", "owl:maxQualifiedCardinality 1 ; owl:onClass ex:Field")),
        "counts some of its values alone",
    ),
    # links
    Case(
        "FunctionalProperty",
        "ex:south a ex:Field . ex:W1 ex:in ex:south .",
        "ex:in a owl:FunctionalProperty .",
        "W1: its links by in lead to 2 things",
        is_false=True,
    ),
    Case(
        "FunctionalProperty, what it is",
        below("Well", on("in", "owl:someValuesFrom ex:DeepField")),
        "ex:in a owl:FunctionalProperty .",
    ),
    Case(
        "InverseFunctionalProperty",
        "ex:W2 ex:in ex:north .",
        "ex:in a owl:InverseFunctionalProperty .",
        "north: its links by in come from 2",
        is_false=True,
    ),
    Case("TransitiveProperty", "ex:sea a ex:Field . ex:north ex:in ex:sea .", "ex:in a owl:TransitiveProperty ."),
    Case("SymmetricProperty", "ex:W1 ex:near ex:W2 .", "ex:near a owl:SymmetricProperty ."),
    Case("inverseOf", "", "ex:serves owl:inverseOf ex:in ."),
    Case(
        "inverseOf and allValuesFrom",
        "ex:serves owl:inverseOf ex:in .",
        below("Field", on("serves", "owl:allValuesFrom ex:Found")),
    ),
    Case(
        "inverseOf for a class",
        "ex:serves owl:inverseOf ex:in . " + below("Harbour", on("serves", "owl:allValuesFrom ex:Found")),
        below("Well", on("in", "owl:someValuesFrom ex:Harbour")),
    ),
    Case("subPropertyOf", "", "ex:in rdfs:subPropertyOf ex:near ."),
    Case("chain", "ex:north ex:near ex:W2 .", "ex:serves owl:propertyChainAxiom ( ex:in ex:near ) ."),
    Case(
        "chain of three",
        "ex:north ex:near ex:W2 . ex:W2 ex:feeds ex:W1 .",
        "ex:serves owl:propertyChainAxiom ( ex:in ex:near ex:feeds ) .",
    ),
    Case(
        "chain of itself",
        "ex:sea a ex:Field . ex:north ex:in ex:sea .",
        "ex:in owl:propertyChainAxiom ( ex:in ex:in ) .",
    ),
    Case(
        "chain in a definition",
        "ex:north ex:near ex:W2 . ex:near rdfs:subPropertyOf ex:feeds .",
        "ex:serves owl:propertyChainAxiom ( ex:in ex:feeds ) . " + found(on("serves", "owl:hasValue ex:W2")),
    ),
    Case(
        "chain for a class",
        below("Well", on("in", "owl:someValuesFrom ex:Harbour"))
        + below("Harbour", on("near", "owl:someValuesFrom ex:Pump"))
        + found(on("serves", "owl:someValuesFrom ex:Pump")),
        "ex:serves owl:propertyChainAxiom ( ex:in ex:near ) .",
    ),
    Case(
        "chain that leads back", "", "ex:serves owl:propertyChainAxiom ( ex:serves ex:near ) .", "leads back to itself"
    ),
    Case("equivalentProperty", "", "ex:in owl:equivalentProperty ex:near .", "owl:equivalentProperty is not compiled"),
    Case(
        "propertyDisjointWith",
        "",
        "ex:in owl:propertyDisjointWith ex:near .",
        "owl:propertyDisjointWith is not compiled",
    ),
    Case(
        "AsymmetricProperty", "", "ex:in a owl:AsymmetricProperty .", "the type owl:AsymmetricProperty is not compiled"
    ),
    Case("two domains", "", "ex:in rdfs:domain ex:Well .", "in: 2 rdfs:domain"),
    Case(
        "FunctionalProperty that leads on",
        "ex:in a owl:TransitiveProperty .",
        "ex:in a owl:FunctionalProperty .",
        "in: one link is allowed, and links follow by transitivity",
    ),
    # values
    Case("hasValue literal", VALUES, found(on("state", 'owl:hasValue "open"'))),
    Case(
        "hasValue of another datatype",
        VALUES,
        found(on("depth", "owl:hasValue 300")),
        "owl:hasValue of depth is .*300.*; allowed: a literal",
    ),
    Case("some datatype", VALUES, found(on("label", "owl:someValuesFrom xsd:string"))),
    Case("minCardinality 1 of values", VALUES, found(on("depth", "owl:minCardinality 1"))),
    Case("facets", VALUES, found(on("depth", f"owl:someValuesFrom {DEEP}"))),
    Case(
        "facets, open",
        VALUES,
        found(on("count", f"owl:someValuesFrom {within('integer', minExclusive='2', maxExclusive='4')}")),
    ),
    Case(
        "facets, not met",
        VALUES,
        found(on("count", f"owl:someValuesFrom {within('integer', minExclusive='3')}")) + below("Valve", "ex:Found"),
    ),
    Case(
        "facets, necessary",
        found(on("depth", f"owl:someValuesFrom {within('double', minInclusive=DOUBLE.format(100))}")),
        below("Well", on("depth", f"owl:someValuesFrom {DEEP}")),
    ),
    Case(
        "facets as a check",
        VALUES,
        below("Well", on("depth", f"owl:allValuesFrom {within('double', maxInclusive=DOUBLE.format(100))}")),
        "W1: it is",
        is_false=True,
    ),
    Case(
        "facets of the range",
        "",
        "ex:W1 ex:flow 9 . ex:flow a owl:DatatypeProperty ; rdfs:domain ex:Well ; "
        f"rdfs:range {within('integer', minInclusive='0', maxInclusive='5')} ; "
        "rm:minimum 0 ; rm:maximum 100 ; rm:resolution 1 .",
        "W1: its flow is .*9",
        is_false=True,
    ),
    Case(
        "facets of another datatype",
        "",
        found(on("depth", f"owl:someValuesFrom {within('double', minInclusive='2')}")),
        "owl:someValuesFrom of depth is",
    ),
    Case(
        "length of texts",
        "",
        found(on("label", f"owl:someValuesFrom {within('string', minLength='2')}")),
        "owl:someValuesFrom of label is",
    ),
    Case("oneOf literals", VALUES, found(on("state", 'owl:someValuesFrom [ a rdfs:Datatype ; owl:oneOf ( "open" ) ]'))),
    Case(
        "functional values",
        VALUES + below("Well", on("works", "owl:hasValue false")),
        "ex:works a owl:FunctionalProperty .",
        "W1: it is",
        is_false=True,
    ),
    Case(
        "maxCardinality 1 of values",
        VALUES + below("Well", on("works", "owl:hasValue false")),
        below("Well", on("works", "owl:maxCardinality 1")),
        "W1: it is",
        is_false=True,
    ),
    Case(
        "maxCardinality 0 of values",
        VALUES,
        below("Well", on("works", "owl:maxCardinality 0")),
        "W1: it is",
        is_false=True,
    ),
    Case(
        "range that cannot be stored",
        "",
        "ex:at a owl:DatatypeProperty ; rdfs:domain ex:Well ; rdfs:range xsd:dateTime .",
        "its range xsd:dateTime cannot be stored",
    ),
    # the rest
    Case(
        "annotations",
        "",
        'ex:W1 rdfs:label "one" ; rdfs:comment "first" ; ex:note "x" . ex:note a owl:AnnotationProperty .',
        changes=False,
    ),
    Case("rules in SWRL", "", "[] a swrl:Imp ; swrl:body ( ) ; swrl:head ( ) .", "swrl:Imp is not compiled"),
    Case(
        "import of nothing",
        "",
        "<https://example.org/a> a owl:Ontology ; owl:imports <https://example.org/b> .",
        "imports <https://example.org/b>",
    ),
)


def text_of(case: Case, with_axiom: bool = True) -> str:
    """Return the file of a case in Turtle."""
    return f"{PREFIXES}{WORDS}{FACTS}{case.facts}\n{case.axiom if with_axiom else ''}\n"
