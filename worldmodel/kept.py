"""Tables of ontologies, kept from one process to the next in the user's folder for caches.

To read Turtle takes a hundred times as long as to read the tables that it is compiled to. A file is named by a digest
of the texts and of the code that compiles them, so it is never that of another ontology or version. It begins with a
digest of what follows: a file that was cut short or changed is compiled anew. Where nothing can be written, nothing is
kept.

Nothing that a file names is run: it is JSON, of numbers, texts and values of the classes of ``_KINDS``.
"""

import dataclasses
import hashlib
import json
import os
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from worldmodel.axioms import Axioms, Definition, ValueCondition
from worldmodel.fields import Field
from worldmodel.tbox import Attribute, Individual, OntologyClass, Source, TBox, ValueKind

MOST_FILES = 64
"""Ontologies that are kept: of more the oldest go."""
_DIGEST_BYTES = 32
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
        content = _file(sources).read_bytes()
        if hashlib.sha256(content[_DIGEST_BYTES:]).digest() != content[:_DIGEST_BYTES]:
            return None
        classes, attributes, disjoint, axioms, individuals = map(_made, json.loads(content[_DIGEST_BYTES:]))
        return TBox(classes, attributes, disjoint, tuple(sources), axioms, individuals)
    except (OSError, RuntimeError, ValueError, TypeError, KeyError, AttributeError, IndexError):
        return None


def keep(tbox: TBox) -> None:
    """Keep the tables for the next process, if they can be written."""
    tables = json.dumps(_plain((tbox.classes, tbox.attributes, tbox.disjoint, tbox.axioms, tbox.individuals))).encode()
    with suppress(OSError, RuntimeError):
        file = _file(tbox.sources)
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=file.parent, suffix=".draft", delete=False) as draft:
            draft.write(hashlib.sha256(tables).digest() + tables)
        Path(draft.name).replace(file)
        files = sorted(file.parent.iterdir(), key=lambda each: each.stat().st_mtime)
        for old in files[:-MOST_FILES]:
            old.unlink(missing_ok=True)


def _file(sources: Sequence[Source]) -> Path:
    digest = hashlib.sha256(_code())
    for source in sources:
        digest.update(hashlib.sha256(source.text.encode()).digest())
    base = os.environ.get("XDG_CACHE_HOME")
    folder = Path(base) if base else Path.home() / ".cache"
    return folder / "remoras" / "ontologies" / digest.hexdigest()[:32]


@cache
def _code() -> bytes:
    """A digest of all that compiles: the modules of this package, and which rdflib is there."""
    digest = hashlib.sha256()
    for module in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(hashlib.sha256(module.read_bytes()).digest())
    found = find_spec("rdflib")
    if found is not None and found.origin is not None:
        digest.update(f"{found.origin} {Path(found.origin).stat().st_mtime_ns}".encode())
    return digest.digest()
