"""GeoJSON export (RFC 7946): tracks, places and milestones as longitude, latitude and height (negative depth)."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from visualisation.exports import Counts
from visualisation.exports.voyage import Datum, Voyage

TRACK, PLACE, MILESTONE = "track", "place", "milestone"  # property ``kind`` of features


def write(voyage: Voyage, target: Path) -> Counts:
    """Write one feature collection; see ``Writer``."""
    assert voyage.datum is not None  # checked by the caller
    features = [*_tracks(voyage, voyage.datum), *_places(voyage, voyage.datum), *_milestones(voyage, voyage.datum)]
    provenance = {name: text for name, text in voyage.about.items() if name != "scenario_toml"}
    whole = {"type": "FeatureCollection", "features": features, "remoras": provenance}
    target.write_text(json.dumps(whole, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8")
    kinds = [feature["properties"]["kind"] for feature in features]
    return {kind: kinds.count(kind) for kind in (TRACK, PLACE, MILESTONE)}


def _feature(kind: str, shape: str, coordinates: Any, **properties: Any) -> dict[str, Any]:
    geometry = {"type": shape, "coordinates": coordinates}
    return {"type": "Feature", "geometry": geometry, "properties": {"kind": kind, **properties}}


def _positions(datum: Datum, x_m: Any, y_m: Any, *height_m: Any) -> list[list[float]]:
    latitudes, longitudes = datum.degrees(x_m, y_m)
    points: list[list[float]] = np.column_stack([longitudes, latitudes, *height_m]).tolist()
    return points


def _tracks(voyage: Voyage, datum: Datum) -> Iterator[dict[str, Any]]:
    for name, track in voyage.tracks.items():
        # A difference, since the negative of 0.0 is written as -0.0.
        points = _positions(datum, track.x_m, track.y_m, 0.0 - track.depth_m)
        states = [[state.time_s, state.text] for state in voyage.states if state.vehicle == name]
        shape, coordinates = ("LineString", points) if len(points) > 1 else ("Point", points[0])
        yield _feature(
            TRACK, shape, coordinates, name=name, vehicle_type=voyage.vehicles[name],
            times_s=track.time_s.tolist(), states=states,
        )  # fmt: skip


def _places(voyage: Voyage, datum: Datum) -> Iterator[dict[str, Any]]:
    for place in voyage.places:
        corners = list(place.outline_m)
        if len(corners) > 2 and _doubled_size_m2(corners) < 0.0:
            corners.reverse()  # RFC 7946 has outer rings anticlockwise
        ring = _positions(datum, *zip(*corners, strict=True))
        shapes: dict[int, tuple[str, Any]] = {1: ("Point", ring[0]), 2: ("LineString", ring)}
        shape, coordinates = shapes.get(len(ring), ("Polygon", [[*ring, ring[0]]]))
        yield _feature(PLACE, shape, coordinates, name=place.name, place=place.kind)


def _milestones(voyage: Voyage, datum: Datum) -> Iterator[dict[str, Any]]:
    for milestone in voyage.results.summary["milestones"]:
        vehicle, time_s = milestone["vehicle"], milestone["time_s"]
        if (track := voyage.tracks.get(vehicle)) is not None:
            ((x_m, y_m, depth_m),) = track.at(time_s)
            (point,) = _positions(datum, x_m, y_m, 0.0 - depth_m)
            yield _feature(MILESTONE, "Point", point, name=milestone["name"], vehicle=vehicle, time_s=time_s)


def _doubled_size_m2(corners: list[tuple[float, float]]) -> float:
    following = [*corners[1:], corners[0]]
    return sum(x * other_y - other_x * y for (x, y), (other_x, other_y) in zip(corners, following, strict=True))
