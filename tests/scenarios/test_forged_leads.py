"""Whole missions in which a member claims to lead a group, under any term, while the head of it is heard or is lost."""

import pytest
from sampling import sampled

from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.fleet import Fleet
from remoras.organisation import Outcome
from remoras.social.leadership import LeadershipHistory

GROUP = "Operational"
LOST = 'fault=[{kind="lost",vehicle="AUV00",at_s=500},{kind="lost",vehicle="AUV01",at_s=900}]'


def claimed(forger: str, term: int, at_s: float, *settings: str, seed: int = 1) -> tuple[Fleet, set[str]]:
    """A mission in which a vehicle claims the group at a time, after its end; and who took it for the head."""
    setup = resolved(load("mapping-rendezvous", [("--set", one) for one in settings]))
    fleet = assemble(setup, seed)
    said, obey = False, set()
    while fleet.running:
        fleet.step()
        if not said and fleet.now_s >= at_s:
            said = fleet.let_say(
                forger,
                lambda beliefs: [
                    beliefs.fact(GROUP, "headedBy", forger),
                    beliefs.fact(GROUP, "headTerm", term),
                ],
            )
        obey |= {one.name for one in fleet.vehicles if forger in one.social.organisation.heads(GROUP)}
    fleet.close()
    return fleet, obey


def refused(fleet: Fleet, issuer: str) -> dict[str, str]:
    """Why vehicles refused claims of an issuer, by their names."""
    rows = [row for row in fleet.recorder.organisation if row[5:8] == ("refused", issuer, "succeed")]
    return {row[1]: row[-1] for row in rows}


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
    fleet, obey = claimed(forger, term, 300.0, f"strategy.name={strategy}", f"channel.per={per}")
    assert fleet.completed
    assert obey == set()
    why = Outcome.HEAD_PRESENT if term <= 64 else Outcome.TERM_LEAPS
    assert refused(fleet, forger) == dict.fromkeys(("ASV00", "AUV00", "AUV01", "AUV02"), why.value)


@pytest.mark.slow
@pytest.mark.parametrize("term", sampled((1, 64, 65, 128, 254, 255), 255))
def test_no_term_locks_a_group(term: int) -> None:
    """The head is lost, a member claims before anybody misses it, and is lost in turn: AUV02 comes to lead."""
    fleet, obey = claimed("AUV01", term, 700.0, "channel.per=0.4", LOST)
    assert fleet.completed
    assert {"ASV00", "AUV02"} <= obey
    for vehicle in fleet.vehicles:
        assert vehicle.is_alive == (vehicle.name in ("ASV00", "AUV02"))
        if vehicle.is_alive:
            assert vehicle.social.organisation.heads(GROUP) == ("AUV02",)


def test_by_the_rule_alone_it_is_not_obeyed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Load-bearing: where no head stands against a claim all obey it, the sitting head too."""
    for rule, who in ((True, set()), (False, {"ASV00", "AUV00", "AUV01", "AUV02"})):
        if not rule:
            monkeypatch.setattr(LeadershipHistory, "_heads_against", lambda self, *rest: set())
        _, obey = claimed("AUV01", 1, 20.0, "scenario.duration_s=60", "channel.per=0")
        assert obey == who
