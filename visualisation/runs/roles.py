"""Figure ``roles``: roles of each vehicle over time.

Large fleets fold vehicles with the same roles into one lane; if that does not suffice, those with the same initial
roles. A folded lane shows the share of its vehicles that hold a role and that the role drives.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from itertools import chain
from typing import Any, NamedTuple

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from missions.figure import RunResults
from missions.spans import Span, n_at_once
from visualisation import run_records, style
from visualisation.page import DrawnPage
from visualisation.run_records import RoleKey, Tenure
from visualisation.runs import captions
from visualisation.runs.declared import Kit
from visualisation.runs.sheet import TITLE_IN, Row, ends_in, fitting, room_in, sheet

Tenures = Mapping[str, Sequence[Tenure]]


class LaneRole(NamedTuple):
    """Role of a lane: spans in which each vehicle held it, and in which it was active."""

    group: str
    role: str
    held: tuple[tuple[Span, ...], ...]
    active: tuple[tuple[Span, ...], ...]


class VehicleLane(NamedTuple):
    """One or several vehicles with their roles."""

    vehicles: tuple[str, ...]
    rows: tuple[LaneRole, ...]

    @property
    def is_folded(self) -> bool:
        """True for a lane of several vehicles."""
        return len(self.vehicles) > 1


def _roles_of(tenures: Iterable[Tenure]) -> Hashable:
    return frozenset((tenure.group, tenure.role) for tenure in tenures)


def _initial(tenures: Sequence[Tenure]) -> list[Tenure]:
    began = min((span.start_s for tenure in tenures for span in tenure.held), default=0.0)
    return [tenure for tenure in tenures if tenure.held and tenure.held[0].start_s == began]


FOLDS: tuple[Callable[[str, Sequence[Tenure]], Hashable], ...] = (
    lambda vehicle, own: vehicle,
    lambda vehicle, own: _roles_of(own),
    lambda vehicle, own: _roles_of(_initial(own)),
)
"""Common property of the vehicles of a lane, tried in order: name, roles at any time, initial roles."""


def folded(tenures: Tenures, fold: Callable[[str, Sequence[Tenure]], Hashable]) -> list[VehicleLane]:
    """Return a lane for each set of vehicles that a fold puts together."""
    members: dict[Hashable, list[str]] = {}
    for vehicle, own in tenures.items():
        members.setdefault(fold(vehicle, own), []).append(vehicle)
    return [VehicleLane(tuple(own), _rows(tenures, own)) for own in members.values()]


def _rows(tenures: Tenures, vehicles: Sequence[str]) -> tuple[LaneRole, ...]:
    by_role: dict[RoleKey, list[Tenure]] = {}
    for vehicle in vehicles:
        for tenure in tenures[vehicle]:
            by_role.setdefault((tenure.group, tenure.role), []).append(tenure)
    return tuple(
        LaneRole(*key, tuple(tenure.held for tenure in own), tuple(tenure.active for tenure in own))
        for key, own in by_role.items()
    )


def shares(of_vehicles: Sequence[Sequence[Span]], n_vehicles: int) -> list[tuple[Span, float]]:
    """Return spans of constant share of all ``n_vehicles``, without those of share zero."""
    return [(span, n / n_vehicles) for span, n in n_at_once(chain(*of_vehicles)) if n]


ROW_IN, FOLDED_ROW_IN = 0.12, 0.2
MOST_LANES = 12  # maximum number of lanes before similar vehicles are folded
HELD, DRIVING = 0.3, 0.68  # share of a row filled by a bar
HATCHES = ("", "/////", ".....", "xxxxx", "-----", "|||||")
FOLDED = style.GREY
FAULT: dict[str, Any] = {
    "facecolor": "none", "edgecolor": style.tint(style.BLACK, 0.35), "hatch": "\\\\\\\\", "linewidth": 0, "zorder": 1,
}  # fmt: skip


def picture(results: RunResults, width_in: float = style.PAGE_IN) -> DrawnPage:
    """Draw a band per vehicle, a row per role: a thin bar while held, a solid one while active."""
    tenures = run_records.tenures(results)
    faults = run_records.vehicle_faults(results)
    groups = Counter(tenure.group for own in tenures.values() for tenure in own)
    hatches = {group: HATCHES[number % len(HATCHES)] for number, (group, _) in enumerate(groups.most_common())}
    folds = [folded(tenures, fold) for fold in FOLDS]
    few = [lanes for lanes in folds if len(lanes) <= MOST_LANES] or folds[-1:]
    bands = fitting(([list(_band(lane)) for lane in lanes] for lanes in few), room_in(results, width_in))
    lanes = [title.content[0] for title, *_ in bands]
    looks = Kit(results).looks
    with style.paper():
        legend = _legend(hatches, bool(faults), any(lane.is_folded for lane in lanes))
        page = sheet(results, ends_in(bands)[-1], legend, width_in)
        for row, top_in in page.rows(bands):
            lane, role = row.content
            middle_in = top_in + row.high_in / 2
            if role is None:  # the title; the band of a vehicle is hatched during its faults
                spans = [fault.span for fault in faults if lane.vehicles == (fault.vehicle,)]
                high_in = sum(other.high_in for other in _band(lane))
                page.axes.broken_barh(page.along(spans), (top_in, high_in), **FAULT)
            elif lane.is_folded:
                _shares(page.axes, lane, role, middle_in)
            else:
                _bars(page.axes, role, looks[lane.vehicles[0]].colour, hatches[role.group], middle_in)
        figure = page.finished()
    return DrawnPage(figure, _caption(results, lanes, len(tenures) - sum(len(lane.vehicles) for lane in lanes)))


def _band(lane: VehicleLane) -> Iterator[Row[tuple[VehicleLane, LaneRole | None]]]:
    names = ", ".join(lane.vehicles)
    title = f"{len(lane.vehicles)} vehicles: {names}" if lane.is_folded else names
    yield Row(title, TITLE_IN, 0, (lane, None), "bold")
    for role in lane.rows:
        yield Row(role.role, FOLDED_ROW_IN if lane.is_folded else ROW_IN, 1, (lane, role))


def _bars(axes: Axes, row: LaneRole, colour: str, hatch: str, middle_in: float) -> None:
    for spans, fill, shade, pattern in (
        (row.held[0], HELD, style.tint(colour, 0.4), ""),
        (row.active[0], DRIVING, colour, hatch),
    ):
        boxes = [(span.start_s, span.end_s - span.start_s) for span in spans]
        where_in = middle_in - fill * ROW_IN / 2, fill * ROW_IN
        axes.broken_barh(boxes, where_in, facecolor=shade, edgecolor=shade, linewidth=0.4, zorder=2)
        # A second bar, since Matplotlib draws hatch and edge in one colour.
        if pattern:
            axes.broken_barh(boxes, where_in, facecolor="none", edgecolor="white", hatch=pattern, linewidth=0, zorder=3)


def _shares(axes: Axes, lane: VehicleLane, row: LaneRole, middle_in: float) -> None:
    for of_vehicles, strength in ((row.held, 0.4), (row.active, 1.0)):
        draw_shares(axes, of_vehicles, len(lane.vehicles), middle_in, style.tint(FOLDED, strength))


def draw_shares(
    axes: Axes,
    of_vehicles: Sequence[Sequence[Span]],
    n_vehicles: int,
    middle_in: float,
    colour: str | tuple[float, float, float],
) -> None:
    """Draw the share of vehicles as the height of a bar in a row of ``FOLDED_ROW_IN``; see ``shares``."""
    high_in = DRIVING * FOLDED_ROW_IN
    for span, share in shares(of_vehicles, n_vehicles):
        where_in = middle_in + high_in / 2 - share * high_in, share * high_in
        axes.broken_barh([(span.start_s, span.end_s - span.start_s)], where_in, facecolor=colour, linewidth=0, zorder=2)


def _legend(hatches: Mapping[str, str], with_faults: bool, with_folds: bool) -> list[Artist]:
    meanings: list[Artist] = [
        Line2D([], [], color=style.tint(style.BLACK, 0.35), linewidth=2.0, label="role held"),
        Line2D([], [], color=style.GREY, linewidth=6.0, label="role active"),
    ]
    meanings += [Patch(facecolor=FOLDED, linewidth=0, label="height: share of the vehicles")] if with_folds else []
    meanings += [Patch(label="fault", **FAULT)] if with_faults else []
    if len(hatches) < 2:
        return meanings
    return meanings + [
        Patch(facecolor=style.GREY, edgecolor="white", hatch=hatch, linewidth=0,
              label=f"group {group}")
        for group, hatch in hatches.items()
    ]  # fmt: skip


def _caption(results: RunResults, lanes: Sequence[VehicleLane], n_left_out: int) -> str:
    folded = [f"{len(lane.vehicles)} vehicles: {', '.join(lane.vehicles)}" for lane in lanes if lane.is_folded]
    shared = f"Vehicles with the same roles share a lane, and the height is their share ({'; '.join(folded)})."
    return captions.of_run(
        results,
        "Roles of the vehicles over mission time.",
        "A thin bar: the vehicle holds the role; a solid bar: the role is active.",
        shared if folded else "",
        f"{n_left_out} vehicles are not shown." if n_left_out else "",
    )
