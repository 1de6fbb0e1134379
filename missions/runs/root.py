"""The root of the draws of a run, which notes whether anybody drew: a run without draws is the same with every seed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario

OURS = frozenset({"worldmodel", "exchange", "remoras", "missions", "visualisation"})
"""Packages of this program."""
REFERENCE = re.compile(r"([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*):[A-Za-z_][\w.]*")
"""``package.module:object``."""


class Root(int):
    """A seed that notes whether anything was drawn from it.

    All draws are made by ``exchange.acoustics.loss``, which adds 1 to the seed before it scrambles it. So nobody who
    draws can forget to say so, and nothing is asked of those who do not.

    >>> seed = Root(7)
    >>> seed.is_drawn_from, seed + 1, seed.is_drawn_from
    (False, 8, True)
    """

    is_drawn_from = False

    def __add__(self, other: int) -> int:
        self.is_drawn_from = True
        return int(self) + other


def is_drawn(root: int, scenario: Scenario, strategy: object) -> bool | None:
    """Whether anything was drawn in a run; None where nobody can say, for parts of a user's own may draw unseen.

    Args:
        root: of its draws.
        scenario: of the run.
        strategy: of the run.
    """
    if not isinstance(root, Root) or root.is_drawn_from:
        return True
    is_ours = type(strategy).__module__.partition(".")[0] in OURS
    parts = scenario.model_dump(mode="json", exclude={"scenario": {"metrics"}})  # which are asked when the run is over
    return False if is_ours and not any(map(is_reference, texts(parts))) else None


def texts(value: Any) -> Iterator[str]:
    """Every text in nested tables and lists."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for entry in value.values() if isinstance(value, dict) else value:
            yield from texts(entry)


def is_reference(text: str) -> bool:
    """True for a text that may name an object of a module that is not this program's own."""
    match = REFERENCE.fullmatch(text)
    return match is not None and match[1].partition(".")[0] not in OURS
