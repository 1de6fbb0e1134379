"""Metrics of this mission: what was found and identified, what the looks told, and what contact was kept."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Protocol, cast

from missions.arrows.detectors import CONTACTS
from missions.arrows.scenario import NOTHING, SITES, UNKNOWN
from missions.arrows.truth import FLEET_MAPS, IDENTIFIED
from missions.metric import NOT_APPLICABLE, Absent, Better, MeasuredRun, Metric

if TYPE_CHECKING:
    from missions.arrows.scenario import ArrowsScenario
    from missions.arrows.seafloor import Seafloor

SILENCE_S = 60.0
"""Who has heard nobody for longer than this is out of contact."""


class SearchMission(Protocol):
    """What metrics ask of the mission itself."""

    @property
    def searchers(self) -> tuple[str, ...]:
        """Vehicles with a detector that sweeps."""


def search_s_of(run: MeasuredRun) -> float:
    """When the search was to end."""
    return cast("ArrowsScenario", run.scenario).mission.search_s


def sites_of(run: MeasuredRun) -> set[int]:
    """Cells in which a site really lies."""
    seafloor: Seafloor = run.mission.world(run.seed)
    return {cell for cell, thing in seafloor.things.items() if thing.name in SITES}


def found_at_s(run: MeasuredRun) -> dict[int, float]:
    """When a detector first took notice of each site, by its cell."""
    first: dict[int, float] = {}
    for time_s, _, _, cell, kind, _, _ in run.recorder.rows(CONTACTS.name):
        if kind in SITES:
            first.setdefault(cell, time_s)
    return first


def identified_at_s(run: MeasuredRun) -> dict[int, float]:
    """When each site was first taken for what it is, by its cell."""
    seafloor: Seafloor = run.mission.world(run.seed)
    grid, things, first = seafloor.grid, seafloor.things, dict[int, float]()
    for time_s, _, _, identity, _, kind, x_m, y_m in run.recorder.rows(IDENTIFIED.name):
        if identity != kind or kind not in SITES:
            continue
        near = (
            cell for cell in grid.near((x_m, y_m), 2.0 * grid.cell_m) if cell in things and things[cell].name == kind
        )
        cell = min(near, key=lambda name: _squared_m(things[name].position_m, (x_m, y_m)), default=None)
        if cell is not None:
            first.setdefault(cell, time_s)
    return first


def _squared_m(one: tuple[float, float], other: tuple[float, float]) -> float:
    dx_m, dy_m = one[0] - other[0], one[1] - other[1]
    return dx_m * dx_m + dy_m * dy_m


def found_fraction(run: MeasuredRun) -> float | Absent:
    """Share of the sites that a detector took notice of."""
    sites = sites_of(run)
    return len(found_at_s(run)) / len(sites) if sites else NOT_APPLICABLE


def identified_fraction(run: MeasuredRun) -> float | Absent:
    """Share of the sites that were found and rightly identified."""
    sites = sites_of(run)
    return len(identified_at_s(run)) / len(sites) if sites else NOT_APPLICABLE


def mean_s(run: MeasuredRun, at_s: dict[int, float]) -> float | Absent:
    """Mean time of sites, in which those that were never found count with the end of the search."""
    sites, until_s = sites_of(run), search_s_of(run)
    if not sites:
        return NOT_APPLICABLE
    return math.fsum(min(until_s, at_s.get(cell, until_s)) for cell in sorted(sites)) / len(sites)


def anomalies_mistaken(run: MeasuredRun) -> int:
    """Anomalies that were taken for what they are not."""
    return sum(row[3] not in (row[5], UNKNOWN) for row in run.recorder.rows(IDENTIFIED.name))


def looks_at_nothing(run: MeasuredRun) -> int:
    """Looks that gave a contact where nothing lies."""
    return sum(row[4] == NOTHING for row in run.recorder.rows(CONTACTS.name))


def told_bits(run: MeasuredRun) -> float:
    """What all looks have told by the end: divergence of the map of all from the prior."""
    rows = run.recorder.rows(FLEET_MAPS.name)
    return float(rows[-1][1]) if rows else 0.0


def apart_bits(run: MeasuredRun) -> float:
    """How far the maps of the vehicles were from each other, in the mean over the search."""
    until_s = search_s_of(run)
    apart = [row[2] for row in run.recorder.rows(FLEET_MAPS.name) if row[0] <= until_s]
    return math.fsum(apart) / len(apart) if apart else 0.0


def told_per_km(run: MeasuredRun) -> float | Absent:
    """What all looks have told, for each kilometre that searchers went."""
    searchers, last, way_m = set(cast(SearchMission, run.mission).searchers), dict[str, tuple[float, float]](), 0.0
    for _, vehicle, x_m, y_m, *_ in run.recorder.rows("trajectories"):
        if vehicle in searchers:
            if vehicle in last:
                way_m += math.sqrt(_squared_m(last[vehicle], (x_m, y_m)))
            last[vehicle] = x_m, y_m
    if way_m == 0.0:
        return NOT_APPLICABLE
    return 1000.0 * told_bits(run) / float(way_m)


def alone_of(run: MeasuredRun) -> dict[str, tuple[float, float]]:
    """Of each searcher: how long it was out of contact in all, and at a stretch (s).

    That is until the search ended, or until it spoke last, for a lost vehicle hears nobody.
    """
    heard: dict[str, list[float]] = {name: [0.0] for name in cast(SearchMission, run.mission).searchers}
    last_s = dict.fromkeys(heard, 0.0)
    for row in run.recorder.rows("packets"):
        if row[2] in heard:
            last_s[row[2]] = row[8]
        for vehicle in row[6]:
            if vehicle in heard:
                heard[vehicle].append(row[8])
    found = {}
    for name, of in heard.items():
        until_s = min(search_s_of(run), last_s[name])
        times_s = [*(time_s for time_s in sorted(of) if time_s < until_s), until_s]
        gaps_s = [after - before for before, after in pairwise(times_s)]
        alone_s = [gap_s - SILENCE_S for gap_s in gaps_s if gap_s > SILENCE_S]
        found[name] = math.fsum(alone_s), max(alone_s, default=0.0)
    return found


def alone_fraction(run: MeasuredRun) -> float | Absent:
    """Share of the search in which a searcher had heard nobody for a minute, in the mean."""
    of, until_s = alone_of(run), min(search_s_of(run), run.end_s)
    return math.fsum(whole_s for whole_s, _ in of.values()) / (len(of) * until_s) if of and until_s else NOT_APPLICABLE


def longest_alone_s(run: MeasuredRun) -> float | Absent:
    """The longest time at a stretch in which a searcher was out of contact."""
    return max((longest_s for _, longest_s in alone_of(run).values()), default=0.0)


METRICS = (
    Metric("found_fraction", "", Better.HIGHER, "share of sites found", found_fraction, headline=True),
    Metric("identified_fraction", "", Better.HIGHER, "share of sites identified", identified_fraction, headline=True),
    Metric(
        "mean_found_s", "s", Better.LOWER, "mean time of finding a site", lambda run: mean_s(run, found_at_s(run)),
        headline=True, note="Sites that were not found count with the end of the search.",
    ),
    Metric(
        "mean_identified_s", "s", Better.LOWER, "mean time of identifying a site",
        lambda run: mean_s(run, identified_at_s(run)), headline=True,
        note="Sites that were not identified count with the end of the search.",
    ),
    Metric("n_mistaken", "", Better.LOWER, "anomalies mistaken", anomalies_mistaken),
    Metric("n_false_alarms", "", Better.NEITHER, "false alarms", looks_at_nothing),
    Metric("told_bits", "bit", Better.HIGHER, "information gained", told_bits),
    Metric("told_per_km", "bit/km", Better.HIGHER, "information gained per way", told_per_km, headline=True),
    Metric("apart_bits", "bit", Better.LOWER, "divergence of maps", apart_bits, headline=True),
    Metric("alone_fraction", "", Better.LOWER, "share of time out of contact", alone_fraction, headline=True),
    Metric("longest_alone_s", "s", Better.LOWER, "longest time out of contact", longest_alone_s),
)  # fmt: skip
"""Metrics of the mission, in the order of the summary."""
