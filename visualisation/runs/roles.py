"""Figure ``roles``: roles of each vehicle over time.

Large fleets fold vehicles with the same roles into one lane; if that does not suffice, those with the same initial
roles. A folded lane shows the share of its vehicles that hold a role and that the role drives.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Mapping, Sequence
from itertools import accumulate, chain, pairwise, product
from typing import Any, NamedTuple

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from missions.figure import RunResults
from visualisation import run_records, style
from visualisation.page import DrawnPage
from visualisation.run_records import RoleKey, Span, Tenure, VehicleFault, n_at_once
from visualisation.runs import captions
from visualisation.runs.declared import Kit
from visualisation.runs.sheet import BESIDE_IN, WIDE_IN, Name, room_in, sheet

Tenures = Mapping[str, Sequence[Tenure]]
"""Roles by vehicle."""


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


def one_each(tenures: Tenures) -> list[VehicleLane]:
    """Return a lane for each vehicle."""
    return _folded(tenures, lambda vehicle: vehicle)


def same_roles(tenures: Tenures) -> list[VehicleLane]:
    """Return a lane for each set of vehicles that held the same roles at any time."""
    return _folded(tenures, lambda vehicle: frozenset((tenure.group, tenure.role) for tenure in tenures[vehicle]))


def same_beginning(tenures: Tenures) -> list[VehicleLane]:
    """Return a lane for each set of vehicles with the same initial roles."""

    def first(vehicle: str) -> Hashable:
        began = min((span.start_s for tenure in tenures[vehicle] for span in tenure.held), default=0.0)
        return frozenset(
            (tenure.group, tenure.role)
            for tenure in tenures[vehicle]
            if tenure.held and tenure.held[0].start_s == began
        )

    return _folded(tenures, first)


FOLDS: tuple[Callable[[Tenures], list[VehicleLane]], ...] = (one_each, same_roles, same_beginning)
"""Folding functions, in order of decreasing number of lanes."""


def _folded(tenures: Tenures, alike: Callable[[str], Hashable]) -> list[VehicleLane]:
    members: dict[Hashable, list[str]] = {}
    for vehicle in tenures:
        members.setdefault(alike(vehicle), []).append(vehicle)
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
    """Return spans of constant share of the vehicles, without those of share zero.

    Args:
        n_vehicles: all vehicles, including those without spans.
    """
    return [(span, n / n_vehicles) for span, n in n_at_once(chain(*of_vehicles)) if n]


ROWS = ((0.15, style.SMALL_PT), (0.12, style.TINY_PT))
"""Heights of rows (in) and font sizes (pt): spacious, dense."""
BAND_GAP_IN = 0.06
FOLDED_ROW_IN = 0.2
VEHICLE_ROOM_IN = 1.0
ROLE_ROOM_IN, NARROW_ROLE_ROOM_IN = 1.5, 0.8
MOST_LANES = 12
"""Maximum number of lanes before similar vehicles are folded."""
HELD, DRIVING = 0.3, 0.68
"""Share of a row filled by a bar."""
HATCHES = ("", "/////", ".....", "xxxxx", "-----", "|||||")
"""Hatches of groups, the largest group first."""
FOLDED = style.GREY
"""Colour of folded lanes."""
FAULT: dict[str, Any] = {
    "facecolor": "none", "edgecolor": style.tint(style.BLACK, 0.35), "hatch": "\\\\\\\\", "linewidth": 0, "zorder": 1,
}  # fmt: skip
"""Look of a band during a fault."""


def picture(results: RunResults, width_in: float = style.PAGE_IN) -> DrawnPage:
    """Draw a band per vehicle, a row per role: a thin bar while held, a solid one while active."""
    tenures = run_records.tenures(results)
    faults = run_records.vehicle_faults(results)
    groups = Counter(tenure.group for own in tenures.values() for tenure in own)
    hatches = {group: HATCHES[number % len(HATCHES)] for number, (group, _) in enumerate(groups.most_common())}
    for fold, row in product(FOLDS, ROWS):
        lanes = fold(tenures)
        if sum(_band_in(lane, row[0]) for lane in lanes) <= room_in(results, width_in) and len(lanes) <= MOST_LANES:
            break
    with style.paper():
        figure = _drawn(results, lanes, hatches, faults, width_in, row)
    return DrawnPage(figure, captions.roles(results, [lane.vehicles for lane in lanes if lane.is_folded]))


def _height_in(lane: VehicleLane, row_in: float) -> float:
    """Return the height of a row of a lane."""
    return FOLDED_ROW_IN if lane.is_folded else row_in


def _band_in(lane: VehicleLane, row_in: float) -> float:
    """Return the height of the band of a lane."""
    return max(1, len(lane.rows)) * _height_in(lane, row_in) + BAND_GAP_IN


def _drawn(
    results: RunResults,
    lanes: Sequence[VehicleLane],
    hatches: Mapping[str, str],
    faults: Sequence[VehicleFault],
    width_in: float,
    row: tuple[float, float],
) -> Figure:
    """Draw a page of lanes; ``row`` is row height (in) and font size (pt)."""
    row_in, size_pt = row
    names, tops_in = _names(lanes, row_in, size_pt, ROLE_ROOM_IN if width_in >= WIDE_IN else NARROW_ROLE_ROOM_IN)
    legend = _legend(hatches, bool(faults), any(lane.is_folded for lane in lanes))
    page = sheet(results, names, tops_in[-1], legend, width_in)
    looks = Kit(results).looks
    for number, (lane, (top_in, end_in)) in enumerate(zip(lanes, pairwise(tops_in), strict=True)):
        if number % 2 == 0:
            page.band(top_in, end_in - top_in)
        for fault in faults:  # the band of a vehicle is hatched while something has befallen it
            if lane.vehicles == (fault.vehicle,):
                length_s = fault.span.end_s - fault.span.start_s
                page.axes.broken_barh([(fault.span.start_s, length_s)], (top_in, end_in - top_in), **FAULT)
        for index, role in enumerate(lane.rows):
            middle_in = _middle_in(lane, top_in, index, row_in)
            if lane.is_folded:
                _shares(page.axes, lane, role, middle_in)
            else:
                _bars(page.axes, role, looks[lane.vehicles[0]].colour, hatches[role.group], middle_in, row_in)
    return page.finished()


def _middle_in(lane: VehicleLane, top_in: float, number: int, row_in: float) -> float:
    return top_in + BAND_GAP_IN / 2 + (number + 0.5) * _height_in(lane, row_in)


def _names(
    lanes: Sequence[VehicleLane], row_in: float, size_pt: float, role_room_in: float
) -> tuple[list[Name], list[float]]:
    """Return names of lanes and roles, and the tops of lanes with the bottom of the last one."""
    tops_in = [0.0, *accumulate(_band_in(lane, row_in) for lane in lanes)]
    titles = [f"{len(lane.vehicles)} vehicles" if lane.is_folded else lane.vehicles[0] for lane in lanes]
    titles = [style.fitted(title, VEHICLE_ROOM_IN, size_pt, "bold") for title in titles]
    titles_in = max((style.width_in(title, size_pt, "bold") for title in titles), default=0.0)
    roles = {role.role: style.fitted(role.role, role_room_in, size_pt) for lane in lanes for role in lane.rows}
    left_in = (
        BESIDE_IN - max((style.width_in(role, size_pt) for role in roles.values()), default=0.3) - 0.12 - titles_in
    )
    names = []
    for lane, title, (top_in, end_in) in zip(lanes, titles, pairwise(tops_in), strict=True):
        middle_in, aside_in = (top_in + end_in) / 2, 0.0
        if lane.is_folded and len(lane.rows) > 1:
            aside_in, members = 0.06, style.fitted(", ".join(lane.vehicles), titles_in + 0.1, style.TINY_PT)
            names.append(Name(left_in, middle_in + aside_in, members))
        names.append(Name(left_in, middle_in - aside_in, title, size_pt, "bold"))
        for number, role in enumerate(lane.rows):
            names.append(Name(BESIDE_IN, _middle_in(lane, top_in, number, row_in), roles[role.role], size_pt))
    return names, tops_in


def _bars(axes: Axes, row: LaneRole, colour: str, hatch: str, middle_in: float, row_in: float) -> None:
    for spans, fill, shade, pattern in (
        (row.held[0], HELD, style.tint(colour, 0.4), ""),
        (row.active[0], DRIVING, colour, hatch),
    ):
        boxes = [(span.start_s, span.end_s - span.start_s) for span in spans]
        where_in = middle_in - fill * row_in / 2, fill * row_in
        axes.broken_barh(boxes, where_in, facecolor=shade, edgecolor=shade, linewidth=0.4, zorder=2)
        if pattern:
            axes.broken_barh(boxes, where_in, facecolor="none", edgecolor="white", hatch=pattern, linewidth=0, zorder=3)


def _shares(axes: Axes, lane: VehicleLane, row: LaneRole, middle_in: float) -> None:
    """Draw a folded lane: pale the share that holds a role, dark the share that it drives."""
    high_in = DRIVING * FOLDED_ROW_IN
    for of_vehicles, strength in ((row.held, 0.4), (row.active, 1.0)):
        for span, share in shares(of_vehicles, len(lane.vehicles)):
            where_in = middle_in + high_in / 2 - share * high_in, share * high_in
            box = [(span.start_s, span.end_s - span.start_s)]
            axes.broken_barh(box, where_in, facecolor=style.tint(FOLDED, strength), linewidth=0, zorder=2)


def _legend(hatches: Mapping[str, str], with_faults: bool, with_folds: bool) -> list[Artist]:
    meanings: list[Artist] = [
        Line2D([], [], color=style.tint(style.BLACK, 0.35), linewidth=2.0, label="role held"),
        Line2D([], [], color=style.GREY, linewidth=6.0, label="role drives the vehicle"),
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
