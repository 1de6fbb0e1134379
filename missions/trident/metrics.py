"""Metrics of this mission."""

from __future__ import annotations

import math
from typing import cast

from missions.metric import NOT_APPLICABLE, Absent, Better, MeasuredRun, Metric
from missions.trident.choreography import CHOREOGRAPHY
from missions.trident.modules import ATTEMPTS, CHARTED
from missions.trident.scenario import TridentScenario
from missions.trident.site import TARGET, Site


def recovered(run: MeasuredRun) -> bool:
    """Whether the target was really recovered."""
    return target_recovered_s(run) is not None


def target_recovered_s(run: MeasuredRun) -> float | None:
    """When the target was really recovered."""
    return next((time_s for time_s, of in _handled(run) if of == TARGET), None)


def n_mistaken(run: MeasuredRun) -> int:
    """How many decoys were recovered in place of the target."""
    return len({of for _, of in _handled(run) if of != TARGET})


def _handled(run: MeasuredRun) -> list[tuple[float, str]]:
    """When which object was handled with success."""
    return [(row[0], row[4]) for row in run.recorder.rows(ATTEMPTS.name) if row[3] == "handle" and row[-1]]


def charted_fraction(run: MeasuredRun) -> float:
    """Share of the tiles of all blocks that were really charted."""
    n_tiles = sum(len(block.tiles) for block in cast(Site, run.mission.world(run.seed)).blocks)
    return len({row[2:4] for row in run.recorder.rows(CHARTED.name)}) / n_tiles if n_tiles else 1.0


def n_choices(run: MeasuredRun) -> int:
    """How often a candidate was chosen."""
    return sum(row[5] == "chosen" for row in run.recorder.rows("items"))


def n_requests(run: MeasuredRun) -> int:
    """How often a vehicle asked another for a service."""
    return sum(row[5] == "requestedOf" for row in run.recorder.rows("items"))


def n_violations(run: MeasuredRun) -> int | Absent:
    """How often the choreography was violated."""
    if not cast(TridentScenario, run.scenario).choreography.state or not run.recorder.rows("packets"):
        return NOT_APPLICABLE
    return sum(bool(row[-1]) for row in run.recorder.rows(CHOREOGRAPHY.name))


def navigation_error_m(run: MeasuredRun) -> float | Absent:
    """Greatest distance of the places that vehicles under water told from where they really were then."""
    submerged = {vehicle.name for vehicle in run.scenario.vehicle if vehicle.depth_m > 1.0}
    ways: dict[str, list[tuple[float, float, float]]] = {name: [] for name in submerged}
    for row in run.recorder.rows("trajectories"):
        if row[1] in submerged:
            ways[row[1]].append((row[0], row[2], row[3]))
    tick_s, worst_m = run.scenario.scenario.tick_s, None
    for item in run.recorder.rows("items"):
        if item[5] != "position" or item[1] not in submerged:
            continue
        way, place = ways[item[1]], item[3] / tick_s
        before = min(int(place), len(way) - 2)
        if before < 0:
            continue
        share, (_, x_m, y_m), (_, to_x_m, to_y_m) = place - before, way[before], way[before + 1]
        east, north = (float(part) for part in item[6].removeprefix("POINT (").removesuffix(")").split())
        dx_m, dy_m = x_m + share * (to_x_m - x_m) - east, y_m + share * (to_y_m - y_m) - north
        worst_m = max(worst_m or 0.0, math.sqrt(dx_m * dx_m + dy_m * dy_m))
    return NOT_APPLICABLE if worst_m is None else round(worst_m, 3)


METRICS = (
    Metric("recovered", "", Better.HIGHER, "target recovered", recovered, headline=True),
    Metric(
        "target_recovered_s", "s", Better.LOWER, "time to the recovery of the target", target_recovered_s,
        headline=True, censored=True,
    ),
    Metric("charted_fraction", "", Better.HIGHER, "share of the site charted", charted_fraction, headline=True),
    Metric("n_mistaken", "", Better.LOWER, "decoys recovered", n_mistaken),
    Metric("n_choices", "", Better.LOWER, "choices of a candidate", n_choices),
    Metric("n_requests", "", Better.NEITHER, "requests for services", n_requests),
    Metric("n_violations", "", Better.LOWER, "violations of the choreography", n_violations),
    Metric(
        "navigation_error_m", "m", Better.LOWER, "greatest navigation error", navigation_error_m,
        note="Of the places that vehicles under water tell, which are rounded to 0.5 m.",
    ),
)  # fmt: skip
"""Fields of the summary that this mission adds."""
