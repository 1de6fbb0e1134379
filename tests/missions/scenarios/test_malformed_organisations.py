"""Organisations with junk anywhere in them: one clear error or a scenario, never a crash."""

import copy
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from datetime import date
from typing import Any

import tomli_w
from hypothesis import given
from hypothesis import strategies as st

from missions.document import Document
from missions.errors import ConfigurationError
from missions.scenarios import shipped
from missions.scenarios.loading import scenario_from
from missions.scenarios.organisation import TABLES, checked

TEAMS = shipped()["mapping-nine-teams"]
GROUPS = tomllib.loads((TEAMS.parent / "organisations" / "three-teams.toml").read_text(encoding="utf-8"))
WHOLE = {**tomllib.loads(TEAMS.read_text(encoding="utf-8")), **GROUPS}
del WHOLE["organisation"]
JUNK: list[Any] = [
    5, True, "x", "Fleet", "West.Coordinator", "a.b.c", [], {}, [1], ["Performer"], [[1]], [{}], {"a": 1},
    date(1979, 5, 27), [{"name": 5}], [{"name": "West"}],
]  # fmt: skip
KEYS = ("extends", "within", "template", "incompatible", "authority", "requires", "subgroup", "abstract", "played_by")


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Every place below a value, outermost first; tables may get any of the keys, too."""
    if isinstance(value, dict):
        for key in dict.fromkeys((*value, *KEYS)):
            yield (*path, key)
            yield from places(value.get(key), (*path, key))
    elif isinstance(value, list):
        for number, one in enumerate(value):
            yield (*path, number)
            yield from places(one, (*path, number))


PLACES = [path for path in places(GROUPS) if path[0] in TABLES]


@given(st.sampled_from(PLACES), st.sampled_from(JUNK))
def test_junk_is_refused_or_taken_but_never_a_crash(path: tuple[Any, ...], junk: Any) -> None:
    raw = copy.deepcopy(WHOLE)
    table: Any = raw
    for part in path[:-1]:
        table = table[part]
    table[path[-1]] = junk
    for text, check in (
        (tomli_w.dumps(raw), scenario_from),
        (tomli_w.dumps({key: raw[key] for key in TABLES}), checked),
    ):
        with suppress(ConfigurationError):
            check(Document.of_text(text, "mine.toml"))  # type: ignore[operator]  # each takes a document
