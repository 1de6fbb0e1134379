"""What ``explain`` says of values is what the validator takes."""

import itertools
import re
from collections.abc import Iterator
from typing import Any

import pytest
from pydantic import BaseModel, TypeAdapter, ValidationError

from missions.fault import kinds
from missions.files import shipped_abouts
from missions.scenarios.explanations import explanations_of
from missions.scenarios.parts import mission_class
from missions.sweeps.study_file import StudyFile

ONE_OF = re.compile(r'one of ((?:"[^"]*"(?:, )?)+)')


def tables() -> Iterator[type[BaseModel]]:
    """Every table that is explained, those within others too."""
    waiting: list[type[BaseModel]] = [StudyFile, *kinds().values()]
    for mission in {mission_class(about["mission"]): None for about in shipped_abouts().values()}:
        waiting += [mission.Scenario, *mission.sensors.values()]
    seen = set()
    while waiting:
        table = waiting.pop()
        if table in seen:
            continue
        seen.add(table)
        yield table
        for info in table.model_fields.values():
            kinds_within = [info.annotation, *getattr(info.annotation, "__args__", ())]
            waiting += [kind for kind in kinds_within if isinstance(kind, type) and issubclass(kind, BaseModel)]


def choices() -> Iterator[tuple[str, Any, list[list[str]], str]]:
    """Name, type and explained values of every key that takes few values, those of each place of a list."""
    for table in tables():
        explained = explanations_of(table)
        for name, info in table.model_fields.items():
            text = explained.get(name, ("", ""))[0]
            places = [re.findall(r'"([^"]*)"', found[1]) for found in ONE_OF.finditer(text)]
            if places:
                yield f"{table.__name__}.{name}", info.annotation, places, text


def test_values_that_are_explained_are_those_that_are_taken() -> None:
    checked = 0
    for name, annotation, places, text in choices():
        adapter = TypeAdapter(annotation)
        is_list, is_pair = text.startswith("list of"), text.startswith(f"list of {len(places)}: ")
        for chosen in itertools.product(*places):
            adapter.validate_python(list(chosen) if is_list else chosen[0])
        with pytest.raises(ValidationError) as raised:
            adapter.validate_python(["none of them"] * len(places) if is_list else "none of them")
        told = [re.findall(r"'([^']*)'", error["ctx"]["expected"]) for error in raised.value.errors() if "ctx" in error]
        assert all(values in places for values in told), name
        assert len(told) == len(places) or not is_pair, name
        checked += 1
    assert checked >= 8
