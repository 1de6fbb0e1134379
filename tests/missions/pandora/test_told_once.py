"""What a plan and a negotiation give out at the end of one round is told once."""

from collections import Counter

from missions.runs.run import run
from missions.scenarios import load


def test_an_assignment_is_not_told_twice_at_one_time() -> None:
    """At 1927.7 s the head's plan and its negotiation gave AUV01 the job of valve B2, each in an item of its own."""
    finished = run(load("pandora-inspection", [("--set", "strategy.name=remoras-planned")]), 1)
    told = Counter(row[1:7] for row in finished.recorder.items if row[5] in ("playsRole", "leftRole"))
    assert told
    assert max(told.values()) == 1
