"""Stated observations of vehicles with uncertainty, for comparison with the truth."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from typing import Any, cast

from worldmodel import Block, Estimate, Observation, PropertyValue, TBox, core_ontology_paths, fused, read_tbox
from worldmodel.ontology.tbox import MEASURED


def stated(
    items: Iterable[tuple[Any, ...]], tbox: TBox, vehicles: Iterable[str]
) -> dict[tuple[str, str], list[Observation]]:
    """Return uncertain observations by subject and attribute, excluded vehicles included.

    ``items`` are rows of that table; ``vehicles`` are names by number.
    """
    attributes = {a.name: a for a in tbox.attributes if a.kind in MEASURED and a.uncertainty is not None}
    numbers = {name: number for number, name in enumerate(vehicles)}
    observations = defaultdict[tuple[str, str], list[Observation]](list)
    for n_row, (_, origin, time_s, _, subject, name, text, _, sigma) in enumerate(items):
        if sigma and (attribute := attributes.get(name)) is not None:
            fact = PropertyValue(0, attribute.uid, tbox.value_of(attribute, text), float(sigma))
            observations[subject, name].append(Observation(Block(numbers[origin], n_row, time_s, (fact,)), 0))
    return observations


def places_m(
    items: Iterable[tuple[Any, ...]], vehicles: Iterable[str]
) -> Iterator[list[tuple[tuple[float, float], float]]]:
    """Yield per thing its fused ``location`` and standard deviation (m) after each observation."""
    tbox = read_tbox(*core_ontology_paths())
    location = tbox.attribute_named("location")
    for (_, name), looks in stated(items, tbox, vehicles).items():
        if name == location.name:
            of_looks = (cast(Estimate, fused(location, looks[: n + 1])) for n in range(len(looks)))
            yield [(cast(tuple[float, float], e.value), cast(float, e.uncertainty)) for e in of_looks]
