"""netCDF export: CF-1.8 trajectories as a contiguous ragged array: ``obs`` vehicle by vehicle, ``row_size`` of each.

``state`` is a flag of the active roles. Values are reproducible; bytes are not, since HDF5 stores the time of writing.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import netCDF4
import numpy as np

from visualisation.exports import Counts
from visualisation.exports.voyage import WAITING, Datum, Voyage
from visualisation.run_records import joined

UNITS_OF_TIME = "seconds since 1970-01-01 00:00:00 UTC"
COMPRESSED: dict[str, Any] = {"compression": "zlib", "complevel": 4, "shuffle": True}
COORDINATES = "time latitude longitude depth"


def write(voyage: Voyage, target: Path) -> Counts:
    """Write one file; see ``Writer``."""
    assert voyage.datum is not None  # checked by the caller
    names = list(voyage.tracks)
    sizes = [voyage.tracks[name].time_s.size for name in names]
    # In memory: on a full disk the library leaves a partial file without a useful error.
    file = netCDF4.Dataset("run.nc", "w", format="NETCDF4", memory=1024)
    try:
        file.setncatts(_about(voyage))
        file.createDimension("trajectory", len(names) or None)
        file.createDimension("obs", sum(sizes) or None)
        encoded = np.array([name.encode() for name in names], dtype="S")
        letters = encoded.view("S1").reshape(len(names), encoded.itemsize)
        file.createDimension("name_length", encoded.itemsize)
        _variable(
            file, "trajectory", "S1", ("trajectory", "name_length"), letters,
            cf_role="trajectory_id", long_name="name of the vehicle",
        )  # fmt: skip
        _variable(
            file, "row_size", "i4", ("trajectory",), np.array(sizes, dtype="i4"),
            long_name="number of points of the vehicle", sample_dimension="obs",
        )  # fmt: skip
        _points(file, voyage, voyage.datum)
    except BaseException:
        file.close()
        raise
    target.write_bytes(file.close())
    return {"trajectories": len(names), "points": sum(sizes)}


def _about(voyage: Voyage) -> dict[str, Any]:
    provenance = voyage.about
    return {
        "Conventions": "CF-1.8",
        "featureType": "trajectory",
        "title": "{scenario}, strategy {strategy}, seed {seed}".format_map(provenance),
        "institution": "simulated",
        "source": f"simulation by {provenance['version']}",
        "history": f"written by {provenance['version']}; a run has no date: mission time 0 is the beginning of 1970",
        "references": "Carlesi et al. 2011, REMORAS",
        "comment": "positions are true ones, not those that a vehicle estimates",
        **{f"remoras_{name}": text for name, text in provenance.items() if name != "version"},
    }


def _variable(file: Any, name: str, kind: str, dimensions: tuple[str, ...], values: Any, **attributes: Any) -> None:
    made = file.createVariable(name, kind, dimensions, **COMPRESSED)
    made.setncatts(attributes)
    if len(values):
        made[:] = values


def _points(file: Any, voyage: Voyage, datum: Datum) -> None:
    tracks = list(voyage.tracks.values())
    latitudes, longitudes = datum.degrees(joined(tracks, "x_m"), joined(tracks, "y_m"))
    # Headings of a run are anticlockwise from east, those of CF clockwise from north.
    headings_deg = (90.0 - np.degrees(joined(tracks, "heading_rad"))) % 360.0
    on = ("obs",)
    _variable(file, "time", "f8", on, joined(tracks, "time_s"), standard_name="time", units=UNITS_OF_TIME,
              calendar="standard", axis="T", long_name="mission time")  # fmt: skip
    _variable(file, "latitude", "f8", on, latitudes, standard_name="latitude", units="degrees_north", axis="Y",
              long_name="latitude (WGS 84)")  # fmt: skip
    _variable(file, "longitude", "f8", on, longitudes, standard_name="longitude", units="degrees_east", axis="X",
              long_name="longitude (WGS 84)")  # fmt: skip
    _variable(file, "depth", "f8", on, joined(tracks, "depth_m"), standard_name="depth", units="m", axis="Z",
              positive="down", long_name="depth below the surface")  # fmt: skip
    _variable(file, "x", "f8", on, joined(tracks, "x_m"), units="m", coordinates=COORDINATES,
              long_name="distance east of the datum")  # fmt: skip
    _variable(file, "y", "f8", on, joined(tracks, "y_m"), units="m", coordinates=COORDINATES,
              long_name="distance north of the datum")  # fmt: skip
    _variable(file, "heading", "f8", on, headings_deg, standard_name="platform_orientation", units="degree",
              coordinates=COORDINATES, long_name="heading, clockwise from north")  # fmt: skip
    _variable(file, "speed", "f8", on, joined(tracks, "speed_mps"),
              standard_name="platform_speed_wrt_sea_water", units="m s-1", coordinates=COORDINATES,
              long_name="speed through the water")  # fmt: skip
    _variable(file, "energy", "f8", on, joined(tracks, "energy_j"), units="J", coordinates=COORDINATES,
              long_name="energy left on board")  # fmt: skip
    _states(file, voyage)


def _states(file: Any, voyage: Voyage) -> None:
    meanings = list(dict.fromkeys([WAITING, *(state.text for state in voyage.states)]))
    # CF separates the meanings of flags by blanks.
    words = [meaning.replace(", ", "+").replace(" ", "_") for meaning in meanings]
    values = []
    for name, track in voyage.tracks.items():
        own = [state for state in voyage.states if state.vehicle == name]
        index = np.searchsorted([state.time_s for state in own], track.time_s, side="right") - 1
        flags = np.array([meanings.index(state.text) for state in own] or [0], dtype="i2")
        values.append(flags[np.maximum(index, 0)])
    _variable(
        file, "state", "i2", ("obs",), np.concatenate([np.empty(0, "i2"), *values]), coordinates=COORDINATES,
        long_name="roles that drive the vehicle", flag_values=np.arange(len(meanings), dtype="i2"),
        flag_meanings=" ".join(words),
    )  # fmt: skip
