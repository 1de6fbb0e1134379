"""GeoJSON export (RFC 7946): tracks, places and milestones as longitude, latitude and height (negative depth)."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from visualisation.exports import Counts
from visualisation.exports.voyage import Datum, Voyage, VoyageTrack

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


def _points(datum: Datum, track: VoyageTrack) -> list[list[float]]:
    latitudes, longitudes = datum.degrees(track.x_m, track.y_m)
    # A difference, since the negative of 0.0 is written as -0.0.
    points: list[list[float]] = np.column_stack([longitudes, latitudes, 0.0 - track.depth_m]).tolist()
    return points


def _tracks(voyage: Voyage, datum: Datum) -> Iterator[dict[str, Any]]:
    for name, track in voyage.tracks.items():
        points = _points(datum, track)
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
        latitudes, longitudes = datum.degrees([x for x, _ in corners], [y for _, y in corners])
        ring = np.column_stack([longitudes, latitudes]).tolist()
        if len(ring) == 1:
            yield _feature(PLACE, "Point", ring[0], name=place.name, place=place.kind)
        elif len(ring) == 2:
            yield _feature(PLACE, "LineString", ring, name=place.name, place=place.kind)
        else:
            yield _feature(PLACE, "Polygon", [[*ring, ring[0]]], name=place.name, place=place.kind)


def _milestones(voyage: Voyage, datum: Datum) -> Iterator[dict[str, Any]]:
    for milestone in voyage.results.summary["milestones"]:
        if (track := voyage.tracks.get(milestone["vehicle"])) is not None:
            ((x_m, y_m, depth_m),) = track.at([milestone["time_s"]])
            latitude, longitude = datum.degrees(x_m, y_m)
            point = [float(longitude), float(latitude), 0.0 - depth_m]
            yield _feature(
                MILESTONE,
                "Point",
                point,
                name=milestone["name"],
                vehicle=milestone["vehicle"],
                time_s=milestone["time_s"],
            )


def _doubled_size_m2(corners: list[tuple[float, float]]) -> float:
    following = [*corners[1:], corners[0]]
    return sum(x * other_y - other_x * y for (x, y), (other_x, other_y) in zip(corners, following, strict=True))
