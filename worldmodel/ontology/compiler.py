"""OWL compiler: from Turtle files to the tables of a ``TBox`` or a list of faults.

``_ALLOWED`` lists all constructs; any other is refused by name. Annotations have no effect: labels, comments,
owl:AnnotationProperty, and vocabularies that share no namespace with the files. A class expression is an
owl:intersectionOf declared classes and restrictions, or a restriction: owl:someValuesFrom a declared class for a link,
owl:hasValue a literal for any other attribute. The range of an attribute gives the kind of its values:

    xsd:double, xsd:decimal, xsd:integer   NUMBER    needs rm:minimum, rm:maximum, rm:resolution; may have rm:unit
    rm:Point                               POINT     the same, for both axes
    xsd:boolean                            BOOLEAN
    owl:oneOf (a list of strings)          SYMBOL
    xsd:string                             TEXT      needs rm:maxBytes
    a declared class                       LINK

An individual has one most specific class, links to others, and at most one value of each other attribute. All vehicles
know these initially; a value holds until a vehicle records another. Names are unique: two names are two individuals.
"""

import math
import re
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence, Set
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import lru_cache
from itertools import combinations
from typing import Any

from rdflib import OWL, RDF, RDFS, XSD, BNode, Graph, Literal, Namespace, URIRef
from rdflib.collection import Collection
from rdflib.plugins.parsers.notation3 import BadSyntax
from rdflib.term import Node

from worldmodel.errors import OntologyError, suggestion
from worldmodel.ontology.axioms import Axioms, CompiledAxioms, Definition, ValueCondition
from worldmodel.ontology.fields import LONGEST_BYTES, Field, Value
from worldmodel.ontology.tbox import (
    MEASURED,
    TYPE_UID,
    Attribute,
    Individual,
    OntologyClass,
    Source,
    TBox,
    ValueKind,
    closure,
)

CORE, MARINE = URIRef("https://w3id.org/remoras/core"), URIRef("https://w3id.org/remoras/marine")
"""File that imports the core for other tools, and a core file: this import needs no file."""
SIT = Namespace("https://w3id.org/remoras/situation#")
RM = Namespace("https://w3id.org/remoras/marine#")
BOUNDS = (RM.minimum, RM.maximum, RM.resolution)
ANNOTATIONS = frozenset({*BOUNDS, RM.unit, RM.latestOnly, RM.sigma, RM.probability, RM.drift, RM.maxBytes})
SIGMAS = 64  # number of standard deviations of a value: multiples of ``rm:sigma`` in six bits

QUDT_UNITS = "http://qudt.org/vocab/unit/"
_SYMBOLS = {
    "M": "m",
    "SEC": "s",
    "M-PER-SEC": "m/s",
    "HZ": "Hz",
    "KiloHZ": "kHz",
    "BIT-PER-SEC": "bit/s",
    "DEG": "deg",
    "DEG_C": "degC",
    "PPM": "ppm",
    "L": "L",
    "J": "J",
    "W": "W",
    "DeciB": "dB",
    "PERCENT": "%",
}

_KINDS: dict[Node, ValueKind] = {
    **dict.fromkeys((XSD.double, XSD.decimal, XSD.integer), ValueKind.NUMBER),
    RM.Point: ValueKind.POINT,
    XSD.boolean: ValueKind.BOOLEAN,
    XSD.string: ValueKind.TEXT,
}
"""Kinds of values by range, except declared classes and lists of strings."""
_RANGES = (
    "xsd:double, xsd:decimal, xsd:integer, xsd:boolean, xsd:string, rm:Point, owl:oneOf (strings) or a declared class"
)
_TERMS = (OWL.Class, OWL.DatatypeProperty, OWL.ObjectProperty, OWL.AnnotationProperty, RDFS.Datatype)
_DEFINING = {
    *(RDF.type, RDFS.subClassOf, OWL.equivalentClass, OWL.disjointWith),
    *(RDFS.domain, RDFS.range, RDFS.subPropertyOf, OWL.inverseOf, *ANNOTATIONS),
}
"""Predicates that define their subject, in one file only; any file may annotate."""
_HARMLESS = {
    *(RDF.type, RDFS.label, RDFS.comment, RDFS.seeAlso, RDFS.isDefinedBy, OWL.versionInfo, OWL.versionIRI),
    *(OWL.deprecated, OWL.priorVersion, OWL.backwardCompatibleWith, OWL.incompatibleWith),
}
_ALLOWED: dict[str, tuple[Node, ...]] = {
    "a class": (OWL.Class, RDFS.subClassOf, OWL.equivalentClass, OWL.disjointWith),
    "a link": (
        *(OWL.ObjectProperty, RDFS.domain, RDFS.range, RDFS.subPropertyOf, OWL.inverseOf, OWL.TransitiveProperty),
        *(OWL.FunctionalProperty, OWL.InverseFunctionalProperty, *sorted(ANNOTATIONS)),
    ),
    "an attribute": (OWL.DatatypeProperty, RDFS.domain, RDFS.range, OWL.FunctionalProperty, *sorted(ANNOTATIONS)),
    "an individual": (OWL.NamedIndividual,),  # and the declared classes and attributes
    "what has no name": (
        *(OWL.Class, OWL.intersectionOf, OWL.Restriction, OWL.onProperty, OWL.someValuesFrom, OWL.hasValue),
        *(OWL.AllDisjointClasses, OWL.members, RDFS.Datatype, OWL.oneOf, OWL.onDatatype, OWL.withRestrictions),
    ),
    "anything else": (OWL.Ontology, OWL.AnnotationProperty, RDFS.Datatype, OWL.equivalentClass),
}
"""Allowed types and predicates by kind of subject, besides annotations."""
_EXPRESSIONS = (
    "owl:intersectionOf declared classes and restrictions; of a declared link owl:someValuesFrom a declared class, "
    "of another declared attribute owl:hasValue a literal of its datatype that is stored as it is"
)
_NAME, _OF_INDIVIDUAL = re.compile(r"[A-Za-z]\w*", re.ASCII), re.compile(r"[A-Za-z][\w-]*", re.ASCII)


