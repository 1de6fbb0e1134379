"""Figures of this mission: what was found when, what the maps knew, and the map of all at the end."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from missions.arrows.detectors import CONTACTS
from missions.arrows.scenario import NOTHING, SITES
from missions.arrows.truth import FLEET_MAPS, IDENTIFIED, MAPS
from missions.figure import Declared, Figure, Layer, Mark, RunResults, Style
from missions.files import tables_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes


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
            "other anomalies explained",
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


def draw_maps(axes: Axes, results: RunResults, style: Style) -> str:
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
    Figure("maps", "What the maps of the vehicles have been told", draw_maps, needs=(MAPS.name, FLEET_MAPS.name)),
    Figure("apart", "What the map of each vehicle misses", draw_apart, needs=(MAPS.name,)),
    Layer("anomalies", draw_anomalies, needs=(CONTACTS.name,)),
    Mark("site_found", "site found"),
    Mark("site_identified", "site identified"),
)
"""Figures of the mission."""
