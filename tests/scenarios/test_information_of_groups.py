"""Group facts replicated to all members or held by the leader: bytes saved, and the cost without a leader."""

import pytest
from recorded import flown

from missions.runs.metrics import bits_of
from missions.runs.results import MemoryResults
from missions.runs.run import Run
from remoras.recorder import Content

GROUP = "group.Operational.information"
COMMON = ("channel.per=0.4", "fleet.size=7", "communication.needs_follow=groups", "communication.lease_frames=20")
LOST = 'fault=[{kind="lost", vehicle="AUV00", at_s=600.0}]'


def finished(*settings: str) -> Run:
    return flown("mapping-patches", *COMMON, *settings)


@pytest.fixture(scope="module")
def held() -> Run:
    return finished(f"{GROUP}=held by head")


def cells_known(made: Run, vehicle: str) -> set[str]:
    """Blocks about mapped cells in the world model of a vehicle."""
    model, cell = MemoryResults(made).known(vehicle, made.end_s).model, made.setup.tbox.attribute_named("mappedCell")
    cells = (one for one in model.blocks() if any(fact.attribute == cell.uid for fact in one.facts))
    return {f"{one.origin}-{one.sequence}" for one in cells}


def test_the_leader_holds_all_facts_and_a_member_those_of_its_jobs(held: Run) -> None:
    everything = {row[0].partition(".")[0] for row in held.recorder.items if row[5] == "mappedCell"}
    assert len(cells_known(held, "AUV00")) > 0.95 * len(everything)
    for name in ("AUV01", "AUV02", "AUV03"):
        node = held.setup.nodes[name]
        own = {block for block in everything if int(block.partition("-")[0]) == node}
        assert own <= cells_known(held, name)
        assert len(cells_known(held, name) - own) < 0.1 * len(everything)


def test_facts_held_by_the_leader_take_fewer_bytes(held: Run) -> None:
    """Measured over five seeds: 55 % fewer bits of observations."""
    observations = bits_of(Content.OBSERVATIONS)
    assert observations(held) < 0.6 * observations(finished())
    assert held.completed


def test_a_new_leader_collects_the_facts_of_the_members() -> None:
    made = finished(f"{GROUP}=held by head", LOST)
    successor, leads_s = next(
        (row[1], row[0]) for row in made.recorder.roles if row[0] > 600.0 and row[3:] == ("Coordinator", "assigned")
    )
    told_s = {row[2]: row[0] for row in made.recorder.knowledge if row[4] == "observed"}
    before = {row[0] for row in made.recorder.items if row[5] == "mappedCell" and told_s[row[0]] < leads_s}
    of_others = {row[0] for row in made.recorder.items if row[0] in before and row[1] not in ("AUV00", successor)}
    received_s = {row[2]: row[0] for row in made.recorder.knowledge if row[1] == successor and row[4] == "received"}
    assert of_others <= set(received_s)
    assert sum(received_s[item] >= leads_s for item in of_others) > 0.9 * len(of_others)
    assert made.completed
