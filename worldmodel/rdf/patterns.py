"""Triple patterns over a world model.

Each uses the smallest index that the bound terms allow. Nothing is copied: an instance leads to its properties, an
attribute to those of all instances, a fact IRI to its block. An index by origin is built on request and again after
changes. Each answer equals the filter over all triples.
"""

from collections.abc import Callable, Iterable, Iterator
from itertools import chain

from rdflib import URIRef
from rdflib.term import Node

from worldmodel.facts import Observation
from worldmodel.ontology.compiler import SIT
from worldmodel.ontology.tbox import TBox, ValueKind
from worldmodel.rdf.terms import (
    MOST_REMEMBERED,
    RdfTerms,
    fact_iri,
    fact_of,
    instance_uid,
    is_fact,
)
from worldmodel.rdf.triples import LABEL, RECEIVED, RECEPTION, TYPE, Inferences, Receptions, States
from worldmodel.world_model import Knowledge

Triple = tuple[Node, Node, Node]
Pattern = tuple[Node | None, Node | None, Node | None]
# constants, since each access to a namespace creates a term
_HAS = SIT.hasPropertyValue
_OF_ATTRIBUTE, _ORIGIN, _PROPERTY_VALUE = SIT.ofAttribute, SIT.origin, SIT.PropertyValue
OfFact = Callable[[Observation], Node | None]


def parts_of_facts(tbox: TBox, terms: RdfTerms) -> dict[Node, OfFact]:
    """Return the RDF properties of facts as functions to an object or None."""
    is_link = tuple(attribute.kind in (ValueKind.LINK, ValueKind.TYPE) for attribute in tbox.attributes)
    is_measured = tuple(attribute.kind in (ValueKind.NUMBER, ValueKind.POINT) for attribute in tbox.attributes)

    def value(observation: Observation, as_link: bool) -> Node | None:
        fact = observation.fact
        return terms.value(fact.attribute, fact.value) if is_link[fact.attribute] is as_link else None

    def uncertainty(observation: Observation, of_measured: bool) -> Node | None:
        _, attribute, _, sigma = observation.fact
        return None if sigma is None or is_measured[attribute] is not of_measured else terms.number(sigma)

    return {
        TYPE: lambda observation: _PROPERTY_VALUE,
        _OF_ATTRIBUTE: lambda observation: terms.attributes[observation.fact.attribute],
        SIT.dataValue: lambda observation: value(observation, as_link=False),
        SIT.linkValue: lambda observation: value(observation, as_link=True),
        SIT.standardUncertainty: lambda observation: uncertainty(observation, of_measured=True),
        SIT.probability: lambda observation: uncertainty(observation, of_measured=False),
        SIT.timestamp: lambda observation: terms.number(observation.block.time_s),
        _ORIGIN: lambda observation: terms.instance(observation.block.origin),
    }


