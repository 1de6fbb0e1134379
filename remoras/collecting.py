"""Garbage-collector thresholds for runs and planning."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

COLLECT_AFTER = 1_000_000
"""New objects between garbage collections meanwhile."""


@contextmanager
def rare_collections() -> Iterator[None]:
    """Collect garbage less often inside the context.

    A run makes many values and hardly any cycles; collection would take a sixth of its time, and up to two fifths of a
    plan of 10,000 levels. A rarer setting is kept; of overlapping contexts the end of the first ends it.
    """
    usual = gc.get_threshold()
    if usual[0] >= COLLECT_AFTER:
        yield
        return
    gc.set_threshold(COLLECT_AFTER, *usual[1:])
    try:
        yield
    finally:
        gc.set_threshold(*usual)
