"""When a vehicle does without a peer, from the events of the table ``peers``."""

import pytest

from visualisation.runs.links import spans_parked


class Peers:
    """A run that has the table ``peers`` alone."""

    def __init__(self, events: list[tuple[float, str]]) -> None:
        self._rows = [{"time_s": time_s, "vehicle": "A", "peer": "B", "event": event} for time_s, event in events]

    def has(self, name: str) -> bool:
        return name == "peers"

    def table(self, name: str) -> "Peers":
        return self

    def to_pylist(self) -> list[dict[str, object]]:
        return self._rows


@pytest.mark.parametrize(("event", "end_s"), [("heard again", 60.0), ("begins anew", 60.0), ("slot conflict", 100.0)])
def test_a_peer_is_done_without_until_it_is_heard(event: str, end_s: float) -> None:
    found = spans_parked(Peers([(20.0, "parked"), (60.0, event)]), 100.0)  # type: ignore[arg-type]
    assert [(span.start_s, span.end_s) for span in found["A", "B"]] == [(20.0, end_s)]