@dataclass(frozen=True)
class Parsed:
    """Union of the files; ``definitions`` maps a term to its defining files, in order."""

    graph: Graph
    file_of: dict[Node, str]
    definitions: dict[Node, list[str]]


def parse_turtle(sources: Iterable[Source]) -> Parsed:
    """Parse the files into one graph; raises OntologyError for bad Turtle or missing imports."""
    union = Graph()
    file_of: dict[Node, str] = {}
    defining_files: dict[Node, list[str]] = {}
    faults: list[str] = []
    for source in sources:
        try:
            graph = _graph_of(source.text)
        except Exception as error:  # rdflib's parsers raise many kinds of errors
            faults.append(f"{source.path}: is not Turtle: {_reason(error)}; allowed: what Turtle 1.1 allows")
            continue
        for subject in graph.subjects(unique=True):
            file_of.setdefault(subject, source.path)
            if not _DEFINING.isdisjoint(graph.predicates(subject)):
                defining_files.setdefault(subject, []).append(source.path)
        for triple in graph:
            union.add(triple)
        for prefix, namespace in graph.namespaces():
            union.bind(prefix, namespace)
    if faults := faults or _unmet_imports(union, file_of):
        raise OntologyError(faults)
    union.remove((None, OWL.imports, None))
    terms = {subject for kind in _TERMS for subject in union.subjects(RDF.type, kind) if isinstance(subject, URIRef)}
    return Parsed(union, file_of, {term: files for term, files in defining_files.items() if term in terms})


@lru_cache(maxsize=64)  # half the time of a compilation; ontologies of a scenario share their files
def _graph_of(text: str) -> Graph:
    graph = Graph()
    graph.parse(data=text, format="turtle")
    deque((list(graph.items(node)) for node in graph.subjects(RDF.rest)), 0)  # a cyclic list raises
    return graph


@lru_cache(maxsize=8)  # 0.2 s to parse
def terminology(sources: tuple[Source, ...]) -> Graph:
    """Return the graph of the files without individuals, which world models hold as instances."""
    graph = parse_turtle(sources).graph
    for individual in list(_stated_subjects(graph, set(graph.subjects(RDF.type, OWL.Class)))):
        graph.remove((individual, None, None))
    return graph


@lru_cache(maxsize=8)  # 0.3 s
def compile_tbox(sources: tuple[Source, ...]) -> TBox:
    """Compile the files; raises OntologyError with all faults found."""
    parsed = parse_turtle(sources)
    if faults := sorted(_redefinitions(parsed)):
        raise OntologyError(faults)
    reader = _Reader(parsed)
    reader.refuse_others()
    reader.refuse_if_any()
    # Each stage reads the tables of the one before: its faults are reported first.
    classes, disjoint, attributes = reader.classes(), reader.disjoint_pairs(), reader.attributes()
    reader.refuse_if_any()
    axioms = reader.axioms(attributes)
    reader.refuse_if_any()
    classes = reader.classified(classes, attributes, axioms)
    individuals = reader.individuals(classes, attributes)
    tbox = TBox(tuple(classes), tuple(attributes), tuple(disjoint), sources, axioms, tuple(individuals))
    reader.refuse_contradictions(tbox)
    reader.refuse_if_any()
    return tbox