class Abox:
    """Live view of one world model as triples."""

    def __init__(self, known: Knowledge) -> None:
        model = known.model
        tbox, terms = model.tbox, RdfTerms(model.tbox)
        self.model = model
        self.terms = terms
        self._attribute_uids: dict[Node, int] = {iri: uid for uid, iri in enumerate(terms.attributes)}
        self._class_uids: dict[Node, int] = {iri: uid for uid, iri in enumerate(terms.classes)}
        self._of_fact = parts_of_facts(tbox, terms)
        self.receptions = Receptions(known, terms, lambda iri: self.observation(iri) is not None)
        self.conclusions = Inferences(model, terms)
        self.states = States(model, terms, self.conclusions)
        self._facts: dict[Node, Observation] = {}
        self._uids: dict[Node, int] = {}
        self._typed: dict[Node, list[Triple]] | None = None
        self._said: dict[int, list[Observation]] | None = None
        self._version = model.version

    def triples(self, pattern: Pattern) -> Iterable[Triple]:
        """Return the triples that match a pattern; None matches all terms."""
        if self._version != self.model.version:
            self._facts.clear()
            self._said = self._typed = None
            self._version = self.model.version
        subject, predicate, target = pattern
        if subject is None:
            return self._of_any_subject(predicate, target)
        if (observation := self.observation(subject)) is not None:
            return self.of_one(subject, observation, predicate, target)
        if (uid := self._uid(subject)) is not None:
            return self._of_instance(uid, subject, predicate, target)
        if (reception := self.receptions.get(subject)) is not None:
            return self.receptions.triples(subject, reception, predicate, target)
        return ()

    def triples_of(self, origin: int, pattern: Pattern) -> Iterator[Triple]:
        """Yield the matching triples about facts of ``origin``: the facts and the links to them."""
        if pattern == (None, None, None):
            for told in self.said_by(origin):
                iri = self.iri(told)
                yield (self.terms.instance(told.fact.subject), _HAS, iri)
                yield from self.of_one(iri, told, None, None)
            return
        for triple in self.triples(pattern):
            observation = self.observation(triple[2] if triple[1] == _HAS else triple[0])
            if observation is not None and observation.block.origin == origin:
                yield triple

    def observation(self, iri: Node) -> Observation | None:
        """Return the observation with a fact IRI; None if unknown or of an excluded origin."""
        observation = self._facts.get(iri)
        if (
            observation is None
            and (observation := fact_of(self.model, iri)) is not None
            and not self.model.is_seen(observation.block)
        ):
            return None
        return observation

    def said_by(self, origin: int) -> Iterable[Observation]:
        """Return the facts of an origin."""
        if self._said is None:
            self._said = {}
            for observation in self.all_facts():
                self._said.setdefault(observation.block.origin, []).append(observation)
        return self._said.get(origin, ())

    # Facts ---------------------------------------------------------------------------------------

    def iri(self, observation: Observation) -> URIRef:
        """Return and cache the IRI of a fact."""
        iri = fact_iri(observation)
        if len(self._facts) >= MOST_REMEMBERED:
            self._facts.clear()
        self._facts[iri] = observation
        return iri

    def all_facts(self) -> Iterator[Observation]:
        """Yield all facts that count, by attribute."""
        for attribute in range(len(self.terms.attributes)):
            yield from self._of_attribute(attribute)

    def _of_attribute(self, attribute: int) -> Iterator[Observation]:
        history = self.model.history
        for uid in self.model.instance_uids():
            yield from history(uid, attribute)

    def of_subject(self, uid: int) -> Iterator[Observation]:
        """Yield the facts about an instance, by attribute."""
        history = self.model.history
        for attribute in range(len(self.terms.attributes)):
            yield from history(uid, attribute)

    def of_one(
        self, subject: Node, observation: Observation, predicate: Node | None, target: Node | None
    ) -> Iterable[Triple]:
        """Return the matching triples of one fact."""
        if predicate is not None:
            of = self._of_fact.get(predicate)
            term = None if of is None else of(observation)
            if term is None or not (target is None or target is term or target == term):
                return ()
            return ((subject, predicate, term),)
        known = ((name, of(observation)) for name, of in self._of_fact.items())
        return ((subject, name, term) for name, term in known if term is not None and target in (None, term))

    # Instances -----------------------------------------------------------------------------------

    def _uid(self, iri: Node) -> int | None:
        """Return the instance uid of an IRI; None for another term."""
        uid = self._uids.get(iri)
        if uid is None and (uid := instance_uid(iri)) is not None:
            self._uids[self.terms.instance(uid)] = uid
        return uid

    def _of_instance(self, uid: int, subject: Node, predicate: Node | None, target: Node | None) -> Iterable[Triple]:
        if predicate == _HAS:
            return self._histories(uid, subject, target)
        if predicate is None:
            return chain(self._histories(uid, subject, target), self.states.triples(uid, subject, None, target))
        return self.states.triples(uid, subject, predicate, target)

    def _histories(self, uid: int, subject: Node, target: Node | None) -> Iterable[Triple]:
        """Return the links from an instance to its facts."""
        if target is None:
            return ((subject, _HAS, self.iri(observation)) for observation in self.of_subject(uid))
        known = self.observation(target)
        return ((subject, _HAS, target),) if known is not None and known.fact.subject == uid else ()

    # Any subject ---------------------------------------------------------------------------------

    def _of_any_subject(self, predicate: Node | None, target: Node | None) -> Iterable[Triple]:
        if predicate is None:
            return self._of_anything(target)
        if predicate == TYPE:
            return self._of_type(target)
        if predicate in self._of_fact:
            return self._facts_with(predicate, target)
        if predicate in self.receptions.predicates:
            return self._of_receptions(predicate, target)
        if predicate in self._attribute_uids or predicate in (_HAS, LABEL):
            return self._of_instances(predicate, target)
        return ()

    def _of_anything(self, target: Node | None) -> Iterator[Triple]:
        yield from self._of_instances(None, target)
        yield from self._of_receptions(None, target)
        for predicate in self._of_fact:
            if predicate != TYPE:
                yield from self._facts_with(predicate, target)
        if target in (None, _PROPERTY_VALUE):
            yield from self._facts_with(TYPE, target)

    def _of_type(self, target: Node | None) -> Iterable[Triple]:
        """Return the members of a class by asserted or inferred types; of all classes if None."""
        if target in self._class_uids:
            return self._members().get(target, ())
        if target is None:
            members = chain.from_iterable(self._members().values())
            facts, receptions = self._facts_with(TYPE, None), self._of_receptions(TYPE, None)
            return chain(facts, receptions, members)
        if target == _PROPERTY_VALUE:
            return self._facts_with(TYPE, target)
        if target == RECEPTION:
            return self._of_receptions(TYPE, target)
        return ()

    def _members(self) -> dict[Node, list[Triple]]:
        """Return the type triples of all instances, by class."""
        if self._typed is None:
            self._typed = {}
            for uid in self.model.instance_uids():
                iri = self.terms.instance(uid)
                for term in self.states.types(uid, concluded=True):
                    self._typed.setdefault(term, []).append((iri, TYPE, term))
        return self._typed

    def _facts_with(self, predicate: Node, target: Node | None) -> Iterator[Triple]:
        of, iri = self._of_fact[predicate], self.iri
        facts: Iterable[Observation] = ()
        if predicate == _OF_ATTRIBUTE and target is not None:
            if target in self._attribute_uids:
                facts = self._of_attribute(self._attribute_uids[target])
        elif predicate == _ORIGIN and target is not None:
            origin = self._uid(target)
            facts = () if origin is None else self.said_by(origin)
        else:
            for observation in self.all_facts():
                term = of(observation)
                if term is not None and (target is None or target == term):
                    yield (iri(observation), predicate, term)
        for observation in facts:
            yield (iri(observation), predicate, target)  # type: ignore[misc]

    def _of_instances(self, predicate: Node | None, target: Node | None) -> Iterator[Triple]:
        if target is not None and is_fact(target):
            if predicate in (None, _HAS) and (known := self.observation(target)) is not None:
                yield (self.terms.instance(known.fact.subject), _HAS, target)
            return
        for uid in self.model.instance_uids():
            yield from self._of_instance(uid, self.terms.instance(uid), predicate, target)

    def _of_receptions(self, predicate: Node | None, target: Node | None) -> Iterable[Triple]:
        if target is None or not is_fact(target):
            return self.receptions.all_triples(predicate, target)
        return self.receptions.of_fact(target, self.observation(target)) if predicate in (None, RECEIVED) else ()
