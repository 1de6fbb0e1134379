"""Ground truth, metrics and figures: found and identified sites, and progress of the maps."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from exchange.arithmetic import distance
from missions.arrows.belief_map import (
    CONTACT,
    SWEPT,
    Chart,
    Seafloor,
    disagreement,
    divergence,
    draw_seafloor,
)
from missions.arrows.detectors import CONTACTS, SAME_M, ClassifyingCameraSettings, DetectorSettings
from missions.arrows.scenario import NOTHING, SITES, UNKNOWN, ArrowsScenario
from missions.figure import Declared, Figure, Layer, Mark, RunResults, Style, draw_counts, run_end_s
from missions.meeting.meeting import Meeting
from missions.meeting.truth import JobTruth
from missions.metric import NOT_APPLICABLE, Absent, Better, MeasuredRun, Metric
from remoras.mission import FleetView, Milestone
from remoras.recorder import TIME, VEHICLE, Column, Recorder, Table, Unread
from remoras.truth import left
from remoras.work import Point

if TYPE_CHECKING:
    from matplotlib.axes import Axes

IDENTIFIED = Table("identified", (
    TIME, VEHICLE, Column("anomaly", "str"), Column("identity", "str"), Column("p", "float", "1"),
    Column("kind", "str"), Column("x_m", "float", "m"), Column("y_m", "float", "m"),
))  # fmt: skip
"""Identifications with probability, and the true content."""
MAPS = Table("maps", (TIME, VEHICLE, Column("told_bits", "float", "bit"), Column("missing_bits", "float", "bit")))
"""Known information (divergence from the prior) and distance to the joint map, per vehicle."""
FLEET_MAPS = Table("fleet_maps", (TIME, Column("told_bits", "float", "bit"), Column("apart_bits", "float", "bit")))
"""Information of all observations, and distance between the vehicles' maps (Jensen-Shannon)."""
MAP_EVERY_S = 120.0
Look = tuple[float, str, int]  # time of knowledge, attribute, code


def looks_known(recorder: Recorder, vehicles: Sequence[str]) -> dict[str, list[Look]]:
    """Observations known to each vehicle by time of knowledge; under ``""`` all by creation."""
    looks: dict[str, list[tuple[str, int]]] = {}
    known: dict[str, list[Look]] = {name: [] for name in ("", *vehicles)}
    for uid, origin, _, recorded_s, _, attribute, value, kind, _ in recorder.items:
        if attribute in (SWEPT, CONTACT):
            look = attribute, int(float(value))
            looks.setdefault(uid, []).append(look)
            known[""].append((recorded_s, *look))
            # Private observations have no row in ``knowledge``; their origin knows them at once.
            if kind == "kept":
                known[origin].append((recorded_s, *look))
    for time_s, vehicle, uid, _, event in recorder.rows("knowledge"):
        if event in ("observed", "received") and uid in looks:
            known[vehicle] += [(time_s, *look) for look in looks[uid]]
    return {name: sorted(own) for name, own in known.items()}