def _reason(error: Exception) -> str:
    if isinstance(error, BadSyntax):
        text = error._str.decode(errors="replace") if isinstance(error._str, bytes) else error._str
        here = " ".join(text[error._i :].split("\n")[0].split())
        return f"line {error.lines + 1}: {error._why}" + (f', at "{here[:60]}"' if here else "")
    return " ".join(str(error).split())


def _unmet_imports(union: Graph, file_of: dict[Node, str]) -> list[str]:
    read = {*union.subjects(RDF.type, OWL.Ontology), *union.objects(None, OWL.versionIRI)}
    allowed = ", ".join(sorted(map(str, union.subjects(RDF.type, OWL.Ontology))))
    return [
        f"{file_of[importing]}: it imports <{imported}>, which is not among the files read; "
        f"allowed: {allowed}{suggestion(str(imported), allowed.split(', '))}; name the file that holds it, too"
        for importing, imported in sorted(union.subject_objects(OWL.imports), key=str)
        if imported not in read and not (imported == CORE and MARINE in read)
    ]


def _redefinitions(parsed: Parsed) -> Iterator[str]:
    shown = parsed.graph.namespace_manager.normalizeUri
    allowed = (
        "one file that defines a term; leave that of the other file alone, and add a class below it "
        "(rdfs:subClassOf) or an attribute under a name of your own"
    )
    for term, (first, *others) in parsed.definitions.items():
        for other in others:
            yield f"{other}: {shown(str(term))}: it redefines a term of {first}; allowed: {allowed}"
    for axiom, members in parsed.graph.subject_objects(OWL.members):
        terms = [term for term in Collection(parsed.graph, members) if term in parsed.definitions]
        file = parsed.file_of[axiom]
        if terms and all(file not in parsed.definitions[term] for term in terms):
            names, first = ", ".join(shown(str(term)) for term in terms), parsed.definitions[terms[0]][0]
            yield f"{file}: {names}: it makes classes of {first} disjoint; allowed: {allowed}"


def _stated_subjects(graph: Graph, classes: Set[Node]) -> Iterator[Node]:
    for subject in set(graph.subjects(unique=True)) - classes:
        kinds = set(graph.objects(subject, RDF.type))
        if not str(subject).startswith(SIT) and (OWL.NamedIndividual in kinds or kinds & classes):
            yield subject


def _local_name(iri: str) -> str:
    return re.split(r"[#/:]", iri)[-1]


def _namespace(iri: Node) -> str:
    return str(iri)[: max(iri.rfind("#"), iri.rfind("/")) + 1] if isinstance(iri, URIRef) else ""


