"""From whom vehicles received what others observed, read from the packets of a recorded run."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable

from missions.figure import RunResults
from remoras.recorder import PACKETS


class Senders:
    """The senders of the packets that brought items and statuses.

    Args:
        results: of the run.
    """

    def __init__(self, results: RunResults) -> None:
        self._heard: dict[tuple[str, str], list[tuple[float, str]]] = defaultdict(list)
        for row in results.table(PACKETS.name).to_pylist():
            for vehicle, at_s in zip(row["receivers"], row["arrivals_s"], strict=True):
                for uid in (*row["item_uids"], *row["status_uids"]):
                    self._heard[vehicle, uid].append((at_s, row["sender"]))

    def sender(self, vehicle: str, uids: Iterable[str], by_s: float) -> str | None:
        """The sender of the last packet with one of these items that ``vehicle`` heard until then; None if none."""
        heard = [reception for uid in uids for reception in self._heard.get((vehicle, uid), ()) if reception[0] <= by_s]
        return max(heard, key=lambda reception: reception[0])[1] if heard else None
