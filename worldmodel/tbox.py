"""The TBox as one vehicle uses it: classes and attributes with short UIDs, compiled to tables.

The TBox is fixed for a mission and the same on all vehicles ("a unique but short UID will be created for
every class in the TBox", Maurelli et al., TDMA exchange policies, section 4), so it is compiled once: the
closure of the class hierarchy and disjointness become bit masks, ranges become fields, and ``TBox.hash`` is
what two vehicles compare before they exchange anything. UIDs follow the order of the IRIs, so they depend on
neither the order of triples nor the order of files. Built in are the class ``Thing`` (owl:Thing), above every
class, and the attribute ``type`` (rdf:type), which always has uid 0.
"""

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from worldmodel.errors import OntologyError, UnknownNameError, nearest
from worldmodel.fields import Field

if TYPE_CHECKING:
    from rdflib import Graph

__all__ = [
    "TYPE_UID",
    "Attribute",
    "Field",
    "OntologyClass",
    "OntologyError",
    "Source",
    "TBox",
    "Value",
    "ValueKind",
    "core_ontology_paths",
]

Value = float | int | bool | tuple[float, float]
"""TYPE: class uid. NUMBER: float. POINT: (east, north). BOOLEAN: bool. SYMBOL: index. LINK: instance uid."""

TYPE_UID = 0
"""The uid of the built-in attribute ``type``."""


class ValueKind(Enum):
    """What the values of an attribute are."""

    TYPE = "type"
    NUMBER = "number"
    POINT = "point"
    BOOLEAN = "boolean"
    SYMBOL = "symbol"
    LINK = "link"


