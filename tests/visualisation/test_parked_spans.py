"""When a vehicle does without a peer, from the events of the table ``peers``."""

import pytest

from visualisation.runs.links import spans_without


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
    found = spans_without(Peers([(20.0, "parked"), (60.0, event)]), 100.0)  # type: ignore[arg-type]
    assert [(span.start_s, span.end_s) for span in found["A", "B"]] == [(20.0, end_s)]


def test_whatever_else_is_noticed_of_a_peer_says_why_it_is_done_without() -> None:
    """Figures know no feature by which a vehicle gives a peer up."""
    rows = [(10.0, "slot conflict"), (20.0, "begins anew"), (30.0, "given up"), (40.0, "parked"), (50.0, "heard again")]
    found = spans_without(Peers(rows), 100.0)  # type: ignore[arg-type]
    assert [(span.start_s, span.end_s) for span in found["A", "B"]] == [(30.0, 50.0)]
