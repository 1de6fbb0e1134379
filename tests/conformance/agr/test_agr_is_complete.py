"""Every behaviour is tested by a test that has its number in its name, or is declared to mean nothing here."""

import re
from pathlib import Path

from agr_behaviours import AGR_CODE, BEHAVIOURS, NOT_MEANT

from remoras.organisation import Outcome


def test_every_behaviour_has_a_test_or_a_reason_why_not() -> None:
    texts = [path.read_text(encoding="utf-8") for path in Path(__file__).parent.glob("test_agr_*.py")]
    tested = {int(number) for text in texts for number in re.findall(r"def test_agr_(\d\d)_", text)}
    assert sorted(BEHAVIOURS) == list(range(1, 35))
    assert tested.isdisjoint(NOT_MEANT)
    assert tested | set(NOT_MEANT) == set(BEHAVIOURS)


def test_every_outcome_has_the_return_code_of_the_platforms() -> None:
    assert set(AGR_CODE) == set(Outcome)
