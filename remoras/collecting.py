"""How often Python looks for garbage in cycles while much is made and hardly any cycle: in runs, and in planning."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

COLLECT_AFTER = 1_000_000
"""New objects after which the garbage collector looks for cycles meanwhile."""


@contextmanager
def rare_collections() -> Iterator[None]:
    """Let the garbage collector look less often meanwhile.

    A run makes many values and hardly any cycles; searching them for cycles would cost a sixth of its time, and up to
    two fifths of that of a plan of 10,000 levels. Where it is rare already it is left so: of several that overlap the
    end of the first ends it.
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
