"""Whole missions in which a member claims to lead a group, under any term, while the head of it is heard or is lost."""

from typing import NamedTuple

import pytest
from sampling import sampled

from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.organisation import Outcome
from remoras.social.leadership import Leadership

GROUP = "Operational"
LOST = 'fault=[{kind="lost",vehicle="AUV00",at_s=500},{kind="lost",vehicle="AUV01",at_s=900}]'


class Ended(NamedTuple):
    """What came of a mission: who has ever obeyed, why others refused, whom those that are left take for the head."""

    completed: bool
    obeyed: set[str]
    refused: dict[str, str]
    heads: dict[str, tuple[str, ...]]


def claimed(forger: str, term: int, at_s: float, *settings: str, seed: int = 1) -> Ended:
    """A mission in which a vehicle claims the group at a time."""
    fleet = assemble(resolved(load("mapping-rendezvous", [("--set", one) for one in settings])), seed)
    facts = (GROUP, "headedBy", forger), (GROUP, "headTerm", term)
    said, obeyed = False, set()
    while fleet.running:
        fleet.step()
        if not said and fleet.now_s >= at_s:
            said = fleet.let_say(forger, lambda beliefs: [beliefs.fact(*fact) for fact in facts])
        obeyed |= {one.name for one in fleet.vehicles if forger in one.social.organisation.heads(GROUP)}
    rows = [row for row in fleet.recorder.organisation if row[5:8] == ("refused", forger, "succeed")]
    left = [one for one in fleet.vehicles if one.is_alive]
    ended = Ended(
        fleet.completed,
        obeyed,
        {row[1]: row[-1] for row in rows},
        {one.name: one.social.organisation.heads(GROUP) for one in left},
    )
    fleet.close()
    return ended


CASES = {
    f"{strategy} {per} {term}": (strategy, per, forger, term)
    for strategy, forger in (("remoras", "AUV01"), ("central", "AUV02"), ("contract-net", "AUV01"), ("cbba", "AUV02"))
    for per in (0.0, 0.4, 0.8)
    for term in (1, 64, 255)
}


@pytest.mark.slow
@pytest.mark.parametrize("case", sampled(CASES, "remoras 0.0 1", "central 0.8 64"))
def test_nobody_obeys_who_claims_while_the_head_is_heard(case: str) -> None:
    """Not even who claims; all four say why, and the mission ends."""
    strategy, per, forger, term = CASES[case]
    ended = claimed(forger, term, 300.0, f"strategy.name={strategy}", f"channel.per={per}")
    assert ended.completed
    assert ended.obeyed == set()
    why = Outcome.HEAD_PRESENT if term <= 64 else Outcome.TERM_LEAPS
    assert ended.refused == dict.fromkeys(("ASV00", "AUV00", "AUV01", "AUV02"), why.value)


@pytest.mark.slow
@pytest.mark.parametrize("term", sampled((1, 64, 65, 128, 254, 255), 255))
def test_no_term_locks_a_group(term: int) -> None:
    """The head is lost, a member claims before anybody misses it, and is lost in turn: AUV02 comes to lead."""
    ended = claimed("AUV01", term, 700.0, "channel.per=0.4", LOST)
    assert ended.completed
    assert {"ASV00", "AUV02"} <= ended.obeyed
    assert ended.heads == {"ASV00": ("AUV02",), "AUV02": ("AUV02",)}


@pytest.mark.slow
def test_by_the_rule_alone_it_is_not_obeyed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Load-bearing: where no head stands against a claim all obey it, the sitting head too."""
    for rule, who in ((True, set()), (False, {"ASV00", "AUV00", "AUV01", "AUV02"})):
        if not rule:
            monkeypatch.setattr(Leadership, "_heads_against", lambda self, *rest: set())
        assert claimed("AUV01", 1, 20.0, "scenario.duration_s=60", "channel.per=0").obeyed == who
