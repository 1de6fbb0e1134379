"""TBox as used by a vehicle: classes and attributes with short uids, compiled to tables.

It is fixed for a mission and equal on all vehicles ("a unique but short UID will be created for every class in the
TBox", Maurelli et al., TDMA exchange policies, section 4). Built in are the class ``Thing`` (owl:Thing) and the
attribute ``type`` (rdf:type), uid 0.
"""

import hashlib
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from typing import cast

from worldmodel.errors import unknown_name
from worldmodel.ontology.axioms import NO_AXIOMS, Axioms, CompiledAxioms
from worldmodel.ontology.fields import Field, Value, bytes_of

TYPE_UID = 0
_POINT = re.compile(r"POINT \((\S+) (\S+)\)")


class ValueKind(Enum):
    """Kinds of attribute values."""

    TYPE = "type"
    NUMBER = "number"
    POINT = "point"
    BOOLEAN = "boolean"
    SYMBOL = "symbol"
    TEXT = "text"
    LINK = "link"


MEASURED = (ValueKind.NUMBER, ValueKind.POINT)
"""Kinds with a standard deviation as uncertainty; the others have a probability."""


@dataclass(frozen=True, slots=True)
class OntologyClass:
    """Named class; ``parents`` are the uids of its direct superclasses."""

    uid: int
    name: str
    iri: str
    parents: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Attribute:
    """Property of instances with values that change over time.

    Attributes:
        latest_only: True if older values (of a position, say) are obsolete and not exchanged.
        datatype: IRI of the RDF datatype of its literals; empty if its values are IRIs.
        uncertainty: grid of the standard deviation of a NUMBER or POINT, else of the probability; None without any.
        drift: random walk of a NUMBER or POINT per square root of a second; 0 at rest.
    """

    uid: int
    name: str
    iri: str
    domain: int
    kind: ValueKind
    fields: tuple[Field, ...] = ()
    range_class: int | None = None
    symbols: tuple[str, ...] = ()
    latest_only: bool = False
    datatype: str = ""
    uncertainty: Field | None = None
    most_bytes: int = field(default=0, repr=False)
    drift: float = field(default=0.0, repr=False)

    @property
    def in_words(self) -> str:
        """Description of its values, other than types and links."""
        if self.symbols:
            return " or ".join(self.symbols)
        if self.most_bytes:
            return f"text of at most {self.most_bytes} bytes"
        both = " east and north" if len(self.fields) > 1 else ""
        return "; ".join(dict.fromkeys(map(str, self.fields))) + both if self.fields else "true or false"

    def encode(self, value: Value) -> tuple[int, ...]:
        """Return the integers of ``value``, one per field; raises TypeError or ValueError."""
        kind = self.kind
        if kind is ValueKind.NUMBER:
            if isinstance(value, tuple | str):
                raise TypeError(f"{value!r} is not a number")
            return (self.fields[0].encode(value),)
        if kind is ValueKind.POINT:
            if not isinstance(value, tuple) or len(value) != len(self.fields):
                raise TypeError(f"{value!r} is not a point; a tuple of {len(self.fields)} numbers is")
            east, north = self.fields
            return (east.encode(value[0]), north.encode(value[1]))
        if kind is ValueKind.BOOLEAN:
            if not isinstance(value, bool):
                raise TypeError(f"{value!r} is not a bool")
            return (int(value),)
        if kind is ValueKind.TEXT:
            return (int.from_bytes(b"\x01" + bytes_of(value, self.most_bytes), "big"),)
        if type(value) is not int:
            raise TypeError(f"{value!r} is not the uid or index (an int) of a {kind.value}")
        if value < 0:
            raise ValueError(f"{value} is below zero")
        if kind is ValueKind.SYMBOL and value >= len(self.symbols):
            raise ValueError(f"{value} is outside 0..{len(self.symbols) - 1}, the indices of {self.symbols}")
        return (value,)

    def decode(self, indices: Sequence[int]) -> Value:
        """Return the value of the integers ``indices``; raises ValueError for an invalid one."""
        if self.kind is ValueKind.NUMBER:
            return self.fields[0].decode(indices[0])
        if self.kind is ValueKind.POINT:
            east, north = self.fields
            return (east.decode(indices[0]), north.decode(indices[1]))
        if self.kind is ValueKind.TEXT:
            text = indices[0].to_bytes((indices[0].bit_length() + 7) // 8, "big")[1:].decode()
            bytes_of(text, self.most_bytes)  # refuses an invalid text
            return text
        return bool(indices[0]) if self.kind is ValueKind.BOOLEAN else indices[0]

    def quantise(self, value: Value) -> Value:
        """Return the value as stored and sent; raises as ``encode``."""
        return self.decode(self.encode(value))

    def stores(self, value: Value) -> bool:
        """True for a value of the right kind, in range and on its grid."""
        try:
            return self.quantise(value) == value
        except (TypeError, ValueError):
            return False

    def text_of(self, stored: Value) -> str:
        """Return a stored value, but no type or link, as text that ``value_of`` restores exactly."""
        match self.kind:
            case ValueKind.SYMBOL:
                return self.symbols[cast(int, stored)]
            case ValueKind.POINT:
                east, north = cast(tuple[float, float], stored)
                return f"POINT ({east!r} {north!r})"
            case ValueKind.BOOLEAN:
                return str(stored).lower()
        return stored if isinstance(stored, str) else repr(stored)

    def value_of(self, text: str) -> Value:
        """Parse a text of ``text_of``; raises ValueError for any other."""
        match self.kind:
            case ValueKind.SYMBOL:
                return self.symbols.index(text)
            case ValueKind.TEXT:
                return text
            case ValueKind.POINT:
                if (point := _POINT.fullmatch(text)) is None:
                    raise ValueError(f"{text!r} is not a point such as POINT (3.5 4.0)")
                return (float(point[1]), float(point[2]))
            case ValueKind.BOOLEAN:
                return ("false", "true").index(text) == 1
        return float(text)

    def encode_uncertainty(self, uncertainty: float) -> int:
        """Return the integer of an uncertainty; raises TypeError, or ValueError out of range."""
        grid = self.uncertainty
        if grid is None:
            raise TypeError("its values carry no uncertainty; allowed: none, or rm:sigma or rm:probability of it")
        if isinstance(uncertainty, bool) or not isinstance(uncertainty, (int, float)):
            raise TypeError(f"the uncertainty {uncertainty!r} is not a number")
        most = math.inf if self.kind in MEASURED else 1.0
        # Neither 0 nor certainty has a code: they would end every later fusion. Values near them are clipped.
        if 0.0 <= uncertainty < grid.minimum:
            return 0
        if most == 1.0 and grid.maximum < uncertainty <= most:
            return grid.n_values - 1
        try:
            return grid.encode(uncertainty)
        except ValueError as error:
            measure = "standard deviation" if self.kind in MEASURED else "probability"
            raise ValueError(f"the {measure} {error}") from None

    def quantise_uncertainty(self, uncertainty: float) -> float:
        """Return the uncertainty as stored and sent; raises as ``encode_uncertainty``."""
        index = self.encode_uncertainty(uncertainty)
        assert self.uncertainty is not None
        return self.uncertainty.decode(index)


@dataclass(frozen=True, slots=True)
class Individual:
    """Individual in the ontology files; ``links`` are (attribute uid, name of the target)."""

    name: str
    class_uid: int
    links: tuple[tuple[int, str], ...] = ()
    values: tuple[tuple[int, Value], ...] = ()


@dataclass(frozen=True, slots=True)
class Source:
    """Turtle file as read."""

    path: str
    text: str


@dataclass(frozen=True, repr=False)
class TBox:
    """Compiled classes and attributes, indexed by uid; TBoxes with equal tables are equal; ``hash`` is a 32-bit digest.

    The hierarchy must be acyclic. Subclasses of ``disjoint`` pairs are disjoint, too.
    """

    classes: tuple[OntologyClass, ...]
    attributes: tuple[Attribute, ...]
    disjoint: tuple[tuple[int, int], ...] = field(default=(), compare=False)
    sources: tuple[Source, ...] = field(default=(), compare=False)
    axioms: Axioms = NO_AXIOMS
    individuals: tuple[Individual, ...] = ()
    hash: int = field(init=False)
    _ancestors: tuple[int, ...] = field(init=False, compare=False)
    _descendants: tuple[tuple[int, ...], ...] = field(init=False, compare=False)
    _excluded: tuple[int, ...] = field(init=False)
    _class_named: dict[str, OntologyClass] = field(init=False, compare=False)
    _attribute_named: dict[str, Attribute] = field(init=False, compare=False)

    def __post_init__(self) -> None:
        ancestors = closure(self.classes)
        descendants = tuple(tuple(c.uid for c in self.classes if ancestors[c.uid] >> d.uid & 1) for d in self.classes)
        excluded = [0] * len(self.classes)
        for a, b in self.disjoint:
            for below_a in descendants[a]:
                for below_b in descendants[b]:
                    excluded[below_a] |= 1 << below_b
                    excluded[below_b] |= 1 << below_a
        table = repr((self.classes, self.attributes, excluded, self.axioms))
        # Texts and drifts enter only where they exist, so that other ontologies keep their hash.
        table += "".join(
            f"{attribute.name}: {attribute.most_bytes} bytes" for attribute in self.attributes if attribute.most_bytes
        )
        table += "".join(
            f"{attribute.name}: drift {attribute.drift}" for attribute in self.attributes if attribute.drift
        )
        table += repr(self.individuals) if self.individuals else ""
        derived = {
            "hash": int.from_bytes(hashlib.sha256(table.encode()).digest()[:4], "big"),
            "_ancestors": ancestors,
            "_descendants": descendants,
            "_excluded": tuple(excluded),
            "_class_named": {c.name: c for c in self.classes},
            "_attribute_named": {a.name: a for a in self.attributes},
        }
        for name, value in derived.items():
            object.__setattr__(self, name, value)

    @cached_property  # 2 to 6 ms, asked by each world model
    def rules(self) -> CompiledAxioms:
        """Compiled axioms, on first use: checks of scenarios do not need them."""
        return CompiledAxioms(self._ancestors, [(a.domain, a.range_class) for a in self.attributes], self.axioms)

    def class_named(self, name: str) -> OntologyClass:
        """Return the class; raises UnknownNameError with the nearest name."""
        try:
            return self._class_named[name]
        except KeyError:
            raise unknown_name("class", name, self._class_named) from None

    def attribute_named(self, name: str) -> Attribute:
        """Return the attribute; raises UnknownNameError with the nearest name."""
        try:
            return self._attribute_named[name]
        except KeyError:
            raise unknown_name("attribute", name, self._attribute_named) from None

    def text_of(self, attribute: Attribute, stored: Value) -> str:
        """Return a stored value, but no link, as text of tables; classes by name, others by ``Attribute.text_of``."""
        return self.classes[cast(int, stored)].name if attribute.uid == TYPE_UID else attribute.text_of(stored)

    def value_of(self, attribute: Attribute, text: str) -> Value:
        """Parse a text of ``text_of``; raises ValueError or UnknownNameError for any other."""
        return self.class_named(text).uid if attribute.uid == TYPE_UID else attribute.value_of(text)

    def is_a(self, c: int, d: int) -> bool:
        """True if class ``c`` is class ``d`` or a subclass of it."""
        return bool(self._ancestors[c] >> d & 1)

    def ancestor_mask(self, c: int) -> int:
        """Return the classes of an instance of ``c``, bit d for class d."""
        return self._ancestors[c]

    def subclasses(self, c: int) -> tuple[int, ...]:
        """Return the uids of ``c`` and all its subclasses."""
        return self._descendants[c]

    def have_common_subclass(self, c: int, d: int) -> bool:
        """True if a class is below, or equal to, both."""
        return not set(self._descendants[c]).isdisjoint(self._descendants[d])

    def are_disjoint(self, c: int, d: int) -> bool:
        """True if the classes cannot share an instance."""
        return bool(self._excluded[c] >> d & 1)

    def __hash__(self) -> int:
        return self.hash

    def __repr__(self) -> str:
        return f"<TBox {self.hash:08x}: {len(self.classes)} classes, {len(self.attributes)} attributes>"


def reaching(tbox: TBox, reach_m: float) -> TBox:
    """Return a TBox whose point attributes range to ``reach_m`` or more from the origin; ``tbox`` itself if it does.

    >>> from worldmodel import core_ontology_paths, read_tbox
    >>> position = reaching(read_tbox(*core_ontology_paths()), 55_000.0).attribute_named("position")
    >>> [str(field.maximum) for field in position.fields], [field.size_bits for field in position.fields]
    (['60000.0', '60000.0'], [18, 18])
    """

    def wider(of: Attribute) -> Attribute:
        if of.kind is not ValueKind.POINT or {field.unit for field in of.fields} != {"m"}:
            return of
        bound_m = min(min(-field.minimum, field.maximum) for field in of.fields)
        # A whole multiple, so that the grid keeps all existing values.
        times = math.ceil(reach_m / bound_m) if 0.0 < bound_m < reach_m else 1
        return of if times == 1 else replace(of, fields=_times(of.fields, times))

    attributes = tuple(wider(of) for of in tbox.attributes)
    return tbox if attributes == tbox.attributes else replace(tbox, attributes=attributes)


def _times(fields: Sequence[Field], times: int) -> tuple[Field, ...]:
    return tuple(Field(field.minimum * times, field.maximum * times, field.resolution, field.unit) for field in fields)


def closure(classes: Sequence[OntologyClass]) -> tuple[int, ...]:
    """Return for each class the bit mask of itself and all its superclasses."""
    masks = [0] * len(classes)

    def close(uid: int) -> int:
        if not masks[uid]:
            mask = 1 << uid
            for parent in classes[uid].parents:
                mask |= close(parent)
            masks[uid] = mask
        return masks[uid]

    return tuple(close(c.uid) for c in classes)
