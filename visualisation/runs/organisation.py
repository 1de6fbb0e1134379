"""Figure ``organisation``: role assignments over the whole run, and in the caption at one time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

from matplotlib.artist import Artist
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from missions import words
from missions.figure import RunResults, VehicleLook, run_end_s
from missions.spans import Span
from visualisation import run_records, style
from visualisation.output import DrawingError
from visualisation.page import DrawnPage
from visualisation.run_records import GroupNode, preorder
from visualisation.runs import captions
from visualisation.runs.declared import Kit
from visualisation.runs.roles import FOLDED_ROW_IN, draw_shares
from visualisation.runs.sheet import TITLE_IN, Row, Sheet, ends_in, room_in, sheet
from visualisation.runs.views import (
    CREATED,
    DISSOLVED,
    MISSION,
    REFUSED,
    SUCCEEDED,
    Holding,
    View,
    view_of,
)  # fmt: skip

LABELLED_IN = 0.09
MOST_LISTED = 8  # maximum number of roles of a group that a caption lists with their holders
TICK: dict[str, Any] = {"marker": "|", "markersize": 8.0, "markeredgecolor": style.BLACK, "markeredgewidth": 1.2}
MARKS: dict[str, tuple[dict[str, Any], str]] = {
    REFUSED: ({"marker": "X", "markersize": 4.5}, "refused"),
    SUCCEEDED: ({"marker": "*", "markersize": 5.5}, "succession"),
    MISSION: ({"marker": "d", "markersize": 4.5}, "mission assigned"),
    CREATED: (TICK, ""),
    DISSOLVED: (TICK, ""),
}
MARK: dict[str, Any] = {
    "color": style.BLACK, "linestyle": "none", "markeredgecolor": "white", "markeredgewidth": 0.4, "zorder": 6,
    "clip_on": False,
}  # fmt: skip
PALE = 0.25
HATCH: dict[str, Any] = {"facecolor": "none", "edgecolor": style.GREY, "hatch": "//////", "linewidth": 0, "zorder": 1}


DETAILS = ((0.115, 99), (LABELLED_IN, 99), (0.07, 99), (0.04, 12), (0.04, 4))
"""Pairs of lane height, and most holders of a role that have lanes instead of a count, from most to least detail."""
LEAST_ROW_IN = 0.11
HEAD = "\u2605 "  # prefix of roles that lead their group
LEAST_LIGHT = 0.45  # names on colours with a luminance (0 to 1) up to this are white


class RoleRow(NamedTuple):
    """Role over time: holders in lanes, successors in the lane of their predecessor."""

    role: str
    lanes: list[list[Holding]]
    vacant: list[Span]
    is_counted: bool
    lane_in: float


RowOfGroup = Row[tuple[GroupNode, RoleRow | None]]


def picture(
    results: RunResults, at_s: float | None = None, viewer: str = "", width_in: float = style.PAGE_IN
) -> DrawnPage:
    """Draw all role holders over the mission, with a line at the time whose holders the caption names.

    ``at_s`` None is the end of the run; an empty ``viewer`` shows the roles that each vehicle assumes for itself.
    Raises DrawingError for no such time or vehicle.
    """
    whole, looks = view_of(results, viewer), Kit(results).looks
    end_s = run_end_s(results)
    shown_s = end_s if at_s is None else at_s
    if not 0.0 <= shown_s <= end_s:
        raise DrawingError(f"at {at_s:g} s: this run lasts from 0 to {end_s:g} s")
    with style.paper():
        # Less detail of all groups before fewer groups.
        for n_groups, detail in product(range(max(1, len(whole.groups)), 0, -1), DETAILS):
            view = whole._replace(groups=whole.groups[:n_groups])
            bands = [list(_rows(view, group, depth, *detail)) for group, depth in _by_supervision(view.groups)]
            body_in = ends_in(bands)[-1] or 0.3
            if body_in <= room_in(results, width_in):
                break
        roles = [role for band in bands for row in band if (role := row.content[1])]
        page = sheet(results, body_in, _legend(view, roles), width_in)
        placed = list(page.rows(bands))
        if not roles:
            page.axes.set_yticks([body_in / 2], ["no role was held"])
        inch_s = page.inch_s()
        for row, top_in in placed:
            group, role = row.content
            if role is not None:
                _draw_row(page, role, looks, top_in, row.high_in, inch_s)
            elif not group.is_founded:  # a line over the lifetime of a group formed at run time
                for start_s, length_s in page.along(view.exists[group.name]):
                    middle_in = top_in + row.high_in / 2
                    page.axes.hlines(middle_in, start_s, start_s + length_s, color=style.BLACK, linewidth=1.2, zorder=5)
            for mark in view.marks:
                if (mark.group, mark.role) == (group.name, role.role if role else ""):
                    look = {**MARK, **MARKS[mark.kind][0]}
                    page.axes.plot([mark.time_s], [top_in + row.high_in / 2], **look)
        page.axes.axvline(shown_s, color=style.BLACK, linewidth=1.2, zorder=4)
        figure = page.finished()
    return DrawnPage(figure, _caption(results, view, shown_s, roles, len(whole.groups) - len(view.groups)))


def _by_supervision(groups: Sequence[GroupNode]) -> Iterator[tuple[GroupNode, int]]:
    """Yield groups, each before those that it supervises, with the number of groups above it."""
    names = {group.name for group in groups}
    highest = [group for group in groups if group.above not in names]
    return preorder(highest, lambda above: [group for group in groups if group.above == above.name])


def _rows(view: View, group: GroupNode, depth: int, lane_in: float, most_lanes: int) -> Iterator[RowOfGroup]:
    yield Row(group.name, TITLE_IN, depth, (group, None), "bold")
    vacancies = view.vacancies(group)
    marked = {mark.role for mark in view.marks if mark.group == group.name}
    for role in group.roles:
        lanes, vacant = _lanes(view.holdings.get((group.name, role.name), ())), vacancies[role.name]
        if not (lanes or vacant or role.name in marked):
            continue
        is_counted = len(lanes) > most_lanes
        high_in = FOLDED_ROW_IN if is_counted else max(LEAST_ROW_IN, len(lanes) * lane_in) + 0.02
        name = f"{HEAD * role.is_head}{role.name} {role.cardinality}".rstrip()
        yield Row(name, high_in, depth + 1, (group, RoleRow(role.name, lanes, vacant, is_counted, lane_in)))


def _draw_row(
    page: Sheet, row: RoleRow, looks: Mapping[str, VehicleLook], top_in: float, high_in: float, inch_s: float
) -> None:
    page.axes.broken_barh(page.along(row.vacant), (top_in + 0.01, high_in - 0.02), **HATCH)
    if row.is_counted:
        present = [holding.present for lane in row.lanes for holding in lane]
        draw_shares(page.axes, present, len(row.lanes), top_in + high_in / 2, style.GREY)
        return
    for number, lane in enumerate(row.lanes):
        for holding in lane:
            colour = looks[holding.vehicle].colour if holding.vehicle in looks else style.GREY
            _draw_bar(page, holding, colour, top_in + 0.01 + number * row.lane_in, row.lane_in, inch_s)


def _draw_bar(page: Sheet, holding: Holding, colour: str, top_in: float, lane_in: float, inch_s: float) -> None:
    for spans, strength in (([holding.span], PALE), (holding.present, 1.0)):
        where_in = top_in + 0.008, lane_in - 0.016
        shade = style.tint(colour, strength)
        page.axes.broken_barh(page.along(spans), where_in, facecolor=shade, linewidth=0, zorder=2)
    ((left_s, length_s),) = page.along([holding.span])
    has_room = style.width_in(holding.vehicle, style.TINY_PT) <= length_s / inch_s - 0.08
    if has_room and lane_in >= LABELLED_IN:
        is_here = any(span.holds(left_s) for span in holding.present)
        page.axes.text(
            left_s + 0.04 * inch_s, top_in + lane_in / 2, holding.vehicle.replace("$", r"\$"),
            fontsize=style.TINY_PT, va="center_baseline", zorder=3, color=ink(colour) if is_here else style.BLACK,
        )  # fmt: skip


def ink(colour: str) -> str:
    """Return black or white, whichever is legible on a colour."""
    # Luma of ITU-R BT.601.
    red, green, blue = to_rgb(colour)
    return style.BLACK if 0.299 * red + 0.587 * green + 0.114 * blue > LEAST_LIGHT else "white"


def _lanes(holdings: Sequence[Holding]) -> list[list[Holding]]:
    lanes: list[list[Holding]] = []
    for holding in holdings:
        free = [lane for lane in lanes if lane[-1].span.end_s <= holding.span.start_s]
        # A vehicle that returns to a role stays in its lane.
        own = [lane for lane in free if lane[-1].vehicle == holding.vehicle]
        if free:
            (own or free)[0].append(holding)
        else:
            lanes.append([holding])
    return lanes


def _legend(view: View, rows: Sequence[RoleRow]) -> list[Artist]:
    holdings = [holding for row in rows for lane in row.lanes for holding in lane]
    is_away = any(holding.present != (holding.span,) for holding in holdings)
    away = "declared absent" if view.viewer else "out of the mission"
    marks = [kind for kind in MARKS if any(mark.kind == kind for mark in view.marks)]
    chips: list[Artist] = [Patch(facecolor=style.GREY, linewidth=0, label="holds the role (colour: vehicle)")]
    if is_away:
        chips.append(Patch(facecolor=style.tint(style.GREY, PALE), edgecolor=style.GREY, linewidth=0.5, label=away))
    if any(row.is_counted for row in rows):
        chips.append(Patch(facecolor=style.GREY, linewidth=0, label="height: share of the maximum of holders"))
    if any(row.vacant for row in rows):
        chips.append(Patch(label="below minimum", **HATCH))
    ticks = {CREATED, DISSOLVED} & {*marks}
    if ticks:
        chips.append(Line2D([], [], label="group formed until dissolved", **{**MARK, **TICK, "linestyle": "-"}))
    return [
        *chips,
        *(Line2D([], [], label=MARKS[kind][1], **{**MARK, **MARKS[kind][0]}) for kind in marks if kind not in ticks),
    ]


def _caption(results: RunResults, view: View, at_s: float, rows: Sequence[RoleRow], left_out: int) -> str:
    seen = f"in the view of {view.viewer}" if view.viewer else "by the roles that each vehicle holds itself"
    busy = {holding.vehicle for own in view.holdings.values() for holding in own if holding.holds(at_s)}
    reserves = [name for name in run_records.vehicle_names(results) if name not in busy]
    groups = (
        _holders(view, group, at_s)
        for group in view.groups
        if any(span.holds(at_s) for span in view.exists[group.name])
    )
    return captions.of_run(
        results,
        f"Organisation {seen}, over mission time; the thick line marks {words.time(at_s)}.",
        f"Holders at that time: {'; '.join(groups)}.",
        f"Reserves hold no role: {words.listed(reserves)}." if reserves else "",
        "Each role has its required number of holders; a star marks the role of the group leader. A group is indented "
        "below the one that supervises it.",
        "Hatched: fewer holders in the mission than the role requires." if any(row.vacant for row in rows) else "",
        "Bars are too low for the names of their vehicles." if any(row.lane_in < LABELLED_IN for row in rows) else "",
        f"{left_out} groups are not shown." if left_out else "",
        _refused(view),
    )


def _holders(view: View, group: GroupNode, at_s: float) -> str:
    roles = []
    for role in group.roles:
        holders = [holding for holding in view.holdings.get((group.name, role.name), ()) if holding.holds(at_s)]
        present = [holding.vehicle for holding in holders if holding.is_present(at_s)]
        names = [*present, *(f"{holding.vehicle} (absent)" for holding in holders if holding.vehicle not in present)]
        names += [f"{role.minimum - len(present)} vacant"] if len(present) < role.minimum else []
        roles += [f"{role.name} {', '.join(names)}"] if names else []
    return f"{group.name} ({'; '.join(roles) if len(roles) <= MOST_LISTED else f'{len(roles)} roles'})"


def _refused(view: View) -> str:
    n = sum(mark.kind == REFUSED for mark in view.marks)
    by = f"by {view.viewer}" if view.viewer else "by any vehicle"
    return f"Requests refused {by} are crossed at {n} {'place' if n == 1 else 'places'}." if n else ""