class _Reader:
    def __init__(self, parsed: Parsed) -> None:
        self.graph, self.file_of = parsed.graph, parsed.file_of
        self.faults: list[str] = []
        self.class_iris = sorted({*self._declared(OWL.Class), OWL.Thing})
        self.attribute_iris = self._declared(OWL.DatatypeProperty, OWL.ObjectProperty)
        self.class_uid: dict[Node, int] = {iri: uid for uid, iri in enumerate(self.class_iris)}
        self.stated = sorted(_stated_subjects(self.graph, self.class_uid.keys()), key=str)

    def _declared(self, *owl_types: URIRef) -> list[URIRef]:
        declared = {s for owl_type in owl_types for s in self.graph.subjects(RDF.type, owl_type)}
        return sorted(iri for iri in declared if isinstance(iri, URIRef) and not iri.startswith(SIT))

    # Faults --------------------------------------------------------------------------------------

    def fault(self, subject: Node, wrong: str, allowed: str) -> None:
        self.faults.append(f"{self.file_of.get(subject, 'TBox')}: {self.shown(subject)}: {wrong}; allowed: {allowed}")

    def refuse_if_any(self) -> None:
        if self.faults:
            raise OntologyError(sorted(set(self.faults)))

    def shown(self, term: Node) -> str:
        return term.n3(self.graph.namespace_manager) if isinstance(term, (URIRef, Literal)) else "[ ]"

    def hint(self, term: Node, known: Iterable[Node]) -> str:
        return suggestion(_local_name(str(term)), sorted(_local_name(str(each)) for each in known))

    def refuse_others(self) -> None:
        roles: dict[Node, str] = {
            **dict.fromkeys(self.stated, "an individual"),
            **{iri: "a link" if self._is_link(iri) else "an attribute" for iri in self.attribute_iris},
            **dict.fromkeys(self.class_iris, "a class"),
        }
        declared = {*self.class_iris, *self.attribute_iris, *ANNOTATIONS}
        own = {_namespace(term) for term in declared} - {str(OWL)}
        read = {str(OWL), str(RDFS), "http://www.w3.org/2003/11/swrl#", *own}
        harmless = {*_HARMLESS, *self.graph.subjects(RDF.type, OWL.AnnotationProperty)} - ANNOTATIONS
        situation = self.file_of.get(URIRef(str(SIT).rstrip("#")))
        for subject in sorted(self.graph.subjects(unique=True), key=str):
            if isinstance(subject, URIRef) and subject.startswith(SIT):
                if self.file_of[subject] != situation:
                    self.fault(subject, "it is in the namespace of the situation vocabulary", "one of your own")
                continue
            role = roles.get(subject, "what has no name" if isinstance(subject, BNode) else "anything else")
            allowed = {*_ALLOWED[role], *((*self.class_iris, *self.attribute_iris) if role == "an individual" else ())}
            stated = {*self.graph.predicates(subject), *self.graph.objects(subject, RDF.type)} - harmless
            wrong = next((t for t in sorted(stated - allowed, key=str) if _namespace(t) in read), None)
            if wrong is not None:
                names = ", ".join(map(self.shown, _ALLOWED[role]))
                more = ", declared classes and attributes" if role == "an individual" else ""
                is_unknown = _namespace(wrong) in own and wrong not in declared
                says = f"{self.shown(wrong)} is not {'declared' if is_unknown else 'compiled'}"
                hint = self.hint(wrong, {*allowed, *declared}) if is_unknown else ""
                self.fault(self._owner(subject), says, f"of {role} {names}{more}, and annotations{hint}")

    def _owner(self, node: Node) -> Node:
        front = [node]
        for above in front:  # grows during the iteration
            if isinstance(above, URIRef):
                return above
            front += [each for each in self.graph.subjects(None, above) if each not in front]
        return node

    def _refuse_names(self, iris: Sequence[URIRef], pattern: re.Pattern[str], taken: dict[str, URIRef]) -> None:
        places = {file: place for place, file in enumerate(dict.fromkeys(self.file_of.values()))}
        for iri in iris:
            name = _local_name(iri)
            if not pattern.fullmatch(name):
                allowed = "a letter, then letters, digits, " + ("_" if pattern is _NAME else "- and _")
                self.fault(iri, f"its name {name!r} is not an identifier", allowed)
            elif (other := taken.setdefault(name, iri)) != iri:
                # the later file is at fault
                first, later = sorted((other, iri), key=lambda each: places.get(self.file_of.get(each, ""), -1))
                where = f" in {self.file_of[first]}" if first in self.file_of else ""
                self.fault(later, f"its name {name!r} is that of <{first}>{where} too", "one IRI for each name")

    # Classes -------------------------------------------------------------------------------------

    def classes(self) -> list[OntologyClass]:
        self._refuse_names(self.class_iris, _NAME, {"Thing": OWL.Thing})
        thing, compiled = self.class_uid[OWL.Thing], []
        for iri, uid in self.class_uid.items():
            parents = set(self._parents_of(iri)) or ({thing} - {uid})
            compiled.append(OntologyClass(uid, _local_name(str(iri)), str(iri), tuple(sorted(parents))))
        # repeatedly remove classes without remaining parents; classes on or below a cycle stay
        remaining = {c.uid: set(c.parents) for c in compiled}
        while free := [uid for uid, parents in remaining.items() if not parents & remaining.keys()]:
            for uid in free:
                del remaining[uid]
        for uid in remaining:
            self.fault(self.class_iris[uid], "it is, or descends from, a superclass of itself", "a hierarchy")
        return compiled

    def _parents_of(self, iri: Node) -> Iterator[int]:
        for predicate in (RDFS.subClassOf, OWL.equivalentClass):
            for target in self.graph.objects(iri, predicate):
                if predicate == OWL.equivalentClass and target in self.class_uid:
                    self.fault(iri, f"it is the same class as {self.shown(target)}", "one name for a class")
                elif not isinstance(target, BNode) and not self._is_class(target):
                    relation = "superclass" if predicate == RDFS.subClassOf else "equivalent class"
                    wrong = f"its {relation} {self.shown(target)} is not declared"
                    self.fault(iri, wrong, f"a declared owl:Class{self.hint(target, self.class_uid)}")
                yield from (self.class_uid[part] for part in self._parts(target) if part in self.class_uid)

    def _is_class(self, term: Node) -> bool:
        return term == OWL.Thing or (isinstance(term, URIRef) and (term, RDF.type, OWL.Class) in self.graph)

    def _parts(self, expression: Node) -> list[Node]:
        listed = self.graph.value(expression, OWL.intersectionOf)
        return [expression] if listed is None else list(Collection(self.graph, listed))

    def disjoint_pairs(self) -> list[tuple[int, int]]:
        groups = [(a, [a, b]) for a, b in self.graph.subject_objects(OWL.disjointWith)]
        members = self.graph.subject_objects(OWL.members)
        groups += [(axiom, list(Collection(self.graph, listed))) for axiom, listed in members]
        pairs: list[tuple[int, int]] = []
        for subject, group in groups:
            for unknown in (term for term in group if not self._is_class(term)):
                wrong = f"the disjoint class {self.shown(unknown)} is not declared"
                self.fault(subject, wrong, f"declared classes{self.hint(unknown, self.class_iris)}")
            pairs += combinations([self.class_uid[term] for term in group if term in self.class_uid], 2)
        return sorted(pairs)

    def classified(
        self, classes: Sequence[OntologyClass], attributes: Sequence[Attribute], axioms: Axioms
    ) -> list[OntologyClass]:
        asserted = closure(classes)
        rules = CompiledAxioms(asserted, [(a.domain, a.range_class) for a in attributes], axioms)
        # An entailed link must not break the domain or range that checks assume.
        self._refuse_unlike_ends(rules, attributes)
        classified = []
        for c in classes:
            new = [d.uid for d in classes if (rules.superclasses[c.uid] & ~asserted[c.uid]) >> d.uid & 1]
            for other in new:
                if rules.superclasses[other] >> c.uid & 1:
                    wrong = f"the definitions make it the same class as {classes[other].name}"
                    self.fault(URIRef(c.iri), wrong, "one name for a class")
            classified.append(replace(c, parents=tuple(sorted({*c.parents, *new}))))
        self.refuse_if_any()
        return classified

    def _refuse_unlike_ends(self, rules: CompiledAxioms, attributes: Sequence[Attribute]) -> None:
        for attribute in attributes:
            for uid, flipped in rules.entailed[attribute.uid]:
                entailed = attributes[uid]
                ends = (attribute.domain, attribute.range_class)[:: -1 if flipped else 1]
                asked = {"domain": entailed.domain, "range": entailed.range_class}
                for end, (side, of_class) in zip(ends, asked.items(), strict=True):
                    if end is not None and of_class is not None and not rules.superclasses[end] >> of_class & 1:
                        turned = ", the other way round," if flipped else ""
                        wrong = f"it says {entailed.name}{turned} of what need not be of the {side} of {entailed.name}"
                        self.fault(URIRef(attribute.iri), wrong, "ends of the required classes")

    # Attributes ----------------------------------------------------------------------------------

    def attributes(self) -> list[Attribute]:
        self._refuse_names(self.attribute_iris, _NAME, {"type": RDF.type})
        built_in = Attribute(TYPE_UID, "type", str(RDF.type), self.class_uid[OWL.Thing], ValueKind.TYPE)
        compiled = (self._attribute(uid, iri) for uid, iri in enumerate(self.attribute_iris, start=TYPE_UID + 1))
        return [built_in, *(attribute for attribute in compiled if attribute)]

    def _is_link(self, iri: URIRef) -> bool:
        return (iri, RDF.type, OWL.ObjectProperty) in self.graph

    def _attribute(self, uid: int, iri: URIRef) -> Attribute | None:
        domain = self._one(iri, RDFS.domain, "one declared class")
        if domain is not None and domain not in self.class_uid:
            wrong = f"its domain {self.shown(domain)} is not declared"
            self.fault(iri, wrong, f"one declared class{self.hint(domain, self.class_iris)}")
        target = self._one(iri, RDFS.range, _RANGES)
        if target is None:
            return None
        listed = self.graph.value(target, OWL.oneOf)
        kind = _KINDS.get(target) or (ValueKind.LINK if target in self.class_uid else None)
        if kind is None and listed is None:
            self.fault(iri, f"its range {self.shown(target)} cannot be stored", _RANGES)
            return None
        kind = kind or ValueKind.SYMBOL
        if self._is_link(iri) is not (kind is ValueKind.LINK):
            owl_type = OWL.ObjectProperty if kind is ValueKind.LINK else OWL.DatatypeProperty
            self.fault(iri, f"its range makes it a {kind.value}", f"{self.shown(owl_type)} for such a range")
        stated = Annotations(self.graph, iri, kind, self.fault)
        fields = stated.fields(target)
        is_text = kind in {ValueKind.POINT, ValueKind.SYMBOL, ValueKind.TEXT}
        return Attribute(
            uid,
            _local_name(iri),
            str(iri),
            self.class_uid.get(domain or iri, 0),
            kind,
            fields,
            self.class_uid[target] if kind is ValueKind.LINK else None,
            self._symbols(iri, listed) if listed is not None and kind is ValueKind.SYMBOL else (),
            stated.latest_only,
            str(XSD.string) if is_text else "" if kind is ValueKind.LINK else str(target),
            stated.uncertainty(fields),
            stated.most_bytes,
            stated.drift,
        )

    def _one(self, iri: URIRef, predicate: URIRef, allowed: str) -> Node | None:
        terms = list(self.graph.objects(iri, predicate))
        if len(terms) != 1:
            self.fault(iri, f"{len(terms)} {self.shown(predicate)}", allowed)
            return None
        return terms[0]

    def _symbols(self, iri: URIRef, listed: Node) -> tuple[str, ...]:
        terms = list(Collection(self.graph, listed))
        symbols = tuple(str(term) for term in terms)
        is_text = [isinstance(term, Literal) and term.datatype in (None, XSD.string) for term in terms]
        if len(set(symbols)) < max(len(terms), 1) or not all(is_text):
            wrong = f"its symbols are ({' '.join(map(self.shown, terms))})"
            self.fault(iri, wrong, "different strings, at least one")
        return symbols

    # Axioms --------------------------------------------------------------------------------------

    def axioms(self, attributes: Sequence[Attribute]) -> Axioms:
        named: dict[Node, Attribute] = {URIRef(attribute.iri): attribute for attribute in attributes[1:]}
        definitions = [
            self._definition(iri, node, predicate == OWL.equivalentClass, named)
            for iri in self.class_iris
            for predicate in (RDFS.subClassOf, OWL.equivalentClass)
            for node in self.graph.objects(iri, predicate)
            if isinstance(node, BNode)
        ]
        inverses = {(min(pair), max(pair)) for pair in self._pairs(OWL.inverseOf, named)}
        return Axioms(
            tuple(sorted(definitions, key=repr)),
            tuple(sorted(inverses)),
            tuple(
                sorted(named[iri].uid for iri in self.graph.subjects(RDF.type, OWL.TransitiveProperty) if iri in named)
            ),
            tuple(sorted(self._pairs(RDFS.subPropertyOf, named))),
        )

    def _definition(self, iri: URIRef, node: Node, is_sufficient: bool, named: dict[Node, Attribute]) -> Definition:
        parts = self._parts(node)
        classes = [self.class_uid[part] for part in parts if part in self.class_uid]
        conditions = [self._condition(iri, part, named) for part in parts or [node] if part not in self.class_uid]
        kept = tuple(dict.fromkeys(each for each in conditions if each is not None))
        return Definition(self.class_uid[iri], tuple(dict.fromkeys(classes)), kept, is_sufficient)

    def _condition(self, iri: URIRef, node: Node, named: dict[Node, Attribute]) -> ValueCondition | None:
        says = sorted((p, o) for p, o in self.graph.predicate_objects(node) if p != RDF.type)
        by = dict(says)
        on, filler, literal = (by.get(p) for p in (OWL.onProperty, OWL.someValuesFrom, OWL.hasValue))
        attribute = named.get(on) if on is not None and len(says) == 2 else None
        if attribute is not None and attribute.kind is ValueKind.LINK and filler in self.class_uid:
            return ValueCondition(attribute.uid, filler=self.class_uid[filler])
        if attribute is not None and attribute.kind is not ValueKind.LINK and literal is not None:
            value = _stored(attribute, literal)
            if value is not None:
                return ValueCondition(attribute.uid, value=value)
        stated = ", ".join(f"{self.shown(p)} {self.shown(o)}" for p, o in says) or self.shown(node)
        unknown = [t for t in (node, on, filler) if isinstance(t, URIRef) and t not in {*named, *self.class_uid}]
        hint = self.hint(unknown[0], {*named, *self.class_uid}) if unknown else ""
        self.fault(iri, f"its definition says {stated}", f"{_EXPRESSIONS}{hint}")
        return None

    def _pairs(self, predicate: URIRef, named: dict[Node, Attribute]) -> Iterator[tuple[int, int]]:
        links = {iri for iri, attribute in named.items() if attribute.kind is ValueKind.LINK}
        for iri in links:
            for target in self.graph.objects(iri, predicate):
                if target in links:
                    yield named[iri].uid, named[target].uid
                else:
                    wrong = f"its {self.shown(predicate)} {self.shown(target)} is no link"
                    self.fault(iri, wrong, f"a declared owl:ObjectProperty{self.hint(target, links)}")

    # Individuals ---------------------------------------------------------------------------------

    def individuals(self, classes: Sequence[OntologyClass], attributes: Sequence[Attribute]) -> list[Individual]:
        above = closure(classes)
        class_of = {iri: uid for iri in self.stated if (uid := self._class_of(iri, above)) is not None}
        iris = [iri for iri in class_of if isinstance(iri, URIRef)]
        self._refuse_names(iris, _OF_INDIVIDUAL, {})
        made = []
        for iri in iris:
            links: list[tuple[int, str]] = []
            values: list[tuple[int, Value]] = []
            for attribute in attributes[1:]:
                terms = sorted(self.graph.objects(iri, URIRef(attribute.iri)), key=str)
                if terms and not above[class_of[iri]] >> attribute.domain & 1:
                    wrong = f"it is a {classes[class_of[iri]].name}, and {attribute.name} is of "
                    allowed = "attributes of its class and of those above it"
                    self.fault(iri, wrong + classes[attribute.domain].name, allowed)
                elif attribute.range_class is not None:
                    links += [(attribute.uid, self._target(iri, attribute, term, class_of, above)) for term in terms]
                elif terms:
                    value = _stored(attribute, terms[0])
                    if len(terms) > 1 or value is None:
                        datatype = self.shown(URIRef(attribute.datatype))
                        wrong = f"its {attribute.name} is {' and '.join(map(self.shown, terms))}"
                        self.fault(iri, wrong, f"one literal of {datatype} in its range and on its grid")
                    else:
                        values.append((attribute.uid, value))
            made.append(Individual(_local_name(iri), class_of[iri], tuple(links), tuple(values)))
        self._refuse_many(attributes)
        self.refuse_if_any()
        return sorted(made, key=lambda individual: individual.name)

    def _class_of(self, subject: Node, above: Sequence[int]) -> int | None:
        kinds = sorted(set(self.graph.objects(subject, RDF.type)) - {OWL.NamedIndividual}, key=str)
        if not isinstance(subject, URIRef):
            self.fault(subject, "it is an individual without a name", "individuals with an IRI")
            return None
        for kind in (kind for kind in kinds if kind not in self.class_uid):
            hint = self.hint(kind, self.class_uid)
            self.fault(subject, f"its class {self.shown(kind)} is not declared", f"one declared class{hint}")
            return None
        uids = {self.class_uid[kind] for kind in kinds}
        lowest = [c for c in uids if all(above[c] >> d & 1 for d in uids)]
        if not lowest:
            wrong = f"it is of {len(kinds)} classes, none below the others" if kinds else "it is of no class"
            self.fault(subject, wrong, "one declared class that implies its other classes")
            return None
        return lowest[0]

    def _target(
        self, iri: URIRef, attribute: Attribute, term: Node, class_of: dict[Node, int], above: Sequence[int]
    ) -> str:
        if term not in class_of:
            self.fault(iri, f"its {attribute.name} is {self.shown(term)}", "an individual of these files")
        elif not above[class_of[term]] >> (attribute.range_class or 0) & 1:
            own, allowed = (_local_name(self.class_iris[uid]) for uid in (class_of[term], attribute.range_class or 0))
            self.fault(iri, f"its {attribute.name} {self.shown(term)} is a {own}", f"a {allowed}")
        return _local_name(str(term))

    def _refuse_many(self, attributes: Sequence[Attribute]) -> None:
        for kind, verb in ((OWL.FunctionalProperty, "lead to"), (OWL.InverseFunctionalProperty, "come from")):
            for attribute in (a for a in attributes if (URIRef(a.iri), RDF.type, kind) in self.graph):
                pairs = list(self.graph.subject_objects(URIRef(attribute.iri)))
                ends = [subject if kind == OWL.FunctionalProperty else target for subject, target in pairs]
                for end in {end for end in ends if ends.count(end) > 1}:
                    wrong = f"its links by {attribute.name} {verb} {ends.count(end)} things"
                    self.fault(end, wrong, f"one, by {self.shown(kind)}")

    def refuse_contradictions(self, tbox: TBox) -> None:
        for c in tbox.classes:
            if tbox.are_disjoint(c.uid, c.uid):
                self.fault(URIRef(c.iri), "it is disjoint with itself", "superclasses that are not disjoint")


