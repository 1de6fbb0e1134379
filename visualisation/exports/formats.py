"""Formats by name: what becomes of a run in each, and which libraries that takes. Nothing of them is loaded here."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from visualisation.exports.voyage import Voyage

Counts = Mapping[str, int]
"""How many messages, rows or features there are, by topic, table or kind."""


class Writer(Protocol):
    """What the module of a format offers as ``write``."""

    def __call__(self, voyage: Voyage, target: Path) -> Counts:
        """Write a run.

        Args:
            voyage: the run.
            target: a file, or a folder to be made, that is not there yet.

        Returns:
            What was written.

        Raises:
            ExportError: the run cannot be written in this format.
            OSError: the disk is full, or the target cannot be written.
        """


class FormatOfExport(NamedTuple):
    """A format.

    Args:
        meaning: for whom it is.
        ending: of its files; empty if it is a folder.
        libraries: packages that it needs beside those of the program.
        needs_datum: whether it has only latitudes and longitudes.
        inside: endings of the files in its folder.
    """

    meaning: str
    ending: str
    libraries: tuple[str, ...] = ()
    needs_datum: bool = False
    inside: tuple[str, ...] = ()


FORMATS: Mapping[str, FormatOfExport] = {
    "mcap": FormatOfExport("one file for Foxglove", ".mcap", ("mcap", "rosbags")),
    "rosbag2": FormatOfExport("a folder for ROS 2", "", ("rosbags",), inside=(".yaml", ".mcap")),
    "geojson": FormatOfExport("tracks and places for QGIS and Neptus", ".geojson", needs_datum=True),
    "kml": FormatOfExport("moving vehicles for Google Earth and Neptus", ".kml", ("simplekml",), needs_datum=True),
    "netcdf": FormatOfExport("trajectories with CF conventions", ".nc", ("netCDF4",), needs_datum=True),
    "csv": FormatOfExport("a folder with a file for each table", "", inside=(".csv",)),
    "alog": FormatOfExport("a folder with a log for each vehicle, for alogview of MOOS-IvP", "", inside=(".alog",)),
    "graphml": FormatOfExport("a folder with graphs for Gephi and yEd", "", ("networkx",), inside=(".graphml",)),
    "trace": FormatOfExport("who heard and lost each packet, for the channel trace", ".trace.csv"),
}
"""All formats; the module of each has its name."""
