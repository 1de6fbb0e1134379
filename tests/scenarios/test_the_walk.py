"""The walk of one observation: from a sensor on A, over the channel, to a changed plan on B, by one item UID."""

import pytest

from missions.runs.run import Run, run
from missions.scenarios import load

SCENARIO = load("mapping-rendezvous", [("--per", "channel.per=0.3")])


@pytest.fixture(scope="module")
def finished() -> Run:
    return run(SCENARIO, seed=5)


def events_of(finished: Run, item: str) -> list[tuple[float, str, str]]:
    return [(row[0], row[1], row[4]) for row in finished.recorder.knowledge if row[2] == item]


@pytest.mark.slow
def test_a_mapped_cell_becomes_an_item_that_its_peers_receive_and_acknowledge(finished: Run) -> None:
    mapped_s, mapper = next((row[0], row[1]) for row in finished.recorder.rows("coverage") if row[1] == "AUV02")
    item = next(row[2] for row in finished.recorder.knowledge if row[0] == mapped_s and row[1] == mapper)
    events = events_of(finished, item)
    assert events[0] == (mapped_s, "AUV02", "observed")
    received = [vehicle for _, vehicle, event in events if event == "received"]
    assert sorted(received) == ["ASV00", "AUV00", "AUV01"]
    assert (events[-1][1], events[-1][2]) == ("AUV02", "acknowledged")
    assert [event[0] for event in events] == sorted(event[0] for event in events)


def test_a_finished_area_changes_the_coordinators_plan(finished: Run) -> None:
    """AUV02's area is done: AUV00 plans its group's mission anew when the news arrives, not before."""
    done_s = next(m.time_s for m in finished.milestones if m.name == "mapping_done" and m.vehicle == "AUV02")
    item = next(
        row[2] for row in reversed(finished.recorder.knowledge) if row[1] == "AUV02" and row[4] == "observed"
        and row[0] <= done_s
    )  # fmt: skip
    heard_s = next(
        time_s for time_s, vehicle, event in events_of(finished, item) if (vehicle, event) == ("AUV00", "received")
    )
    planned = [row[0] for row in finished.recorder.activities if row[1] == "AUV00" and row[3] == "MissionPlanner"]
    assert heard_s > done_s
    assert heard_s in planned
    assert not [time_s for time_s in planned if done_s - 100.0 < time_s < heard_s]
