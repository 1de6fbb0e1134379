"""A trace: who heard and who lost each packet, as the channel ``trace`` replays it.

One line for each packet and each vehicle that was able to hear it. Who was out of action then has none.
"""

from __future__ import annotations

import csv
from pathlib import Path

from visualisation.exports.formats import Counts
from visualisation.exports.voyage import Voyage


def write(voyage: Voyage, target: Path) -> Counts:
    """Make a CSV file of time_s, sender, receiver and lost; see ``formats.Writer``."""
    counts = {"heard": 0, "lost": 0}
    with target.open("w", encoding="utf-8", newline="") as file:
        lines = csv.writer(file)
        lines.writerow(("time_s", "sender", "receiver", "lost"))
        for packet in voyage.packets:
            lines.writerows((packet.time_s, packet.sender, receiver, 0) for receiver in packet.receivers)
            lines.writerows((packet.time_s, packet.sender, receiver, 1) for receiver in packet.lost_by)
            counts["heard"] += len(packet.receivers)
            counts["lost"] += len(packet.lost_by)
    return counts
