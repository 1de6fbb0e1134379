"""Names of items in tables (``remoras.recorder.ITEMS``): taken apart into numbers, which a page puts together again."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

NAME = re.compile(
    r"\d+(?:\.e(?P<epoch>\d+))?(?:-(?P<kept>p?)(?P<sequence>\d+)(?:\.(?P<part>\d+))?"
    r"|@[^:]+:(?P<subject>\d+)\.(?P<attribute>\d+))"
)
"""Names of items, of what is kept, and of statuses, see ``remoras.recorder.ITEMS``."""
TOLD_FORM, KEPT_FORM, STATUS_FORM = range(3)


def read_name(uid: str) -> tuple[int, dict[str, int]]:
    """The form of a name, and the numbers in it; those that it lacks are 0.

    >>> read_name("2@1.5:7.3")[0], read_name("2.e1-17.4")[1]["sequence"]
    (2, 17)
    """
    found = NAME.fullmatch(uid)
    said = found.groupdict() if found is not None else dict.fromkeys(NAME.groupindex)
    form = STATUS_FORM if said["subject"] else KEPT_FORM if said.pop("kept") else TOLD_FORM
    return form, {key: int(value or 0) for key, value in said.items() if key != "kept"}


def by_item(rows: Iterable[Mapping[str, Any]]) -> Iterator[list[Mapping[str, Any]]]:
    """Facts item by item; where two statuses have one name, the second begins as the first one did."""
    item: list[Mapping[str, Any]] = []
    for row in rows:
        if item and (row["uid"] != item[0]["uid"] or ("@" in row["uid"] and _begins_alike(row, item[0]))):
            yield item
            item = []
        item.append(row)
    if item:
        yield item


def _begins_alike(row: Mapping[str, Any], first: Mapping[str, Any]) -> bool:
    return row["recorded_s"] != first["recorded_s"] or (row["subject"], row["attribute"]) == (
        first["subject"],
        first["attribute"],
    )
