"""Figure and CSV of a measured network: map and matrix of link losses, or losses over range."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch

from missions import words
from visualisation import page, style
from visualisation.output import as_csv
from visualisation.shades import matrix

if TYPE_CHECKING:
    from exchange.channel.network import Network

BODY_IN, RANGES_IN = 2.9, 2.0
BEND = 0.12  # curvature of the two directions of a link, as a share of its length
WIDEST_PT = 1.8  # width of an arrow without loss
NODE_PT = 21.0  # diameter of a node, which contains its name and depth
MOST_NUMBERS = 12  # maximum number of nodes for numbers in the matrix; those of more would touch


def network_contents(network: Network, format: str) -> list[tuple[str, bytes]]:
    """Return names and contents of figure, caption and CSV; DrawingError for an unknown format."""
    figure, caption = network_figure(network), network_caption(network)
    return style.contents(f"network-{network.name}", format, figure, caption, network_csv(network))


def network_figure(network: Network) -> Figure:
    """Draw losses over range; else the loss matrix, beside the map if all positions are known."""
    with style.paper():
        has_map, has_ranges = _has_map(network), bool(network.per_over_range)
        figure = page.opened(style.PAGE_IN if has_map else style.COLUMN_IN, BODY_IN)
        panels = page.panels(figure, 1 + has_map, 1 + has_map, ("map", "share lost") if has_map else ())
        if has_ranges:
            _over_range(panels[0], network)
        else:
            _matrix(panels[-1], network)
        if has_map:
            _map(panels[0], network)
        page.lay_out(figure, panels[:1], lambda: [RANGES_IN if has_ranges else page.panel_in(panels[0])[0]])
    return figure


def _has_map(network: Network) -> bool:
    return bool(network.node) and all(node.position_m is not None for node in network.node)


def _over_range(axes: Axes, network: Network) -> None:
    ranges_m, per = zip(*network.per_over_range, strict=True)
    axes.plot((0.0, *ranges_m), (per[0], *per), color=style.BLUE, zorder=2)
    axes.plot(ranges_m, per, color=style.BLUE, marker="o", linestyle="", zorder=3)
    axes.set_xlim(0.0, 1.05 * ranges_m[-1])
    axes.set_ylim(0.0, 1.04)
    axes.set_xlabel(words.axis("range", "m"))
    axes.set_ylabel("share lost")


def _map(axes: Axes, network: Network) -> None:
    at_m = {node.name: node.position_m for node in network.node if node.position_m is not None}
    for (sender, receiver), per in network.per.items():
        if per < 1.0:
            axes.add_patch(
                FancyArrowPatch(
                    at_m[sender],
                    at_m[receiver],
                    connectionstyle=f"arc3,rad={-BEND}",
                    arrowstyle="-|>,head_length=4,head_width=1.6",
                    shrinkA=NODE_PT / 2,
                    shrinkB=NODE_PT / 2 + 1,
                    linewidth=0.25 + (WIDEST_PT - 0.25) * (1.0 - per),
                    color=style.GREY if per > 0.5 else style.BLUE,
                    joinstyle="miter",
                    mutation_scale=1.0,
                    zorder=1,
                )
            )
    for node in network.node:
        x_m, y_m = at_m[node.name]
        text = node.name if node.depth_m is None else f"{node.name}\n{node.depth_m:g} m"
        axes.plot(x_m, y_m, marker="o", markersize=NODE_PT, color="white", markeredgecolor=style.BLACK, zorder=3)
        axes.text(x_m, y_m, text, fontsize=style.TINY_PT, ha="center", va="center", linespacing=1.0, zorder=4)
    xs, ys = zip(*at_m.values(), strict=True)
    span_m = max(max(xs) - min(xs), max(ys) - min(ys), 1.0)
    for low, high, limit in ((min(xs), max(xs), axes.set_xlim), (min(ys), max(ys), axes.set_ylim)):
        middle = (low + high) / 2.0
        # Both axes have one span, since shapes count, with space for the nodes at the edge.
        limit(middle - 0.62 * span_m, middle + 0.62 * span_m)
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlabel(words.axis("east", "m"))
    axes.set_ylabel(words.axis("north", "m"))


def _matrix(axes: Axes, network: Network) -> None:
    names = [node.name for node in network.node]
    lost = np.array([[network.per.get((sender, receiver), np.nan) for sender in names] for receiver in names])
    matrix(axes, names, lost, 1.25, lambda per: f"{per:.3f}".lstrip("0"), BODY_IN, MOST_NUMBERS)
    axes.spines[:].set_visible(False)


def network_caption(network: Network) -> str:
    """Return the caption: content, conditions and source."""
    source = f" {network.citation}." if network.citation else ""
    packet = f" Counted: {network.packet}." if network.packet else ""
    if network.per_over_range:
        text = "share lost against range as measured (points) and between (lines)"
    else:
        text = "share lost on each directed link as measured, rows send and columns receive"
        if _has_map(network):
            text = (
                "map of the nodes with their depths, an arrow for each directed link, wider for less loss and blue "
                f"for a loss of at most one half; {text}"
            )
    return f"Network {network.name}: {text}.{packet}{source}"


def network_csv(network: Network) -> bytes:
    """Return one line per directed link, readable as a network again; or per range."""
    if network.per_over_range:
        return as_csv(("range_m", "per"), ((f"{range_m:g}", f"{per:g}") for range_m, per in network.per_over_range))
    return as_csv(("sender", "receiver", "per"), ((*link, f"{per:g}") for link, per in network.per.items()))
