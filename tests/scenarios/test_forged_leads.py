"""Whole missions in which a member claims to lead a group, under any term, while the head of it is heard or is lost."""

import pytest

from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.fleet.fleet import Fleet
from remoras.organisation import Outcome
from remoras.organisation.leadership import Leadership

GROUP = "Operational"


def claimed(forger: str, term: int, at_s: float, *settings: str) -> tuple[Fleet, set[str]]:
    """A fleet after a mission in which a vehicle claims the group at a time, and who has ever obeyed."""
    fleet = assemble(resolved(load("mapping-rendezvous", [("--set", one) for one in settings])), 1)
    facts = (GROUP, "headedBy", forger), (GROUP, "headTerm", term)
    said, obeyed = False, set()
    while fleet.running:
        fleet.step()
        if not said and fleet.now_s >= at_s:
            said = fleet.let_say(forger, lambda beliefs: [beliefs.fact(*fact) for fact in facts])
        obeyed |= {one.name for one in fleet.vehicles if forger in one.social.organisation.heads(GROUP)}
    return fleet, obeyed


@pytest.mark.slow
@pytest.mark.parametrize(
    ("strategy", "forger", "per", "term"), [("remoras", "AUV01", 0.0, 1), ("central", "AUV02", 0.8, 64)]
)
def test_nobody_obeys_who_claims_while_the_head_is_heard(strategy: str, forger: str, per: float, term: int) -> None:
    """Not even who claims; all four say why, and the mission ends."""
    fleet, obeyed = claimed(forger, term, 300.0, f"strategy.name={strategy}", f"channel.per={per}")
    assert (fleet.completed, obeyed) == (True, set())
    rows = [row for row in fleet.recorder.organisation if row[5:8] == ("refused", forger, "succeed")]
    refused = {row[1]: row[-1] for row in rows}
    assert refused == dict.fromkeys(("ASV00", "AUV00", "AUV01", "AUV02"), Outcome.HEAD_PRESENT.value)


@pytest.mark.slow
def test_by_the_rule_alone_it_is_not_obeyed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Load-bearing: where no head stands against a claim all obey it, the sitting head too."""
    monkeypatch.setattr(Leadership, "_heads_against", lambda self, *rest: set())
    _, obeyed = claimed("AUV01", 1, 20.0, "scenario.duration_s=60", "channel.per=0")
    assert obeyed == {"ASV00", "AUV00", "AUV01", "AUV02"}
