"""Does the fleet hang together: components and vehicles without which it would fall apart, as metrics and a figure.

A studied or drawn run is cut into windows in which every vehicle has two TDMA slots. Study files, `remoras plot` and
Python callers name what is here: ``missions.runs.connectivity:CONNECTED``.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from missions.figure import Figure, RunResults, Style, axis_end_s
from missions.graphs import cutting, heard_among, is_connected, n_parts
from missions.metric import Better, Metric

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from missions.metric import MeasuredRun

SLOTS_EACH = 2
"""Slots of every vehicle in a window."""
PACKETS = ("slot", "time_s", "sender", "size_bits", "receivers", "lost_by", "collided_at")
"""Columns that are read."""


class Window(NamedTuple):
    """A stretch of a run.

    Attributes:
        from_s: when its first packet began.
        is_connected: what any vehicle said could reach every other.
        n_components: parts of the fleet that are tied by links used both ways.
        cutting: vehicles without which one of these parts would fall apart.
    """

    from_s: float
    is_connected: bool
    n_components: int
    cutting: frozenset[str]


def windows(vehicles: Sequence[str], packets: Iterable[Mapping[str, Any]]) -> Iterator[Window]:
    """The windows of a run, in time order; a last one that the end of the run cuts short is left out.

    Args:
        vehicles: all of them: one that is lost is a part of its own.
        packets: rows of the table of packets.
    """
    n_slots = SLOTS_EACH * len(vehicles)
    by_window: dict[int, list[Mapping[str, Any]]] = defaultdict(list)
    for row in packets:
        by_window[row["slot"] // n_slots].append(row)
    last = max(by_window, default=0)
    for number in sorted(by_window):
        rows = by_window[number]
        if number == last > 0 and max(row["slot"] for row in rows) < (number + 1) * n_slots - 1:
            continue
        heard = heard_among(vehicles, rows)
        from_s = min(row["time_s"] for row in rows)
        yield Window(from_s, is_connected(heard), n_parts(heard), cutting(heard))


def _of(run: MeasuredRun) -> list[Window]:
    from remoras.recorder import PACKETS as TABLE

    names = TABLE.column_names
    packets = [dict(zip(names, row, strict=True)) for row in run.recorder.rows("packets")]
    return list(windows([vehicle.name for vehicle in run.scenario.vehicle], packets))


def _connected_fraction(run: MeasuredRun) -> float | None:
    found = _of(run)
    return round(sum(window.is_connected for window in found) / len(found), 6) if found else None


def _n_cutting(run: MeasuredRun) -> float | None:
    found = _of(run)
    return round(sum(len(window.cutting) for window in found) / len(found), 6) if found else None


CONNECTED = Metric(
    "connected_fraction",
    "",
    Better.HIGHER,
    "connected",
    _connected_fraction,
    note="share of windows of two slots a vehicle in which what any vehicle said could reach every other",
)
CUTTING = Metric(
    "n_cut_vehicles",
    "",
    Better.LOWER,
    "vehicles without which the fleet falls apart",
    _n_cutting,
    note="mean over windows of two slots a vehicle, by links used both ways",
)


def _draw(axes: Axes, results: RunResults, style: Style) -> str:
    vehicles = list(style.looks)
    rows = results.table("packets").select(list(PACKETS)).to_pylist()
    found = list(windows(vehicles, rows))
    times_s = [window.from_s for window in found]
    axes.step(times_s, [window.n_components for window in found], where="post", color=style.black, label="parts")
    for number, (vehicle, look) in enumerate(style.looks.items(), 1):
        at_s = [window.from_s for window in found if vehicle in window.cutting]
        if at_s:
            height = -0.35 * number
            axes.plot(
                at_s, [height] * len(at_s), look.marker, color=look.colour, markersize=3, label=vehicle, clip_on=False
            )
    axes.set_xlim(0.0, axis_end_s(results))
    axes.set_ylim(-0.35 * (len(vehicles) + 1), len(vehicles) + 0.5)
    axes.set_yticks(range(1, len(vehicles) + 1))
    axes.axhline(0.0, color=style.grey, linewidth=0.5)
    axes.set_xlabel(style.axis("mission time", "s"))
    axes.set_ylabel("parts of the fleet")
    share = sum(window.is_connected for window in found) / max(len(found), 1)
    return (
        "Parts that are tied by links used both ways, in windows of two slots a vehicle; below, vehicles without which "
        f"one of them would fall apart. In {share:.0%} of {len(found)} windows what any vehicle said could reach all."
    )


CONNECTIVITY = Figure("connectivity", "Connectivity of the fleet", _draw, needs=("packets",))
