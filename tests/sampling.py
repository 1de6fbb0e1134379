"""Sampling of long parametrised tests: continuous integration runs a part, ``thorough`` the rest."""

from collections.abc import Iterable
from typing import Any

import pytest


def sampled(cases: Iterable[Any], *kept: Any) -> list[Any]:
    """The cases as parameters; all but those kept are marked ``thorough``. Each of those kept is one of the cases."""
    given = list(cases)
    assert kept, "a test of which no case is tried would never fail"
    assert all(case in given for case in kept), f"{kept} are not all among {given}"
    tuples = [case if isinstance(case, tuple) else (case,) for case in given]
    return [
        pytest.param(*one, marks=() if case in kept else pytest.mark.thorough)
        for case, one in zip(given, tuples, strict=True)
    ]
