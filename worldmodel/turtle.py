"""Reading OWL: from the text of Turtle files to the tables of a ``TBox``, or to the list of all their faults.

Compiled are: named classes (owl:Class) with rdfs:subClassOf, owl:disjointWith and owl:AllDisjointClasses; their
definitions, which ``worldmodel.definitions`` describes; and attributes, which are the owl:DatatypeProperty and
owl:ObjectProperty outside the situation vocabulary, with rdfs:domain, rdfs:range and the rm: annotations. The
range decides the kind:

    xsd:double, xsd:decimal, xsd:integer   NUMBER    needs rm:minimum, rm:maximum, rm:resolution; may have rm:unit
    rm:Point                               POINT     the same, for both axes
    xsd:boolean                            BOOLEAN
    owl:oneOf (a list of strings)          SYMBOL
    xsd:string                             TEXT      needs rm:maxBytes
    a named class                          LINK

``rm:sigma`` is the step of the standard deviation that a number or point may carry, ``rm:probability`` that of the
probability of any other value. ``rm:drift`` says how far a number or point walks at random, see ``worldmodel.fusion``.

Individuals, which ``worldmodel.stated`` reads, become instances with links that all know from the start. Annotations
stay in the graph for SPARQL and for reasoners, and have no effect at run time. Any other axiom on a class or attribute
is refused. A term is defined in one file alone: ``_DEFINING`` lists the predicates that define it. Labels, comments and
alignments define nothing; any file may add them.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rdflib import OWL, RDF, RDFS, XSD, BNode, Graph, Literal, Namespace, URIRef
from rdflib.collection import Collection
from rdflib.plugins.parsers.notation3 import BadSyntax
from rdflib.term import Node

from worldmodel.annotations import ANNOTATIONS, BOUNDS, RM, Annotations
from worldmodel.definitions import DEFINING, Definitions
from worldmodel.errors import OntologyError, suggestion
from worldmodel.expressions import facets_of, on_grid
from worldmodel.fields import Field
from worldmodel.stated import StatedIndividuals
from worldmodel.tbox import TYPE_UID, Attribute, OntologyClass, Source, TBox, ValueKind
from worldmodel.unread import Unread, refuse_contradictions

CORE, MARINE = URIRef("https://w3id.org/remoras/core"), URIRef("https://w3id.org/remoras/marine")
"""The file that brings those of the core to other tools, and one of these: who reads them needs no file for it."""
SIT = Namespace("https://w3id.org/remoras/situation#")

_KINDS: dict[Node, ValueKind] = {
    **dict.fromkeys((XSD.double, XSD.decimal, XSD.integer), ValueKind.NUMBER),
    RM.Point: ValueKind.POINT,
    XSD.boolean: ValueKind.BOOLEAN,
    XSD.string: ValueKind.TEXT,
}
"""Kinds of values by range; a declared class and a list of texts are the others."""
_RANGES = (
    "xsd:double, xsd:decimal, xsd:integer, xsd:boolean, xsd:string, rm:Point, owl:oneOf (strings) or a declared class"
)
_DATATYPES = {
    ValueKind.POINT: str(XSD.string),
    ValueKind.SYMBOL: str(XSD.string),
    ValueKind.TEXT: str(XSD.string),
    ValueKind.BOOLEAN: str(XSD.boolean),
}
_TERMS = (OWL.Class, OWL.DatatypeProperty, OWL.ObjectProperty, OWL.AnnotationProperty, RDF.Property, RDFS.Datatype)
_DEFINING = {RDF.type, OWL.disjointWith, RDFS.domain, RDFS.range, *DEFINING, *ANNOTATIONS}
_NAME = re.compile(r"[A-Za-z]\w*", re.ASCII)


@dataclass(frozen=True)
class Parsed:
    """The union of the files.

    ``file_of`` is the first file that has triples of a subject; ``definitions`` lists the files that define
    a term, in the order given.
    """

    graph: Graph
    file_of: dict[Node, str]
    definitions: dict[Node, list[str]]


def parse_turtle(sources: Iterable[Source]) -> Parsed:
    """Parse the files into one graph, without the imports that are among them.

    Raises OntologyError naming every file that is not Turtle or imports what is none of the files.
    """
    union = Graph()
    file_of: dict[Node, str] = {}
    defining_files: dict[Node, list[str]] = {}
    faults: list[str] = []
    for source in sources:
        graph = Graph()
        try:
            graph.parse(data=source.text, format="turtle")
        except Exception as error:  # rdflib's parsers raise whatever a broken text leads them to
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


def _reason(error: Exception) -> str:
    """Return what a parser says, in one line: of a syntax error its line, what is wrong, and the text there."""
    if isinstance(error, BadSyntax):
        text = error._str.decode(errors="replace") if isinstance(error._str, bytes) else error._str
        here = " ".join(text[error._i :].split("\n")[0].split())
        return f"line {error.lines + 1}: {error._why}" + (f', at "{here[:60]}"' if here else "")
    return " ".join(str(error).split())


def _unmet_imports(union: Graph, file_of: dict[Node, str]) -> list[str]:
    """Return a fault for every import that is none of the files, by name or by version."""
    read = {*union.subjects(RDF.type, OWL.Ontology), *union.objects(None, OWL.versionIRI)}
    allowed = ", ".join(sorted(map(str, union.subjects(RDF.type, OWL.Ontology))))
    return [
        f"{file_of[importing]}: it imports <{imported}>, which is none of the files that are read; "
        f"allowed: {allowed}{suggestion(str(imported), allowed.split(', '))}; name the file that holds it, too"
        for importing, imported in sorted(union.subject_objects(OWL.imports), key=str)
        if imported not in read and not (imported == CORE and MARINE in read)
    ]


def compile_tbox(sources: tuple[Source, ...]) -> TBox:
    """Compile the files; raises OntologyError with every fault of every subject."""
    parsed = parse_turtle(sources)
    if redefined := _redefinitions(parsed):
        raise OntologyError(redefined)
    reader = _Reader(parsed)
    classes = reader.classes()
    disjoint = reader.disjoint_pairs()
    attributes = reader.attributes()
    stated = StatedIndividuals(parsed.graph, reader.class_uid, attributes, reader)
    found = stated.named() if reader.faults else stated.find(classes)
    axioms = reader.definitions.axioms(classes, attributes, found)
    if not reader.faults:
        classes = reader.definitions.classified(classes, attributes, axioms, disjoint)
    if not reader.faults:
        individuals = stated.read(classes)
        named: dict[Node, Attribute] = {URIRef(attribute.iri): attribute for attribute in attributes[1:]}
        Unread(parsed.graph, parsed.file_of, reader.class_uid, named, found, reader).refuse()
        tbox = TBox(tuple(classes), tuple(attributes), tuple(disjoint), sources, axioms, individuals)
        reader.refuse_empty_classes(tbox)
        if not reader.faults:
            refuse_contradictions(
                tbox, {name: iri for iri, (name, _) in found.items() if isinstance(iri, URIRef)}, reader
            )
    if reader.faults:
        raise OntologyError(sorted(reader.faults))
    return tbox


def _redefinitions(parsed: Parsed) -> list[str]:
    """Return a fault for every file that changes the meaning of a term of another file."""
    shown = parsed.graph.namespace_manager.normalizeUri
    allowed = (
        "one file that defines a term; leave that of the other file alone, and add a class below it "
        "(rdfs:subClassOf) or an attribute under a name of your own"
    )
    faults = [
        f"{other}: {shown(str(term))}: it redefines a term of {first}; allowed: {allowed}"
        for term, (first, *others) in parsed.definitions.items()
        for other in others
    ]
    for axiom, members in parsed.graph.subject_objects(OWL.members):
        file = parsed.file_of[axiom]
        terms = [term for term in Collection(parsed.graph, members) if term in parsed.definitions]
        if terms and all(file not in parsed.definitions[term] for term in terms):
            names = ", ".join(shown(str(term)) for term in terms)
            first = parsed.definitions[terms[0]][0]
            faults.append(f"{file}: {names}: it makes classes of {first} disjoint; allowed: {allowed}")
    return sorted(faults)


def _local_name(iri: str) -> str:
    return re.split(r"[#/:]", iri)[-1]


class _Reader:
    """One pass over the graph, which collects all faults."""

    def __init__(self, parsed: Parsed) -> None:
        self.graph = parsed.graph
        self.file_of = parsed.file_of
        self._files = {file: place for place, file in enumerate(dict.fromkeys(parsed.file_of.values()))}
        self.faults: list[str] = []
        self.class_iris = sorted({*self._declared(OWL.Class), OWL.Thing})
        self.class_uid: dict[Node, int] = {iri: uid for uid, iri in enumerate(self.class_iris)}
        self.definitions = Definitions(self.graph, self.class_uid, self)
        self.annotations = Annotations(self.graph, self)

    def _declared(self, *owl_types: URIRef) -> list[URIRef]:
        """Return what is declared to be of one of ``owl_types`` outside the situation vocabulary, by IRI."""
        declared = {s for owl_type in owl_types for s in self.graph.subjects(RDF.type, owl_type)}
        return sorted(iri for iri in declared if isinstance(iri, URIRef) and not iri.startswith(SIT))

    def _is_class(self, term: Node) -> bool:
        """True if the term is declared, be it by the situation vocabulary, which stays in the graph."""
        return (term, RDF.type, OWL.Class) in self.graph or term == OWL.Thing

    def fault(self, subject: Node, wrong: str, allowed: str) -> None:
        """Note one fault of ``subject``: what is wrong, and what is allowed."""
        shown = subject.n3(self.graph.namespace_manager) if isinstance(subject, URIRef) else "[ ]"
        self.faults.append(f"{self.file_of.get(subject, 'TBox')}: {shown}: {wrong}; allowed: {allowed}")

    def shown(self, term: Node) -> str:
        """Return a term as a Turtle file would write it."""
        return term.n3(self.graph.namespace_manager) if isinstance(term, (URIRef, Literal)) else "[ ]"

    def hint(self, term: Node, known: Iterable[Node]) -> str:
        """Propose the known term most like an unknown one."""
        return suggestion(_local_name(str(term)), sorted(_local_name(str(each)) for each in known))

    def check_names(self, iris: Sequence[URIRef], taken: dict[str, URIRef]) -> None:
        """Refuse names (the local parts of IRIs) that are no identifiers, and names that two IRIs share."""
        for iri in iris:
            name = _local_name(iri)
            if not _NAME.fullmatch(name):
                self.fault(iri, f"its name {name!r} is not an identifier", "a letter, then letters, digits, _")
            elif (other := taken.setdefault(name, iri)) != iri:
                if self._files.get(self.file_of.get(other, ""), -1) > self._files[self.file_of[iri]]:
                    iri, other = other, iri  # noqa: PLW2901  # the file that is read later is at fault
                where = f" in {self.file_of[other]}" if other in self.file_of else ""
                self.fault(iri, f"its name {name!r} is that of <{other}>{where} too", "one IRI for each name")

    def classes(self) -> list[OntologyClass]:
        """Compile the classes; a class without a named superclass is below Thing."""
        self.check_names(self.class_iris, {"Thing": OWL.Thing})
        compiled = []
        for iri, uid in self.class_uid.items():
            parents = self.definitions.parents_of(iri)
            if not parents and iri != OWL.Thing:
                parents.add(self.class_uid[OWL.Thing])
            compiled.append(OntologyClass(uid, _local_name(str(iri)), str(iri), tuple(sorted(parents))))
        self._refuse_cycles(compiled)
        return compiled

    def _refuse_cycles(self, classes: list[OntologyClass]) -> None:
        # Take away the classes whose parents are all taken away, again and again; below a cycle some stay.
        remaining = {c.uid: set(c.parents) for c in classes}
        while free := [uid for uid, parents in remaining.items() if not parents & remaining.keys()]:
            for uid in free:
                del remaining[uid]
        for uid in remaining:
            self.fault(self.class_iris[uid], "it is, or descends from, a superclass of itself", "a hierarchy")

    def disjoint_pairs(self) -> list[tuple[int, int]]:
        """Return the pairs of classes declared disjoint, by uid."""
        groups = [(a, [a, b]) for a, b in self.graph.subject_objects(OWL.disjointWith)]
        groups += list(self.definitions.disjoint_parts())
        for axiom in self.graph.subjects(RDF.type, OWL.AllDisjointClasses):
            for members in self.graph.objects(axiom, OWL.members):
                groups.append((axiom, list(Collection(self.graph, members))))
        pairs = []
        for subject, group in groups:
            for unknown in (term for term in group if isinstance(term, BNode) or not self._is_class(term)):
                wrong = f"the disjoint class {self.shown(unknown)} is not declared"
                self.fault(subject, wrong, f"declared classes{self.hint(unknown, self.class_iris)}")
            uids = [self.class_uid[term] for term in group if term in self.class_uid]
            pairs += [(a, b) for i, a in enumerate(uids) for b in uids[i + 1 :]]
        return sorted(pairs)

    def refuse_empty_classes(self, tbox: TBox) -> None:
        """Refuse classes that can have no instance because they are below two disjoint ones."""
        for c in tbox.classes:
            if tbox.are_disjoint(c.uid, c.uid):
                self.fault(URIRef(c.iri), "it is disjoint with itself", "superclasses that are not disjoint")

    def attributes(self) -> list[Attribute]:
        """Compile the attributes, ``type`` first."""
        iris = self._declared(OWL.DatatypeProperty, OWL.ObjectProperty)
        self.check_names(iris, {"type": RDF.type})
        for annotation in ANNOTATIONS:
            for subject in self.graph.subjects(annotation, None, unique=True):
                if subject not in iris:
                    wrong = f"{self.shown(annotation)} on what is not a declared property"
                    self.fault(subject, wrong, "an owl:DatatypeProperty or owl:ObjectProperty")
        thing = self.class_uid[OWL.Thing]
        built_in = Attribute(TYPE_UID, "type", str(RDF.type), thing, ValueKind.TYPE)
        compiled = (self._attribute(uid, iri) for uid, iri in enumerate(iris, start=TYPE_UID + 1))
        return [built_in, *(attribute for attribute in compiled if attribute)]

    def _kind(self, target: Node) -> ValueKind | None:
        """The kind of values of a range; None if such values cannot be stored."""
        if target in _KINDS:  # first: an ontology may declare rm:Point as a class, and its values are points
            return _KINDS[target]
        if target in self.class_uid:
            return ValueKind.LINK
        return None if self.graph.value(target, OWL.oneOf) is None else ValueKind.SYMBOL

    def _attribute(self, uid: int, iri: URIRef) -> Attribute | None:
        for predicate in self.graph.predicates(iri, unique=True):
            if isinstance(predicate, URIRef) and predicate.startswith(RM) and predicate not in ANNOTATIONS:
                names = ", ".join(sorted(map(self.shown, ANNOTATIONS)))
                wrong = f"unknown annotation {self.shown(predicate)}"
                self.fault(iri, wrong, names + self.hint(predicate, ANNOTATIONS))
        latest_only = self.annotations.boolean(iri, RM.latestOnly)
        domain = self._one(iri, RDFS.domain, "one declared class")
        if domain is not None and domain not in self.class_uid:
            wrong = f"its domain {self.shown(domain)} is not declared"
            self.fault(iri, wrong, f"one declared class{self.hint(domain, self.class_iris)}")
        target = self._one(iri, RDFS.range, _RANGES)
        if target is None:
            return None
        target = self._restricted(iri, target)
        kind = self._kind(target)
        if kind is None:
            self.fault(iri, f"its range {self.shown(target)} cannot be stored", _RANGES)
            return None
        n_fields = {ValueKind.NUMBER: 1, ValueKind.POINT: 2}.get(kind, 0)
        fields: tuple[Field, ...] = self.annotations.fields(iri, n_fields, target) if n_fields else ()
        if fields and (bounds := self._facets_of(iri)) is not None:
            fields = self._within(iri, fields[0], bounds)
        range_class = self.class_uid[target] if kind is ValueKind.LINK else None
        symbols: tuple[str, ...] = ()
        if kind is ValueKind.SYMBOL and (listed := self.graph.value(target, OWL.oneOf)) is not None:
            symbols = self._symbols(iri, listed)
        if kind not in {ValueKind.NUMBER, ValueKind.POINT}:
            for annotation in (*BOUNDS, RM.unit, RM.drift):
                if (iri, annotation, None) in self.graph:
                    self.fault(iri, f"{self.shown(annotation)} on a {kind.value}", "bounds of numbers and points")
        owl_type = OWL.ObjectProperty if kind is ValueKind.LINK else OWL.DatatypeProperty
        if (iri, RDF.type, owl_type) not in self.graph:
            self.fault(iri, f"its range makes it a {kind.value}", f"{self.shown(owl_type)} for such a range")
        if domain not in self.class_uid:
            return None
        datatype = _DATATYPES.get(kind, str(target) if kind is ValueKind.NUMBER else "")
        annotations = self.annotations
        more = (
            annotations.uncertainty(iri, kind, fields),
            annotations.most_bytes(iri, kind),
            annotations.drift(iri),
        )
        of = self.class_uid[domain], kind, fields, range_class, symbols, latest_only, datatype
        return Attribute(uid, _local_name(iri), str(iri), *of, *more)

    def _datatype_node(self, target: Node) -> Node:
        """Return the node that says what a datatype is; a datatype may have a name."""
        named = self.graph.value(target, OWL.equivalentClass) if target not in _KINDS else None
        return target if named is None or target in self.class_uid else named

    def _restricted(self, iri: URIRef, target: Node) -> Node:
        """Return the datatype that a range restricts, or the range; see ``_facets_of``."""
        node = self._datatype_node(target)
        of = self.graph.value(node, OWL.onDatatype)
        if of is None or _KINDS.get(of) is not ValueKind.NUMBER:
            return node if (node, OWL.oneOf, None) in self.graph else target
        if facets_of(self.graph, node, str(of)) is None:
            wrong = f"the facets of its range are not those of {self.shown(of)}"
            self.fault(
                iri, wrong, "xsd:minInclusive, xsd:minExclusive, xsd:maxInclusive, xsd:maxExclusive of such literals"
            )
        return of

    def _facets_of(self, iri: URIRef) -> dict[Node, float] | None:
        """Return the facets of the range of an attribute, if it has any."""
        node = self._datatype_node(next(iter(self.graph.objects(iri, RDFS.range))))
        of = self.graph.value(node, OWL.onDatatype)
        return None if of is None else facets_of(self.graph, node, str(of))

    def _within(self, iri: URIRef, field: Field, bounds: dict[Node, float]) -> tuple[Field, ...]:
        """Return the part of a grid that facets leave."""
        low, high = on_grid(field, bounds)
        if low >= high:
            self.fault(
                iri,
                "the facets of its range leave less than two values of its grid",
                "facets within rm:minimum and rm:maximum",
            )
            return (field,)
        return (Field(low, high, field.resolution, field.unit),)

    def _one(self, iri: URIRef, predicate: URIRef, allowed: str) -> Node | None:
        found = list(self.graph.objects(iri, predicate))
        if len(found) != 1:
            self.fault(iri, f"{len(found)} {self.shown(predicate)}", allowed)
            return None
        return found[0]

    def _symbols(self, iri: URIRef, listed: Node) -> tuple[str, ...]:
        terms = list(Collection(self.graph, listed))
        symbols = tuple(str(term) for term in terms)
        is_text = [isinstance(term, Literal) and term.datatype in (None, XSD.string) for term in terms]
        if len(set(symbols)) < max(len(terms), 1) or not all(is_text):
            self.fault(
                iri,
                f"its symbols are ({' '.join(map(self.shown, terms))})",
                "different strings, at least one",
            )
        return symbols
