"""Stated observations of vehicles with uncertainty, for comparison with the truth."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from typing import Any, cast

from worldmodel import Block, Estimate, Observation, PropertyValue, TBox, core_ontology_paths, fused, read_tbox
from worldmodel.ontology.tbox import MEASURED
from worldmodel.valuetext import from_text, uncertainty_from_text


def stated(
    items: Iterable[tuple[Any, ...]], tbox: TBox, vehicles: Iterable[str]
) -> dict[tuple[str, str], list[Observation]]:
    """Return uncertain observations by subject and attribute, excluded vehicles included.

    ``items`` are rows of that table; ``vehicles`` are names by number.
    """
    attributes = {one.name: one for one in tbox.attributes if one.kind in MEASURED and one.uncertainty is not None}
    numbers = {name: number for number, name in enumerate(vehicles)}
    found = defaultdict[tuple[str, str], list[Observation]](list)
    for n_row, (_, origin, time_s, _, subject, name, text, _, sigma) in enumerate(items):
        if sigma and (attribute := attributes.get(name)) is not None:
            fact = PropertyValue(0, attribute.uid, from_text(tbox, attribute, text), uncertainty_from_text(sigma))
            found[subject, name].append(Observation(Block(numbers[origin], n_row, time_s, (fact,)), 0))
    return found


def places_m(
    items: Iterable[tuple[Any, ...]], vehicles: Iterable[str]
) -> Iterator[list[tuple[tuple[float, float], float]]]:
    """Yield per thing its fused ``location`` and standard deviation (m) after each observation."""
    tbox = read_tbox(*core_ontology_paths())
    location = tbox.attribute_named("location")
    for (_, name), looks in stated(items, tbox, vehicles).items():
        if name == location.name:
            of_looks = (cast(Estimate, fused(location, looks[: n + 1])) for n in range(len(looks)))
            yield [(cast(tuple[float, float], one.value), cast(float, one.uncertainty)) for one in of_looks]
