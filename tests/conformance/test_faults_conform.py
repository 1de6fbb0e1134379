"""Shipped kinds of faults conform; a kind that does not is refused with the reason."""

import sys
from typing import Any

import pytest
from sampling import sampled

from missions.fault import kinds
from remoras.testing import faults as conformance

KEYS: dict[str, dict[str, Any]] = {"biased": {"attribute": "location", "offset": [1.0, 1.0]}}
"""Keys that a kind cannot do without."""
FICKLE = """
from remoras import Condition, DeclaredFault


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


def test_a_nonconforming_fault_kind_is_refused_with_the_reason(tmp_path, monkeypatch) -> None:
    (tmp_path / "fickle_kinds.py").write_text(FICKLE, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "fickle_kinds", raising=False)
    with pytest.raises(AssertionError, match="its rows in the table of faults are"):
        conformance.check("fickle_kinds:Fickle")
