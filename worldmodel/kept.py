"""Tables of ontologies, kept from one process to the next.

To read Turtle takes a hundred times as long as to read the tables that it is compiled to. Nothing that a file names is
run: it is JSON, of numbers, texts and values of the classes of ``_KINDS``.
"""

import dataclasses
import hashlib
import json
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from worldmodel.axioms import Axioms, Definition, ValueCondition
from worldmodel.caches import files_digest, keep_file, package_mark, read_kept
from worldmodel.fields import Field
from worldmodel.tbox import Attribute, Individual, OntologyClass, Source, TBox, ValueKind

ONTOLOGIES = "ontologies"
_KINDS: dict[str, Callable[..., Any]] = {
    kind.__name__: kind
    for kind in (Attribute, Axioms, Definition, Field, Individual, OntologyClass, ValueCondition, ValueKind)
}


def _plain(value: Any) -> Any:
    """Return tables as JSON has them: a value of a class as its name and what it is made of."""
    if isinstance(value, tuple):
        return [_plain(part) for part in value]
    if isinstance(value, ValueKind):
        return {"ValueKind": [value.value]}
    if dataclasses.is_dataclass(value):
        parts = [getattr(value, field.name) for field in dataclasses.fields(value) if field.init]
        return {type(value).__name__: [_plain(part) for part in parts]}
    return value


def _made(value: Any) -> Any:
    """Return what ``_plain`` took apart; raises KeyError for a class that is no part of tables."""
    if isinstance(value, list):
        return tuple(_made(part) for part in value)
    if isinstance(value, dict):
        ((kind, parts),) = value.items()
        return _KINDS[kind](*map(_made, parts))
    return value


def kept(sources: Sequence[Source]) -> TBox | None:
    """Return what was compiled of these texts before; None if it was not, or cannot be read."""
    try:
        content = read_kept(ONTOLOGIES, _digest(sources)) or b""
        classes, attributes, disjoint, axioms, individuals = map(_made, json.loads(content))
        return TBox(classes, attributes, disjoint, tuple(sources), axioms, individuals)
    except (OSError, ValueError, TypeError, KeyError, AttributeError, IndexError):
        return None


def keep(tbox: TBox) -> None:
    """Keep the tables for the next process, if they can be written."""
    tables = json.dumps(_plain((tbox.classes, tbox.attributes, tbox.disjoint, tbox.axioms, tbox.individuals)))
    with suppress(OSError):
        keep_file(ONTOLOGIES, _digest(tbox.sources), tables.encode())


def _digest(sources: Sequence[Source]) -> bytes:
    digest = hashlib.sha256(_code())
    for source in sources:
        digest.update(hashlib.sha256(source.text.encode()).digest())
    return digest.digest()


@cache
def _code() -> bytes:
    """A digest of all that compiles: the modules of this package, and which rdflib is there."""
    return files_digest(Path(__file__).parent.glob("*.py")) + package_mark("rdflib")
