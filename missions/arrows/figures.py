"""Figures of this mission: what was found when, what the maps knew, and the map of all at the end."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from missions.arrows.chart import CONTACT, SWEPT, Chart
from missions.arrows.detectors import CONTACTS
from missions.arrows.grid import CellGrid
from missions.arrows.prior import grid_of, prior_of, rates_of
from missions.arrows.scenario import NOTHING, SITES, ArrowsScenario
from missions.arrows.seafloor import draw_seafloor
from missions.arrows.truth import FLEET_MAPS, IDENTIFIED, MAPS
from missions.figure import Declared, Figure, Layer, Mark, RunResults, Style
from missions.files import tables_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes


LEVELS = (0.005, 0.02, 0.1, 0.5)
"""Probabilities at which the shade of a map changes."""


def _rows(results: RunResults, table: str) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = results.table(table).to_pylist() if results.has(table) else []
    return rows


def _until_s(results: RunResults) -> float:
    return max((row["time_s"] for row in _rows(results, MAPS.name)), default=0.0)


def draw_sites(axes: Axes, results: RunResults, style: Style) -> str:
    """Sites found and identified over time, and anomalies that turned out to be none."""
    end_s = _until_s(results)
    found: dict[int, float] = {}
    for row in _rows(results, CONTACTS.name):
        if row["kind"] in SITES:
            found.setdefault(row["cell"], row["time_s"])
    right = [row for row in _rows(results, IDENTIFIED.name) if row["identity"] == row["kind"]]
    sites, others = ([row["time_s"] for row in right if (row["kind"] in SITES) is is_site] for is_site in (True, False))
    lines = (
        ("sites found", sorted(found.values()), "-", style.black),
        ("sites identified", sites, "--", style.black),
        (
            "others explained",
            others,
            ":",
            style.grey,
        ),
    )
    for label, times_s, line, colour in lines:
        axes.step([0.0, *times_s, end_s], [*range(len(times_s) + 1), len(times_s)], where="post", color=colour,
                  linestyle=line, label=label)  # fmt: skip
    axes.set_xlabel(style.axis("time", "s"))
    axes.set_ylabel(style.axis("number"))
    return "A site is found when a detector first takes notice of it, identified when it is taken for what it is."


def draw_told(axes: Axes, results: RunResults, style: Style) -> str:
    """What the looks that each vehicle knew of had told, and what all looks had."""
    rows = _rows(results, MAPS.name)
    for vehicle, look in style.looks.items():
        own = [row for row in rows if row["vehicle"] == vehicle]
        axes.plot([row["time_s"] for row in own], [row["told_bits"] for row in own], color=look.colour,
                  marker=look.marker, markevery=5, markersize=4, linewidth=1.0, label=vehicle)  # fmt: skip
    whole = _rows(results, FLEET_MAPS.name)
    axes.plot([row["time_s"] for row in whole], [row["told_bits"] for row in whole], color=style.black, linewidth=1.5,
              linestyle="--", label="all looks")  # fmt: skip
    axes.set_xlabel(style.axis("time", "s"))
    axes.set_ylabel(style.axis("information", "bit"))
    return (
        "Information: divergence of a map from the prior. A vehicle below the dashed line has not heard of all looks."
    )


def draw_maps(axes: Axes, results: RunResults, style: Style) -> str:
    """How likely each cell holds a site, by all looks; ways of all vehicles, contacts, and where sites really lie."""
    from matplotlib.colors import ListedColormap

    scenario = ArrowsScenario.model_validate(tables_of(results.manifest["scenario"], "manifest.json"))
    grid, prior, rates = grid_of(scenario), prior_of(scenario), rates_of(scenario)
    chart = Chart(grid, prior, rates, scenario.names)
    for row in _rows(results, "items"):
        if row["attribute"] in (SWEPT, CONTACT):
            chart.add(row["attribute"], (int(float(row["value"])),))
    of_site = [number for number, kind in enumerate(scenario.kinds, 1) if kind.name in SITES]
    shape, extent = (grid.n_rows, grid.n_columns), _extent_m(grid)
    colours = [style.tint(style.black, 0.8 * n / len(LEVELS)) for n in range(len(LEVELS) + 1)]
    shares = np.zeros(len(chart.shares[0]))
    for kind in of_site:
        shares = shares + chart.shares[kind]
    tones = np.searchsorted(LEVELS, shares, side="right").reshape(shape)
    axes.imshow(tones, cmap=ListedColormap(colours), vmin=-0.5, vmax=len(LEVELS) + 0.5, origin="lower", extent=extent)
    for level, colour in zip(LEVELS, colours[1:], strict=True):
        axes.plot([], [], marker="s", markersize=6, linestyle="none", color=colour, label=f"probability ≥ {level:g}")
    _draw_ways(axes, results, style)
    things = draw_seafloor(grid, prior, scenario, rates, int(results.summary["seed"])).things
    contacts = _rows(results, CONTACTS.name)
    found, sites = {row["cell"] for row in contacts}, {cell for cell, one in things.items() if one.name in SITES}
    for label, cells, fill in (
        ("site, detected", sites & found, style.black),
        ("site, not detected", sites - found, "none"),
    ):
        at_m = [things[cell].position_m for cell in sorted(cells)]
        axes.plot([x_m for x_m, _ in at_m], [y_m for _, y_m in at_m], marker="D", markersize=5, linestyle="none",
                  color=style.black, markerfacecolor=fill, label=label, zorder=5, clip_on=False)  # fmt: skip
    axes.plot([row["x_m"] for row in contacts], [row["y_m"] for row in contacts], marker="x", markersize=3.5,
              linestyle="none", color=style.grey, label="contact", zorder=4)  # fmt: skip
    axes.set_aspect("equal")
    axes.set_xlabel(style.axis("east", "m"))
    axes.set_ylabel(style.axis("north", "m"))
    share = f"{math.fsum(shares):.1f} sites expected by the map, {len(sites)} there, {len(sites & found)} detected."
    return f"Shade: probability that a cell holds a site, by all looks of all vehicles. {share}"


def _extent_m(grid: CellGrid) -> tuple[float, float, float, float]:
    east_m, north_m = grid.west_m + grid.n_columns * grid.cell_m, grid.south_m + grid.n_rows * grid.cell_m
    return grid.west_m, east_m, grid.south_m, north_m


def _draw_ways(axes: Axes, results: RunResults, style: Style) -> None:
    """Where vehicles went until the search ended."""
    rows = _rows(results, "trajectories")
    for vehicle, look in style.looks.items():
        way_m = [(row["x_m"], row["y_m"]) for row in rows if row["vehicle"] == vehicle]
        if len(set(way_m)) > 1:
            east_m, north_m = zip(*way_m, strict=True)
            axes.plot(east_m, north_m, color=look.colour, linewidth=0.7, label=vehicle, zorder=3)


def draw_apart(axes: Axes, results: RunResults, style: Style) -> str:
    """How far the map of each vehicle is from that of all looks."""
    rows = _rows(results, MAPS.name)
    for vehicle, look in style.looks.items():
        own = [row for row in rows if row["vehicle"] == vehicle]
        axes.plot([row["time_s"] for row in own], [row["missing_bits"] for row in own], color=look.colour,
                  marker=look.marker, markevery=5, markersize=4, linewidth=1.0, label=vehicle)  # fmt: skip
    axes.set_xlabel(style.axis("time", "s"))
    axes.set_ylabel(style.axis("divergence", "bit"))
    return "Divergence of Jensen and Shannon, summed over cells; it falls where a vehicle hears what it has missed."


def draw_anomalies(axes: Axes, results: RunResults, style: Style) -> str:
    """Contacts, by what they really were, and historic finds."""
    scenario = tables_of(results.manifest["scenario"], "manifest.json")
    historic = [find["position_m"] for find in scenario.get("historic_find", [])]
    if historic:
        east_m, north_m = zip(*historic, strict=True)
        axes.scatter(east_m, north_m, marker="+", s=20, color=style.grey, linewidths=0.8, label="historic find")
    rows = _rows(results, CONTACTS.name)
    kinds = (("site", "D", SITES), ("rock", "s", ("rock",)), ("false alarm", "x", (NOTHING,)))
    for label, marker, of in kinds:
        at = [(row["x_m"], row["y_m"]) for row in rows if row["kind"] in of]
        if at:
            east_m, north_m = zip(*at, strict=True)
            axes.plot(east_m, north_m, marker=marker, markersize=4, markerfacecolor="none", markeredgewidth=0.8,
                      color=style.black, linestyle="none", label=label, zorder=5)  # fmt: skip
    n_sites = len({row["cell"] for row in rows if row["kind"] in SITES})
    return f"n = {len(rows)} contacts, at {n_sites} sites."


FIGURES: tuple[Declared, ...] = (
    Figure("sites", "Sites found and identified over mission time", draw_sites, needs=(CONTACTS.name, IDENTIFIED.name)),
    Figure("told", "What the maps of the vehicles have been told", draw_told, needs=(MAPS.name, FLEET_MAPS.name)),
    Figure("maps", "Where sites are likely after all looks", draw_maps, needs=("items", "trajectories", CONTACTS.name)),
    Figure("apart", "What the map of each vehicle misses", draw_apart, needs=(MAPS.name,)),
    Layer("anomalies", draw_anomalies, needs=(CONTACTS.name,)),
    Mark("site_found", "site found"),
    Mark("site_identified", "site identified"),
)
"""Figures of the mission."""
