"""alog: text logs of MOOS, one for each vehicle as MOOS writes them, for alogview and the alog tools.

A line has time, variable, source and value. alogview finds the vehicle in ``NODE_REPORT_LOCAL`` and plots what is a
number. Names and places are written without blanks, commas and equals signs, which separate fields there.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from heapq import merge
from pathlib import Path
from typing import NamedTuple

import numpy as np

from visualisation.exports.formats import Counts
from visualisation.exports.names import file_names
from visualisation.exports.voyage import Voyage, VoyageTrack

RULE = "%" * 92
SOURCE = "remoras"
SHAPES = {"ASV": "kayak", "AUV": "uuv"}
"""Shapes of vehicles in alogview, by type."""


class LogLine(NamedTuple):
    """One line of a log."""

    time_s: float
    variable: str
    value: str

    @property
    def text(self) -> str:
        """The line in four columns."""
        return f"{self.time_s:<15.5f} {self.variable:<20} {SOURCE:<12} {self.value}\n"


def write(voyage: Voyage, target: Path) -> Counts:
    """Make a folder with ``<vehicle>.alog`` for every vehicle; see ``formats.Writer``."""
    target.mkdir()
    counts: dict[str, int] = {}
    for vehicle, name in file_names(voyage.vehicles).items():
        track = voyage.tracks.get(vehicle)
        streams = [_events(voyage, vehicle), *([_reports(voyage, vehicle, track)] if track else [])]
        with (target / f"{name}.alog").open("w", encoding="utf-8", newline="\n") as file:
            file.write(f"{RULE}\n%% LOG FILE:       {name}.alog\n%% FILE OPENED ON  Thu Jan  1 00:00:00 1970\n")
            file.write(f"%% LOGSTART           0.0\n{RULE}\n")
            for line in merge(*streams, key=lambda line: line.time_s):
                file.write(line.text)
                counts[line.variable] = counts.get(line.variable, 0) + 1
    return counts


def word(text: str) -> str:
    """Text without what separates fields and columns.

    >>> word("my dock, west")
    'my_dock_west'
    """
    return re.sub(r"[\s,=]+", "_", text).strip("_") or "_"


def _reports(voyage: Voyage, vehicle: str, track: VoyageTrack) -> Iterator[LogLine]:
    """Where the vehicle is, at every point of its track."""
    shape = SHAPES.get(voyage.vehicles[vehicle], "uuv")
    headings_deg = ((90.0 - np.degrees(track.heading_rad)) % 360.0).tolist()
    degrees = [""] * track.time_s.size
    if voyage.datum is not None:
        latitudes, longitudes = voyage.datum.degrees(track.x_m, track.y_m)
        degrees = [f",LAT={lat:.8f},LON={lon:.8f}" for lat, lon in zip(latitudes, longitudes, strict=True)]
    columns = (*(column.tolist() for column in track[:4]), headings_deg, track.speed_mps.tolist(), degrees)
    for time_s, x_m, y_m, depth_m, heading_deg, speed_mps, where in zip(*columns, strict=True):
        report = (
            f"NAME={word(vehicle)},TYPE={shape},TIME={time_s:.2f},X={x_m:.2f},Y={y_m:.2f},SPD={speed_mps:.3f},"
            f"HDG={heading_deg:.2f},DEPTH={depth_m:.2f}{where}"
        )
        yield LogLine(time_s, "NODE_REPORT_LOCAL", report)
        numbers = {"X": x_m, "Y": y_m, "DEPTH": depth_m, "HEADING": heading_deg, "SPEED": speed_mps}
        for name, value in numbers.items():
            yield LogLine(time_s, f"NAV_{name}", f"{value:.3f}")


def _events(voyage: Voyage, vehicle: str) -> Iterator[LogLine]:
    """What is said of the run, and what befell the vehicle, in time order."""
    said = {key: text for key, text in voyage.about.items() if key != "scenario_toml"}
    lines = [LogLine(0.0, f"REMORAS_{key.upper()}", _one_line(text)) for key, text in said.items()]
    if voyage.datum is not None:
        lines.append(LogLine(0.0, "LAT_ORIGIN", f"{voyage.datum.latitude_deg:.8f}"))
        lines.append(LogLine(0.0, "LONG_ORIGIN", f"{voyage.datum.longitude_deg:.8f}"))
    for place in voyage.places:
        points = [f"{x_m:.2f},{y_m:.2f}" for x_m, y_m in place.outline_m]
        if len(points) == 1:
            lines.append(LogLine(0.0, "VIEW_POINT", f"x={points[0].replace(',', ',y=')},label={word(place.name)}"))
        else:
            outline = ":".join([*points, points[0]])
            lines.append(LogLine(0.0, "VIEW_SEGLIST", f"pts={{{outline}}},label={word(place.name)}"))
    lines += [LogLine(state.time_s, "ROLE", state.text) for state in voyage.states if state.vehicle == vehicle]
    for packet in voyage.packets:
        what = f"slot={packet.slot},sender={word(packet.sender)},bits={packet.size_bits}"
        if packet.sender == vehicle:
            lines.append(LogLine(packet.time_s, "PACKET_SENT", f"{what},heard={len(packet.receivers)}"))
        elif vehicle in packet.receivers:
            lines.append(LogLine(packet.end_s, "PACKET_HEARD", what))
        elif vehicle in packet.lost_by:
            lines.append(LogLine(packet.end_s, "PACKET_LOST", what))
    for entry in voyage.log:
        if entry.about == vehicle or entry.about not in voyage.vehicles:
            about = "" if entry.about in ("", vehicle) else f"{entry.about}: "
            lines.append(LogLine(entry.time_s, "LOG", _one_line(f"{about}{entry.text}")))
    return iter(sorted(lines, key=lambda line: line.time_s))


def _one_line(text: str) -> str:
    return " ".join(text.split())
