"""Latitudes and longitudes: the projection against a formula that shares nothing with it and GeoJSON."""

import itertools
import json
import math
from pathlib import Path

import pytest

from missions.figure import Place
from missions.runs.results import Results
from visualisation.exports import export
from visualisation.exports.geodesy import Datum

MAJOR_M, FLATTENING = 6378137.0, 1 / 298.257223563
MINOR_M = MAJOR_M * (1 - FLATTENING)


def distance_m(from_deg: tuple[float, float], to_deg: tuple[float, float]) -> float:
    """Length of the geodesic on WGS 84 between latitudes and longitudes, by Vincenty's inverse formula (1975)."""
    u1, u2 = (math.atan((1 - FLATTENING) * math.tan(math.radians(one[0]))) for one in (from_deg, to_deg))
    along = lam = math.radians(to_deg[1] - from_deg[1])
    for _ in range(50):
        sin_s = math.hypot(
            math.cos(u2) * math.sin(lam), math.cos(u1) * math.sin(u2) - math.sin(u1) * math.cos(u2) * math.cos(lam)
        )
        cos_s = math.sin(u1) * math.sin(u2) + math.cos(u1) * math.cos(u2) * math.cos(lam)
        sigma = math.atan2(sin_s, cos_s)
        sin_a = math.cos(u1) * math.cos(u2) * math.sin(lam) / sin_s
        cos2_a = 1 - sin_a**2
        cos_2m = cos_s - 2 * math.sin(u1) * math.sin(u2) / cos2_a
        c = FLATTENING / 16 * cos2_a * (4 + FLATTENING * (4 - 3 * cos2_a))
        lam = along + (1 - c) * FLATTENING * sin_a * (sigma + c * sin_s * (cos_2m + c * cos_s * (2 * cos_2m**2 - 1)))
    u_2 = cos2_a * (MAJOR_M**2 - MINOR_M**2) / MINOR_M**2
    a = 1 + u_2 / 16384 * (4096 + u_2 * (-768 + u_2 * (320 - 175 * u_2)))
    b = u_2 / 1024 * (256 + u_2 * (-128 + u_2 * (74 - 47 * u_2)))
    second = b / 6 * cos_2m * (4 * sin_s**2 - 3) * (4 * cos_2m**2 - 3)
    delta = b * sin_s * (cos_2m + b / 4 * (cos_s * (2 * cos_2m**2 - 1) - second))
    return MINOR_M * a * (sigma - delta)


@pytest.mark.parametrize("origin", [(43.35, 3.75), (-33.9, 151.3), (70.0, -179.99), (0.5, 0.0)])
@pytest.mark.parametrize(("x_m", "y_m"), [(450.0, 450.0), (-7000.0, 7000.0), (9000.0, -100.0), (3.0, -8000.0)])
def test_distances_from_the_datum_are_kept(origin: tuple[float, float], x_m: float, y_m: float) -> None:
    """Within 10 km to 3 cm: arc and tangent differ by d**3 / (3 R**2), 0.8 cm at 10 km, and the digits by 1 mm."""
    latitude, longitude = (float(one) for one in Datum(*origin).degrees(x_m, y_m))
    assert distance_m(origin, (latitude, longitude)) == pytest.approx(math.hypot(x_m, y_m), abs=0.03)
    assert (latitude > origin[0]) == (y_m > 5.0 * x_m**2 * math.tan(math.radians(origin[0])) / MAJOR_M)
    assert -180.0 <= longitude < 180.0


def test_geojson_is_of_the_rows_of_the_tables(run: Results, places: tuple[Place, ...], tmp_path: Path) -> None:
    made = export(run, "geojson", tmp_path / "run.geojson", places=places)
    whole = json.loads(made.path.read_text(encoding="utf-8"))
    assert whole["type"] == "FeatureCollection"
    assert whole["remoras"]["seed"] == "3"
    kinds = [one["properties"]["kind"] for one in whole["features"]]
    assert {kind: kinds.count(kind) for kind in made.counts} == made.counts
    assert made.counts["place"] == len(places)
    rows = run.table("trajectories").to_pylist()
    for one in whole["features"]:
        said, points = one["properties"], one["geometry"]["coordinates"]
        if said["kind"] == "track":
            own = [row for row in rows if row["vehicle"] == said["name"]]
            assert said["times_s"] == [row["time_s"] for row in own]
            assert len(points) == len(own)
            reached_m = distance_m((43.35, 3.75), (points[-1][1], points[-1][0]))
            assert reached_m == pytest.approx(math.hypot(own[-1]["x_m"], own[-1]["y_m"]), abs=0.01)
            assert points[-1][2] == -own[-1]["depth_m"]
        elif one["geometry"]["type"] == "Polygon":
            (ring,) = points
            assert ring[0] == ring[-1]
            doubled = sum(x * b - a * y for (x, y), (a, b) in itertools.pairwise(ring))
            assert doubled > 0.0  # anticlockwise, as RFC 7946 has outer rings
