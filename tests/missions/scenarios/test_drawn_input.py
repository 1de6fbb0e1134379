"""Shipped scenarios with one random mistake: no traceback, one line per fault with line and value."""

import copy
import random
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import tomli_w

from missions.errors import ConfigurationError
from missions.scenarios import load, shipped

Place = tuple[str | int, ...]
TABLES = [tomllib.loads(path.read_text(encoding="utf-8")) for path in shipped().values()]
OWN = [raw for raw in TABLES if "group" in raw]
OTHERS: tuple[Any, ...] = ("x", 7, -1.5, True, [], {}, [[1.0, "x"]], float("inf"), {"name": 3})


def leaves(value: Any, at: Place = ()) -> Iterator[tuple[Place, Any]]:
    """Every value that is no table and no list of tables or texts, with its place."""
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
        if isinstance(inner, dict) or (isinstance(inner, list) and any(isinstance(one, dict | str) for one in inner)):
            yield from leaves(inner, (*at, key))
        else:
            yield (*at, key), inner


def changed(raw: dict[str, Any], kind: str, draw: random.Random) -> str:
    """A scenario as a text, with a mistake of a kind."""
    places = [(at, value) for at, value in leaves(raw) if at[:2] != ("strategy", "parameters")]
    if kind == "misspelt":
        places = [(at, value) for at, value in places if isinstance(at[-1], str)]
    names = {value for at, value in places if at[-1] == "name"}
    if kind == "reference":
        places = [(at, value) for at, value in places if at[-1] != "name" and value in list(names)]
    (*above, key), value = draw.choice(places)
    table: Any = raw
    for part in above:
        table = table[part]
    if kind == "type":
        table[key] = draw.choice([other for other in OTHERS if type(other) is not type(value)])
    elif kind == "misspelt":
        at = draw.randrange(len(str(key)))
        table[f"{str(key)[:at]}q{str(key)[at:]}"] = table.pop(key)
    elif kind == "reference":
        table[key] = "Nobody"
    text = tomli_w.dumps(raw)
    headers = [line for line in text.splitlines() if line.startswith("[") and "." not in line and line[1] != "["]
    return text if kind != "twice" else f"{text}\n{draw.choice(headers)}\n"


@pytest.mark.parametrize("kind", ["type", "misspelt", "twice", "reference"])
@pytest.mark.parametrize("number", range(10))
def test_random_mistake_gives_one_line_per_fault(tmp_path: Path, kind: str, number: int) -> None:
    draw = random.Random(f"{kind} {number}")
    file = tmp_path / "own.toml"
    file.write_text(changed(copy.deepcopy(draw.choice(OWN)), kind, draw), encoding="utf-8")
    told: list[tuple[str, str]] = []
    try:
        load(str(file))
    except ConfigurationError as error:
        told = list(zip([fault.key for fault in error.faults], str(error).splitlines(), strict=True))
    assert len(told) <= 2
    for key, line in told:
        place = rf"{re.escape(str(file))}:\d+: {re.escape(key)}"
        assert re.fullmatch(rf"{place}: missing|{place}( = .+)?: .{{10,}}", line)  # line, key, given, allowed
    assert told or kind in ("type", "misspelt")  # a text of any content, a key of a free table
    if kind == "misspelt" and told:
        assert any("did you mean" in line or "missing: " in line for _, line in told)


@pytest.mark.parametrize("number", range(40))
def test_junk_in_place_of_any_value_is_a_fault_and_no_crash(tmp_path: Path, number: int) -> None:
    draw = random.Random(f"junk {number}")
    raw = copy.deepcopy(draw.choice(OWN))
    at: Any = raw
    while draw.random() < 0.8 and (
        inner := [one for one in places(at) if isinstance(at[one], dict | list) and at[one]]
    ):
        at = at[draw.choice(inner)]
    at[draw.choice(places(at))] = draw.choice(OTHERS)
    file = tmp_path / "own.toml"
    file.write_text(tomli_w.dumps(raw), encoding="utf-8")
    said = ""
    try:
        load(str(file))
    except ConfigurationError as error:
        said = str(error)
    assert all(line.startswith(str(file)) for line in said.splitlines())


def places(of: Any) -> list[Any]:
    """Keys of a table, or numbers of a list; none of a value."""
    return list(of) if isinstance(of, dict) else list(range(len(of))) if isinstance(of, list) else []