class ArrowsTruth(JobTruth):
    """Referee of a run; ``chart`` creates a map of the prior."""

    work = "identify what lies there"
    ends_with_meeting = True

    def __init__(
        self,
        meeting: Meeting,
        scenario: ArrowsScenario,
        recorder: Recorder,
        seafloor: Seafloor,
        chart: Callable[[], Chart],
        vehicles: Sequence[str],
    ) -> None:
        super().__init__(meeting, "", recorder)
        self._scenario, self._seafloor, self._recorder = scenario, seafloor, recorder
        self._chart, self._vehicles = chart, vehicles
        self._contacts, self._identified_rows = Unread(recorder.rows(CONTACTS.name)), recorder.rows(IDENTIFIED.name)
        self._statements = Unread(recorder.items)
        self._places_m: dict[str, Point] = {}
        self._sites = {cell for cell, thing in seafloor.things.items() if thing.name in SITES}
        self._found: set[int] = set()
        self._identified: set[int] = set()

    @property
    def goal_fraction(self) -> float:
        return self._share(len(self._identified))

    def _share(self, n_identified: int) -> float:
        if not self._sites:
            return 1.0
        return min(1.0, n_identified / (self._scenario.mission.goal * len(self._sites)))

    def reachable_fraction(self, fleet: FleetView) -> float:
        carried = [sensor for _, data in left(fleet) for sensor in data.sensors]
        if not any(isinstance(settings, ClassifyingCameraSettings) for settings in carried):
            return self.goal_fraction
        is_searched = any(isinstance(settings, DetectorSettings) for settings in carried)
        return self._share(len(self._sites if is_searched else self._found | self._identified))

    def out_of_reach(self, fleet: FleetView) -> Sequence[str]:
        return ()

    def watch(self, fleet: FleetView, now_s: float) -> None:
        for time_s, vehicle, _, cell, kind, _, _ in self._contacts:
            if kind in SITES and cell not in self._found:
                self._found.add(cell)
                self.milestones.append(Milestone(time_s, "site_found", vehicle))
        for _, origin, _, recorded_s, subject, attribute, value, _, uncertainty in self._statements:
            if attribute == "location":
                x_m, y_m = (float(part) for part in value.removeprefix("POINT (").removesuffix(")").split())
                self._places_m[subject] = x_m, y_m
            elif attribute == "identity" and subject in self._places_m:
                self._note_identity(recorded_s, origin, subject, value, float(uncertainty or 0.0))

    def _note_identity(self, time_s: float, vehicle: str, anomaly: str, identity: str, p: float) -> None:
        at_m = self._places_m[anomaly]
        near = [
            (distance(at_m, thing.position_m), cell, thing.name)
            for cell, thing in self._seafloor.things.items()
            if distance(at_m, thing.position_m) <= SAME_M
        ]
        _, cell, kind = min(near, default=(0.0, -1, NOTHING))
        self._identified_rows.append((time_s, vehicle, anomaly, identity, p, kind, *at_m))
        if identity == kind and cell in self._sites and cell not in self._identified:
            self._identified.add(cell)
            self.milestones.append(Milestone(time_s, "site_identified", vehicle))

    def reasons(self, fleet: FleetView, now_s: float) -> Iterator[str]:
        """Compute the maps of all times; yield reasons of failure, with the number of sites."""
        self._note_maps(now_s)
        yield from super().reasons(fleet, now_s)
        if self.goal_fraction < 1.0:
            yield f"{len(self._identified)} of {len(self._sites)} sites identified"

    def _note_maps(self, now_s: float) -> None:
        known = looks_known(self._recorder, self._vehicles)
        charts = {name: self._chart() for name in known}
        placed = dict.fromkeys(known, 0)
        maps, fleet_maps = self._recorder.rows(MAPS.name), self._recorder.rows(FLEET_MAPS.name)
        prior = charts[""].prior
        for number in range(int(now_s // MAP_EVERY_S) + 1):
            at_s = number * MAP_EVERY_S
            for name, looks in known.items():
                end = bisect_right(looks, at_s, key=lambda look: look[0])
                for _, attribute, code in looks[placed[name] : end]:
                    charts[name].add(attribute, (code,))
                placed[name] = end
            whole = charts[""].shares
            own = [charts[name].shares for name in self._vehicles]
            fleet_maps.append((at_s, divergence(whole, prior), disagreement(own)))
            for name, shares in zip(self._vehicles, own, strict=True):
                maps.append((at_s, name, divergence(shares, prior), disagreement([shares, whole])))


# Results ----------------------------------------------------------------------------------------


SILENCE_S = 60.0  # time without reception after which a vehicle is out of contact


def search_s_of(run: MeasuredRun) -> float:
    """Planned end of the search."""
    return cast(ArrowsScenario, run.scenario).mission.search_s


def sites_of(run: MeasuredRun) -> set[int]:
    """Cells that truly hold a site."""
    seafloor: Seafloor = run.mission.world(run.seed)
    return {cell for cell, thing in seafloor.things.items() if thing.name in SITES}


def reached_s(run: MeasuredRun, milestone: str) -> list[float]:
    """Time at which each site reached a milestone; of the sites that did."""
    return [reached.time_s for reached in run.milestones if reached.name == milestone]


def share_of(run: MeasuredRun, milestone: str) -> float | Absent:
    """Share of the sites that reached a milestone."""
    sites = sites_of(run)
    return len(reached_s(run, milestone)) / len(sites) if sites else NOT_APPLICABLE


def mean_s(run: MeasuredRun, milestone: str) -> float | Absent:
    """Mean time of a milestone over sites; missing ones count with the end of the search."""
    n_sites, until_s, times_s = len(sites_of(run)), search_s_of(run), reached_s(run, milestone)
    if not n_sites:
        return NOT_APPLICABLE
    times_s += [until_s] * (n_sites - len(times_s))
    return math.fsum(min(until_s, time_s) for time_s in times_s) / n_sites


def anomalies_mistaken(run: MeasuredRun) -> int:
    """Number of wrong identifications."""
    return sum(row[3] not in (row[5], UNKNOWN) for row in run.recorder.rows(IDENTIFIED.name))


def looks_at_nothing(run: MeasuredRun) -> int:
    """Number of false alarms of detectors."""
    return sum(row[4] == NOTHING for row in run.recorder.rows(CONTACTS.name))


def told_bits(run: MeasuredRun) -> float:
    """Information of all observations: final divergence of the joint map from the prior."""
    rows = run.recorder.rows(FLEET_MAPS.name)
    return float(rows[-1][1]) if rows else 0.0


def apart_bits(run: MeasuredRun) -> float:
    """Mean divergence between the vehicles' maps during the search."""
    until_s = search_s_of(run)
    apart = [row[2] for row in run.recorder.rows(FLEET_MAPS.name) if row[0] <= until_s]
    return math.fsum(apart) / len(apart) if apart else 0.0


def told_per_km(run: MeasuredRun) -> float | Absent:
    """Information per kilometre of the searchers' tracks."""
    mission: Any = run.mission
    searchers, last, way_m = set(mission.searchers), dict[str, tuple[float, float]](), 0.0
    for _, vehicle, x_m, y_m, *_ in run.recorder.rows("trajectories"):
        if vehicle in searchers:
            if vehicle in last:
                way_m += distance(last[vehicle], (x_m, y_m))
            last[vehicle] = x_m, y_m
    if way_m == 0.0:
        return NOT_APPLICABLE
    return 1000.0 * told_bits(run) / float(way_m)


def alone_of(run: MeasuredRun) -> dict[str, tuple[float, float]]:
    """Total and longest time (s) out of contact, up to search end or last transmission."""
    mission: Any = run.mission
    receptions: dict[str, list[float]] = {name: [0.0] for name in mission.searchers}
    last_s = dict.fromkeys(receptions, 0.0)
    for row in run.recorder.rows("packets"):
        if row[2] in receptions:
            last_s[row[2]] = row[8]
        for vehicle in row[6]:
            if vehicle in receptions:
                receptions[vehicle].append(row[8])
    alone = {}
    for name, own_s in receptions.items():
        until_s = min(search_s_of(run), last_s[name])
        times_s = [*(time_s for time_s in sorted(own_s) if time_s < until_s), until_s]
        gaps_s = [after - before for before, after in pairwise(times_s)]
        alone_s = [gap_s - SILENCE_S for gap_s in gaps_s if gap_s > SILENCE_S]
        alone[name] = math.fsum(alone_s), max(alone_s, default=0.0)
    return alone


def alone_fraction(run: MeasuredRun) -> float | Absent:
    """Mean share of the search in which a searcher was out of contact."""
    of, until_s = alone_of(run), min(search_s_of(run), run.ended_s)
    return math.fsum(whole_s for whole_s, _ in of.values()) / (len(of) * until_s) if of and until_s else NOT_APPLICABLE


def longest_alone_s(run: MeasuredRun) -> float | Absent:
    """Longest time of a searcher out of contact."""
    return max((longest_s for _, longest_s in alone_of(run).values()), default=0.0)


METRICS = (
    Metric(
        "found_fraction", "", Better.HIGHER, "share of sites found", lambda run: share_of(run, "site_found"),
        headline=True,
    ),
    Metric(
        "identified_fraction", "", Better.HIGHER, "share of sites identified",
        lambda run: share_of(run, "site_identified"), headline=True,
    ),
    Metric(
        "mean_found_s", "s", Better.LOWER, "mean time of finding a site", lambda run: mean_s(run, "site_found"),
        headline=True, note="Sites that were not found count with the end of the search.",
    ),
    Metric(
        "mean_identified_s", "s", Better.LOWER, "mean time of identifying a site",
        lambda run: mean_s(run, "site_identified"), headline=True,
        note="Sites that were not identified count with the end of the search.",
    ),
    Metric("n_mistaken", "", Better.LOWER, "misidentified anomalies", anomalies_mistaken),
    Metric("n_false_alarms", "", Better.NEITHER, "false alarms", looks_at_nothing),
    Metric("told_bits", "bit", Better.HIGHER, "information gained", told_bits),
    Metric("told_per_km", "bit/km", Better.HIGHER, "information gained per distance", told_per_km, headline=True),
    Metric("apart_bits", "bit", Better.LOWER, "divergence of maps", apart_bits, headline=True),
    Metric("alone_fraction", "", Better.LOWER, "share of time out of contact", alone_fraction, headline=True),
    Metric("longest_alone_s", "s", Better.LOWER, "longest time out of contact", longest_alone_s),
)  # fmt: skip


LEVELS = (0.005, 0.02, 0.1, 0.5)


def draw_sites(axes: Axes, results: RunResults, style: Style) -> str:
    """Draw sites found and identified, and other anomalies explained, over time."""
    contacts = reversed(results.rows(CONTACTS.name))
    first_s = {row["cell"]: row["time_s"] for row in contacts if row["kind"] in SITES}
    right = [row for row in results.rows(IDENTIFIED.name) if row["identity"] == row["kind"]]
    sites, others = ([row["time_s"] for row in right if (row["kind"] in SITES) is is_site] for is_site in (True, False))
    curves = (
        ("sites found", first_s.values(), "-", style.black),
        ("sites identified", sites, "--", style.black),
        ("other anomalies identified", others, ":", style.grey),
    )
    draw_counts(axes, results, style, curves, "number")
    return "A site is found at its first detection, and identified at its first correct identification."


def _draw_of_maps(axes: Axes, results: RunResults, style: Style, column: str, label: str) -> None:
    rows = results.rows(MAPS.name)
    for vehicle, look in style.looks.items():
        own = [row for row in rows if row["vehicle"] == vehicle]
        axes.plot([row["time_s"] for row in own], [row[column] for row in own], color=look.colour,
                  marker=look.marker, markevery=5, markersize=4, linewidth=1.0, label=vehicle)  # fmt: skip
    axes.set_xlim(0.0, run_end_s(results))
    axes.set_xlabel(style.axis("time", "s"))
    axes.set_ylabel(style.axis(label, "bit"))


def draw_told(axes: Axes, results: RunResults, style: Style) -> str:
    """Draw the information known to each vehicle, and that of all observations."""
    _draw_of_maps(axes, results, style, "told_bits", "information")
    whole = results.rows(FLEET_MAPS.name)
    axes.plot([row["time_s"] for row in whole], [row["told_bits"] for row in whole], color=style.black, linewidth=1.5,
              linestyle="--", label="all observations")  # fmt: skip
    return "Information: divergence of a map from the prior. Below the dashed line a vehicle lacks some observations."


def draw_maps(axes: Axes, results: RunResults, style: Style) -> str:
    """Draw site probabilities by all observations, with tracks, detections and true sites."""
    from matplotlib.colors import ListedColormap

    scenario = ArrowsScenario.model_validate(results.scenario_tables)
    chart = Chart(scenario)
    grid = chart.grid
    for row in results.rows("items"):
        if row["attribute"] in (SWEPT, CONTACT):
            chart.add(row["attribute"], (int(float(row["value"])),))
    shape = grid.n_rows, grid.n_columns
    extent = (grid.west_m, grid.west_m + shape[1] * grid.cell_m, grid.south_m, grid.south_m + shape[0] * grid.cell_m)
    colours = [style.tint(style.black, 0.8 * n / len(LEVELS)) for n in range(len(LEVELS) + 1)]
    shares = chart.sites(chart.shares)
    tones = np.searchsorted(LEVELS, shares, side="right").reshape(shape)
    axes.imshow(tones, cmap=ListedColormap(colours), vmin=-0.5, vmax=len(LEVELS) + 0.5, origin="lower", extent=extent)
    for level, colour in zip(LEVELS, colours[1:], strict=True):
        axes.plot([], [], marker="s", markersize=6, linestyle="none", color=colour, label=f"probability ≥ {level:g}")
    _draw_ways(axes, results, style)
    things = draw_seafloor(scenario, int(results.summary["seed"])).things
    contacts = results.rows(CONTACTS.name)
    seen, sites = {row["cell"] for row in contacts}, {cell for cell, thing in things.items() if thing.name in SITES}
    for label, cells, fill in (
        ("site, detected", sites & seen, style.black),
        ("site, not detected", sites - seen, "none"),
    ):
        at_m = [things[cell].position_m for cell in sorted(cells)]
        axes.plot([x_m for x_m, _ in at_m], [y_m for _, y_m in at_m], marker="D", markersize=5, linestyle="none",
                  color=style.black, markerfacecolor=fill, label=label, zorder=5, clip_on=False)  # fmt: skip
    axes.plot([row["x_m"] for row in contacts], [row["y_m"] for row in contacts], marker="x", markersize=3.5,
              linestyle="none", color=style.grey, label="contact", zorder=4)  # fmt: skip
    axes.set_aspect("equal")
    axes.set_xlabel(style.axis("east", "m"))
    axes.set_ylabel(style.axis("north", "m"))
    share = f"{math.fsum(shares):.1f} sites expected by the map, {len(sites)} true sites, {len(sites & seen)} detected."
    return f"Shade: probability that a cell holds a site, by all observations of all vehicles. {share}"


def _draw_ways(axes: Axes, results: RunResults, style: Style) -> None:
    rows = results.rows("trajectories")
    for vehicle, look in style.looks.items():
        way_m = [(row["x_m"], row["y_m"]) for row in rows if row["vehicle"] == vehicle]
        if len(set(way_m)) > 1:
            east_m, north_m = zip(*way_m, strict=True)
            axes.plot(east_m, north_m, color=look.colour, linestyle=look.line, linewidth=0.7, label=vehicle, zorder=3)


def draw_apart(axes: Axes, results: RunResults, style: Style) -> str:
    """Draw the divergence of each vehicle's map from the joint map."""
    _draw_of_maps(axes, results, style, "missing_bits", "divergence")
    return "Jensen-Shannon divergence, summed over cells; it falls when a vehicle receives missing observations."


def draw_anomalies(axes: Axes, results: RunResults, style: Style) -> str:
    """Draw detections by their true content, and historic finds."""
    scenario = results.scenario_tables
    historic = [find["position_m"] for find in scenario.get("historic_find", [])]
    if historic:
        east_m, north_m = zip(*historic, strict=True)
        axes.scatter(east_m, north_m, marker="+", s=20, color=style.grey, linewidths=0.8, label="historic find")
    rows = results.rows(CONTACTS.name)
    kinds = (("site", "D", SITES), ("rock", "s", ("rock",)), ("false alarm", "x", (NOTHING,)))
    for label, marker, contents in kinds:
        places = [(row["x_m"], row["y_m"]) for row in rows if row["kind"] in contents]
        if places:
            east_m, north_m = zip(*places, strict=True)
            axes.plot(east_m, north_m, marker=marker, markersize=4, markerfacecolor="none", markeredgewidth=0.8,
                      color=style.black, linestyle="none", label=label, zorder=5)  # fmt: skip
    n_sites = len({row["cell"] for row in rows if row["kind"] in SITES})
    return f"n = {len(rows)} contacts, at {n_sites} sites."


FIGURES: tuple[Declared, ...] = (
    Figure("sites", "Sites found and identified over mission time", draw_sites, needs=(CONTACTS.name, IDENTIFIED.name)),
    Figure("told", "Information in the maps of the vehicles", draw_told, needs=(MAPS.name, FLEET_MAPS.name)),
    Figure("maps", "Probability of sites at the end", draw_maps, needs=("items", "trajectories", CONTACTS.name)),
    Figure("apart", "Divergence of each map from the joint map", draw_apart, needs=(MAPS.name,)),
    Layer("anomalies", draw_anomalies, needs=(CONTACTS.name,)),
    Mark("site_found", "site found"),
    Mark("site_identified", "site identified"),
)
