"""Kinds of faults keep to their seam; one that does not is refused by what is wrong with it."""

import sys
from typing import Any

import pytest
from sampling import sampled

from missions.fault import kinds
from missions.scenarios.faults import kind_named
from remoras.testing import faults as conformance

KEYS: dict[str, dict[str, Any]] = {"biased": {"attribute": "location", "offset": [1.0, 1.0]}}
"""Keys that a kind cannot do without."""
LEAKING = """
from remoras import Condition, DeclaredFault


class Leaks(DeclaredFault):
    TEXT = "it loses power, for good"

    def begin(self, vehicle):
        vehicle.functional.loads_w.append(5.0)

    def end(self, vehicle, host):
        pass


ASKED = []


class Fickle(DeclaredFault):
    TEXT = "it says another thing each time"

    def leaves(self, data):
        return Condition(is_mute=True)

    def detail(self, data, how_long):
        ASKED.append(1)
        return f"asked {len(ASKED)} times, {how_long}"
"""


@pytest.mark.parametrize("kind", sampled(kinds(), "restarts", "drains"))
def test_shipped_kinds_conform(kind: str) -> None:
    assert len(list(conformance.conforms(kind, KEYS.get(kind)))) == len(conformance.CHECKS)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("Leaks", "its end leaves 1 in vehicle.functional.loads_w: take away what begin has added"),
        ("Fickle", "its rows in the table of faults are"),
    ],
)
def test_a_kind_that_does_not_is_told_why(name, says, tmp_path, monkeypatch) -> None:
    (tmp_path / "leaking_kinds.py").write_text(LEAKING, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "leaking_kinds", raising=False)
    kind_named.cache_clear()
    with pytest.raises(AssertionError, match=says):
        conformance.check(f"leaking_kinds:{name}")
