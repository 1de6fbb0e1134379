"""The path of one observation by its item UID: from a sensor on A, over the channel, to a changed plan on B."""

import pytest
from recorded import flown

from missions.runs.run import Run


@pytest.fixture(scope="module")
def finished() -> Run:
    return flown("mapping-rendezvous", "channel.per=0.3", seed=5)


def events_of(finished: Run, item: str) -> list[tuple[float, str, str]]:
    return [(row[0], row[1], row[4]) for row in finished.recorder.knowledge if row[2] == item]


def test_a_finished_area_changes_the_plan_of_the_coordinator(finished: Run) -> None:
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
