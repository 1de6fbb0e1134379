"""KML: vehicles as ``gx:Track`` that move with the time slider of Google Earth, places, milestones.

Heights are negative depths, relative to the surface of the sea.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import simplekml

from visualisation import style
from visualisation.exports.clock import date
from visualisation.exports.formats import Counts
from visualisation.exports.geodesy import Datum
from visualisation.exports.voyage import Voyage


def write(voyage: Voyage, target: Path) -> Counts:
    """Write one document with a folder for tracks, places and milestones; see ``formats.Writer``."""
    assert voyage.datum is not None  # the caller has seen to it
    simplekml.Kml.resetidcounter()  # else the ids of a second document of a process went on from the first
    document = simplekml.Kml(name=voyage.title)
    for name, text in voyage.about.items():
        if name != "scenario_toml":
            document.document.extendeddata.newdata(name=name, value=text)
    counts = {
        "tracks": _tracks(voyage, voyage.datum, document.newfolder(name="Vehicles")),
        "places": _places(voyage, voyage.datum, document.newfolder(name="Places")),
        "milestones": _milestones(voyage, voyage.datum, document.newfolder(name="Milestones")),
    }
    target.write_text(document.kml(), encoding="utf-8")
    return counts


def _colour(number: int) -> str:
    """The colour of a vehicle as KML has it: opacity, blue, green, red."""
    rgb = style.vehicle_look(number).colour.lstrip("#").lower()
    return f"ff{rgb[4:6]}{rgb[2:4]}{rgb[0:2]}"


def _tracks(voyage: Voyage, datum: Datum, folder: Any) -> int:
    for number, name in enumerate(voyage.vehicles):
        if (track := voyage.tracks.get(name)) is None:
            continue
        latitudes, longitudes = datum.degrees(track.x_m, track.y_m)
        made = folder.newgxtrack(name=name)
        made.altitudemode = simplekml.AltitudeMode.relativetoground
        made.newwhen([date(time_s) for time_s in track.time_s.tolist()])
        made.newgxcoord(np.column_stack([longitudes, latitudes, 0.0 - track.depth_m]).tolist())
        states = "; ".join(f"{state.time_s:g} s {state.text}" for state in voyage.states if state.vehicle == name)
        made.description = f"{voyage.vehicles[name]}. {states}"
        made.style.linestyle.color = _colour(number)
        made.style.linestyle.width = 2
    return len(voyage.tracks)


def _places(voyage: Voyage, datum: Datum, folder: Any) -> int:
    for place in voyage.places:
        latitudes, longitudes = datum.degrees([x for x, _ in place.outline_m], [y for _, y in place.outline_m])
        ring = np.column_stack([longitudes, latitudes]).tolist()
        if len(ring) == 1:
            folder.newpoint(name=place.name, description=place.kind, coords=ring)
        else:
            made = folder.newpolygon(name=place.name, description=place.kind, outerboundaryis=[*ring, ring[0]])
            made.style.polystyle.fill = 0
            made.style.linestyle.width = 2
    return len(voyage.places)


def _milestones(voyage: Voyage, datum: Datum, folder: Any) -> int:
    found = [milestone for milestone in voyage.results.summary["milestones"] if milestone["vehicle"] in voyage.tracks]
    for one in found:
        ((x_m, y_m, _),) = voyage.tracks[one["vehicle"]].at([one["time_s"]])
        latitude, longitude = datum.degrees(x_m, y_m)
        made = folder.newpoint(
            name=f"{one['vehicle']}: {one['name'].replace('_', ' ')}", coords=[(float(longitude), float(latitude))]
        )
        made.timestamp.when = date(one["time_s"])
    return len(found)
