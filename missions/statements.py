"""Facts that vehicles stated: rows of the table ``items`` by item, and observations with uncertainty."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, cast

from worldmodel import Block, Estimate, Observation, PropertyValue, TBox, core_ontology_paths, fused, read_tbox
from worldmodel.ontology.tbox import MEASURED


def stated(
    items: Iterable[tuple[Any, ...]], tbox: TBox, vehicles: Iterable[str]
) -> dict[tuple[str, str], list[Observation]]:
    """Return uncertain observations by subject and attribute, excluded vehicles included; ``vehicles`` by number."""
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


def rows_by_item(
    rows: Iterable[Mapping[str, Any]], name_of: Callable[[str], Any] = str
) -> Iterator[list[Mapping[str, Any]]]:
    """Yield the rows of ``items`` by item (``name_of`` its uid); a repeated first fact begins another status."""
    item: list[Mapping[str, Any]] = []
    for row in rows:
        if item and not _goes_on(item[0], row, name_of):
            yield item
            item = []
        item.append(row)
    if item:
        yield item


def _goes_on(first: Mapping[str, Any], row: Mapping[str, Any], name_of: Callable[[str], Any]) -> bool:
    is_another = "@" in row["uid"] and (
        row["recorded_s"] != first["recorded_s"]
        or (row["subject"], row["attribute"]) == (first["subject"], first["attribute"])
    )
    return bool(name_of(row["uid"]) == name_of(first["uid"])) and not is_another