def _stored(attribute: Attribute, term: Node) -> Value | None:
    """Return the value of a literal; None if its datatype, range or grid does not match."""
    if not isinstance(term, Literal) or term.language is not None or term.value is None:
        return None
    own, asked, value = term.datatype or XSD.string, URIRef(attribute.datatype), term.toPython()
    # In OWL an integer is a decimal, too; a decimal counts as an integer only without a fraction.
    is_whole = {own, asked} == {XSD.integer, XSD.decimal} and (own == XSD.integer or Decimal(value) % 1 == 0)
    if own != asked and not is_whole:
        return None
    try:
        stored = attribute.value_of(str(term))
    except ValueError:
        return None
    return stored if attribute.stores(stored) else None


# Annotations of attributes ---------------------------------------------------------------------------

Fault = Callable[[Node, str, str], None]  # fault handler: subject, fault, allowed values


def symbol_of(iri: str) -> str | None:
    """Return the symbol of a QUDT unit, such as ``m``, or its name if not listed; None for other IRIs."""
    name = iri.removeprefix(QUDT_UNITS)
    return None if not name or name == iri else _SYMBOLS.get(name, name)


class Annotations:
    """Annotations of one attribute, read on request."""

    def __init__(self, graph: Graph, iri: URIRef, kind: ValueKind, fault: Fault) -> None:
        """Refuse annotations of another kind of values; ``fault`` receives all faults."""
        self._graph, self._iri, self._kind, self._fault = graph, iri, kind, fault
        of_numbers = (*BOUNDS, RM.unit, RM.drift)
        refused = {
            **({} if kind in MEASURED else dict.fromkeys(of_numbers, "numbers and points")),
            RM.probability if kind in MEASURED else RM.sigma: f"{'rm:sigma' if kind in MEASURED else 'rm:probability'}",
            **({} if kind is ValueKind.TEXT else {RM.maxBytes: "texts"}),
        }
        for predicate, allowed in refused.items():
            if (iri, predicate, None) in graph:
                self._wrong(f"{self._shown(predicate)} on a {kind.value}", allowed)

    @property
    def latest_only(self) -> bool:
        """True if older values are obsolete (rm:latestOnly)."""
        return self._one(RM.latestOnly, (bool,), "true or false, once") or False

    def fields(self, datatype: Node) -> tuple[Field, ...]:
        """Return the grid of a number, twice for a point; empty for other kinds or after a fault."""
        if self._kind not in MEASURED:
            return ()
        bounds = [self._number(predicate, "one number", is_needed=True) for predicate in BOUNDS]
        units = sorted(self._graph.objects(self._iri, RM.unit), key=str)
        symbols = [symbol_of(unit) if isinstance(unit, URIRef) else None for unit in units]
        if len(units) > 1 or None in symbols:
            got = " and ".join(map(self._shown, units))
            self._wrong(f"rm:unit is {got}", f"none, or one unit of QUDT such as <{QUDT_UNITS}M>")
        numbers = [bound for bound in bounds if bound is not None]
        if datatype == XSD.integer and any(number % 1 for number in numbers):
            self._wrong(f"its bounds and resolution are {numbers}", "whole numbers for xsd:integer")
        if len(numbers) < len(BOUNDS):
            return ()
        minimum, maximum, resolution = numbers
        try:
            field = Field(minimum, maximum, resolution, next(iter(symbols), None) or "")
        except ValueError as error:
            self._wrong(str(error), "minimum < maximum, a whole number of resolutions apart")
            return ()
        return (field,) * (2 if self._kind is ValueKind.POINT else 1)

    def uncertainty(self, fields: Sequence[Field]) -> Field | None:
        """Return the grid of uncertainties: 64 sigmas, or probabilities between 0 and 1."""
        own = RM.sigma if self._kind in MEASURED else RM.probability
        step = self._number(own, "one number, the step")
        if step is None:
            return None
        try:
            if self._kind in MEASURED:
                return Field(step, SIGMAS * step, step, fields[0].unit if fields else "")
            # In decimals: a binary 1 - 0.1 would be no whole number of steps.
            return Field(step, float(1 - Decimal(str(step))), step, "")
        except (ValueError, ArithmeticError) as error:
            allowed = "a step above 0; of a probability, a part of 1 below 0.5"
            self._wrong(f"{self._shown(own)} {step}: {error}", allowed)
            return None

    @property
    def drift(self) -> float:
        """Random walk of a number or point per square root of a second; 0 by default."""
        drift = self._number(RM.drift, "one number of 0 or more")
        if drift is not None and not 0.0 <= drift < math.inf:
            self._wrong(f"rm:drift is {drift}", "one number of 0 or more")
        return drift or 0.0

    @property
    def most_bytes(self) -> int:
        """Maximum length of a text in bytes of UTF-8; 0 for other kinds."""
        if self._kind is not ValueKind.TEXT:
            return 0
        allowed = f"one whole number for a text, 1 to {LONGEST_BYTES}"
        length = self._one(RM.maxBytes, (int,), allowed, is_needed=True)
        if length is not None and not 1 <= length <= LONGEST_BYTES:
            self._wrong(f"rm:maxBytes is {length}", allowed)
        return length or 0

    def _number(self, predicate: URIRef, allowed: str, is_needed: bool = False) -> float | None:
        number = self._one(predicate, (int, float, Decimal), allowed, is_needed)
        return None if number is None else float(number)

    def _one(self, predicate: URIRef, types: tuple[type, ...], allowed: str, is_needed: bool = False) -> Any:
        terms = self._graph.objects(self._iri, predicate)
        values = [term.toPython() if isinstance(term, Literal) else term for term in terms]
        if len(values) == 1 and type(values[0]) in types:
            return values[0]
        if values or is_needed:
            self._wrong(f"{self._shown(predicate)} is {' and '.join(map(repr, values)) or 'missing'}", allowed)
        return None

    def _wrong(self, stated: str, allowed: str) -> None:
        self._fault(self._iri, stated, allowed)

    def _shown(self, term: Node) -> str:
        return term.n3(self._graph.namespace_manager)