@dataclass(frozen=True, slots=True)
class OntologyClass:
    """A named class; ``parents`` are the uids of its direct superclasses."""

    uid: int
    name: str
    iri: str
    parents: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Attribute:
    """A property of instances whose values change with time.

    ``domain`` is the class that has it, ``range_class`` the class a LINK points to. ``latest_only``: an older
    value is obsolete once a newer one is known (a position), so nobody need exchange it any more.
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

    def encode(self, value: Value) -> tuple[int, ...]:
        """Return the integers that stand for ``value``: one for each field, else one.

        Raises TypeError when the value is of another kind, ValueError when it is out of range. Whether a
        class or an instance of that uid exists is not asked here.
        """
        kind = self.kind
        if kind is ValueKind.NUMBER:
            if isinstance(value, tuple):
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
        if type(value) is not int:
            raise TypeError(f"{value!r} is not the uid or index (an int) of a {kind.value}")
        if value < 0:
            raise ValueError(f"{value} is below zero")
        if kind is ValueKind.SYMBOL and value >= len(self.symbols):
            raise ValueError(f"{value} is outside 0..{len(self.symbols) - 1}, the indices of {self.symbols}")
        return (value,)

    def decode(self, indices: Sequence[int]) -> Value:
        """Return the value that ``indices`` stand for."""
        if self.kind is ValueKind.NUMBER:
            return self.fields[0].decode(indices[0])
        if self.kind is ValueKind.POINT:
            east, north = self.fields
            return (east.decode(indices[0]), north.decode(indices[1]))
        return bool(indices[0]) if self.kind is ValueKind.BOOLEAN else indices[0]

    def quantise(self, value: Value) -> Value:
        """Return the value as it is stored and sent; raises as ``encode``."""
        return self.decode(self.encode(value))

    def symbol_index(self, symbol: str) -> int:
        """Return the index that stands for ``symbol``."""
        if symbol not in self.symbols:
            raise UnknownNameError([f"{self.name} has no symbol {symbol!r}; {nearest(symbol, self.symbols)}"])
        return self.symbols.index(symbol)


@dataclass(frozen=True, slots=True)
class Source:
    """One OWL file as it was read."""

    path: str
    text: str


class TBox:
    """Compiled classes and attributes.

    ``classes[uid]`` and ``attributes[uid]`` are the way from a uid, ``class_named`` and ``attribute_named``
    the way to it. ``hash`` is a 32-bit digest of the tables.
    """

    def __init__(
        self,
        classes: Iterable[OntologyClass],
        attributes: Iterable[Attribute],
        disjoint: Iterable[tuple[int, int]] = (),
        sources: tuple[Source, ...] = (),
    ) -> None:
        """Compile tables whose uids count from 0, in order; the hierarchy must have no cycle."""
        self.classes = tuple(classes)
        self.attributes = tuple(attributes)
        self._sources = sources
        self._graph: Graph | None = None
        self._class_named = {c.name: c for c in self.classes}
        self._attribute_named = {a.name: a for a in self.attributes}
        self._ancestors = [0] * len(self.classes)
        for c in self.classes:
            self._close(c.uid)
        self._descendants = tuple(tuple(c.uid for c in self.classes if self.is_a(c.uid, d.uid)) for d in self.classes)
        self._disjoint = [0] * len(self.classes)
        for a, b in disjoint:
            for below_a in self._descendants[a]:
                for below_b in self._descendants[b]:
                    self._disjoint[below_a] |= 1 << below_b
                    self._disjoint[below_b] |= 1 << below_a
        self.hash = self._digest()
        self.sound_values: set[tuple[int, type, Value]] = set()
        """(attribute uid, type, value) of what checks found to be on its grid; links and types are not in it."""

    def _close(self, uid: int) -> int:
        if not self._ancestors[uid]:
            mask = 1 << uid
            for parent in self.classes[uid].parents:
                mask |= self._close(parent)
            self._ancestors[uid] = mask
        return self._ancestors[uid]

    def _digest(self) -> int:
        table = repr((self.classes, self.attributes, self._disjoint))
        return int.from_bytes(hashlib.sha256(table.encode()).digest()[:4], "big")

    @staticmethod
    def read(*paths: Path) -> "TBox":
        """Compile the OWL files (Turtle) at ``paths``, usually ``core_ontology_paths()`` and the user's own.

        Raises OntologyError with all faults at once.
        """
        sources, faults = [], []
        for path in paths:
            try:
                sources.append(Source(str(path), Path(path).read_text(encoding="utf-8")))
            except (OSError, UnicodeDecodeError) as error:
                faults.append(f"{path}: cannot be read: {error}; allowed: a Turtle file in UTF-8")
        if faults:
            raise OntologyError(faults)
        return _compiled(tuple(sources))

    def class_named(self, name: str) -> OntologyClass:
        """Return the class; raises UnknownNameError with the nearest known name."""
        try:
            return self._class_named[name]
        except KeyError:
            raise UnknownNameError([f"no class is named {name!r}; {nearest(name, self._class_named)}"]) from None

    def attribute_named(self, name: str) -> Attribute:
        """Return the attribute; raises UnknownNameError with the nearest known name."""
        try:
            return self._attribute_named[name]
        except KeyError:
            known = nearest(name, self._attribute_named)
            raise UnknownNameError([f"no attribute is named {name!r}; {known}"]) from None

    def is_a(self, c: int, d: int) -> bool:
        """Say whether class ``c`` is class ``d`` or below it."""
        return bool(self._ancestors[c] >> d & 1)

    def ancestor_mask(self, c: int) -> int:
        """Return the classes an instance of ``c`` belongs to, bit d for class d."""
        return self._ancestors[c]

    def subclasses(self, c: int) -> tuple[int, ...]:
        """Return the uids of ``c`` and of all classes below it."""
        return self._descendants[c]

    def are_disjoint(self, c: int, d: int) -> bool:
        """Say whether nothing can be both; subclasses inherit it."""
        return bool(self._disjoint[c] >> d & 1)

    @property
    def graph(self) -> "Graph":
        """The files as one rdflib graph, parsed when first asked for; read it, do not write to it."""
        if self._graph is None:
            from worldmodel.owl import parse

            self._graph = parse(self._sources).graph
        return self._graph

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, TBox):
            return NotImplemented
        mine, theirs = (self.classes, self.attributes), (other.classes, other.attributes)
        return mine == theirs and self._disjoint == other._disjoint

    def __hash__(self) -> int:
        return self.hash

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_graph": None}

    def __repr__(self) -> str:
        return f"<TBox {self.hash:08x}: {len(self.classes)} classes, {len(self.attributes)} attributes>"


@lru_cache(maxsize=8)
def _compiled(sources: tuple[Source, ...]) -> TBox:
    from worldmodel.owl import compile_tbox

    return compile_tbox(sources)


def core_ontology_paths() -> tuple[Path, ...]:
    """Return the OWL files that come with the package, alignments excepted."""
    folder = Path(__file__).parent / "ontology"
    return (folder / "situation.ttl", folder / "marine.ttl")
