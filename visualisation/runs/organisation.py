"""Figure ``organisation``: role assignments at one time, and over the whole run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import accumulate
from typing import Any, NamedTuple

from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from missions.figure import RunResults
from missions.graphs import GroupNode
from visualisation import run_records, style, words
from visualisation.page import DrawnPage
from visualisation.run_records import Span
from visualisation.runs import captions
from visualisation.runs.declared import Kit
from visualisation.runs.roles import shares
from visualisation.runs.roster import HEAD, MARGIN_IN, Roster, ink
from visualisation.runs.sheet import BESIDE_IN, WIDE_IN, Name, Sheet, room_in, sheet
from visualisation.runs.views import (
    CREATED,
    DISSOLVED,
    MISSION,
    REFUSED,
    SUCCEEDED,
    Holding,
    View,
    checked_time_s,
    view_of,
)  # fmt: skip

NAMES_IN, NARROW_NAMES_IN = 1.6, 1.05
HEAD_IN, GAP_IN, TITLE_IN = 0.14, 0.05, 0.2
"""Heights: line of a group, gap between groups, title above the roster."""
COUNT_IN = 0.2
"""Height of a row that counts holders."""
LABELLED_IN = 0.09
"""Minimum height of a labelled bar."""
TICK: dict[str, Any] = {"marker": "|", "markersize": 8.0, "markeredgecolor": style.BLACK, "markeredgewidth": 1.2}
MARKS: dict[str, tuple[dict[str, Any], str]] = {
    REFUSED: ({"marker": "X", "markersize": 4.5}, "refused"),
    SUCCEEDED: ({"marker": "*", "markersize": 5.5}, "succession"),
    MISSION: ({"marker": "d", "markersize": 4.5}, "mission given"),
    CREATED: (TICK, ""),
    DISSOLVED: (TICK, ""),
}
"""Look and legend label of each marked event."""
MARK: dict[str, Any] = {
    "color": style.BLACK, "linestyle": "none", "markeredgecolor": "white", "markeredgewidth": 0.4, "zorder": 6,
    "clip_on": False,
}  # fmt: skip
PALE = 0.25
HATCH: dict[str, Any] = {"facecolor": "none", "edgecolor": style.GREY, "hatch": "//////", "linewidth": 0, "zorder": 1}
"""Look of a span in which a role has too few holders."""


class DetailLevel(NamedTuple):
    """Level of detail of a page.

    Attributes:
        lane_in, crowded_in: height of a bar, with up to ``FEW`` holders of the role and with more.
        most_lanes: roles with more holders are drawn as a count.
        most_chips: maximum number of names in a role of the roster.
        has_key: whether milestones are also listed below the figure.
    """

    lane_in: float
    crowded_in: float
    most_lanes: int
    most_chips: int
    has_key: bool = False


FEW = 4
DETAILS = (
    DetailLevel(0.115, 0.115, 99, 99, True), DetailLevel(0.115, 0.07, 99, 99, True),
    DetailLevel(0.115, 0.04, 99, 24, True), DetailLevel(0.095, 0.07, 99, 99), DetailLevel(0.095, 0.04, 99, 24),
    DetailLevel(0.095, 0.04, 12, 12), DetailLevel(0.095, 0.04, FEW, 6),
    DetailLevel(0.06, 0.04, FEW, 6), DetailLevel(0.03, 0.03, FEW, 3),
)  # fmt: skip
"""From most to least detail; the first that fits a page is used."""


class RoleRow(NamedTuple):
    """Role over time: holders in lanes, successors in the lane of their predecessor."""

    group: GroupNode
    name: str
    role: str
    lanes: list[list[Holding]]
    vacant: list[Span]
    is_counted: bool
    lane_in: float
    height_in: float


def picture(
    results: RunResults, at_s: float | None = None, viewer: str = "", width_in: float = style.PAGE_IN
) -> DrawnPage:
    """Draw a roster of the groups at a time, and below it all role holders over the mission.

    Args:
        at_s: time of the roster; None for the last time with the most role assignments.
        viewer: name of a vehicle; empty for the roles that each vehicle assumes for itself.

    Raises:
        DrawingError: no such time or vehicle.
    """
    view = view_of(results, viewer)
    end_s = run_records.end_s(results)
    shown_s = checked_time_s(at_s, view, end_s)
    with style.paper():
        for detail in DETAILS:
            drawing = _Drawing(results, view, shown_s, width_in, detail, view.groups)
            if drawing.height_in <= room_in(results, width_in, detail.has_key):
                break
        shown = list(view.groups)
        while drawing.height_in > room_in(results, width_in, detail.has_key) and len(shown) > 1:
            shown.pop()
            drawing = _Drawing(results, view, shown_s, width_in, detail, shown)
        figure = drawing.drawn(results)
    left_out = len(view.groups) - len(shown)
    return DrawnPage(figure, _caption(results, drawing, left_out))


class _Drawing:
    """Page layout with its contents."""

    def __init__(
        self,
        results: RunResults,
        view: View,
        at_s: float,
        width_in: float,
        detail: DetailLevel,
        groups: Sequence[GroupNode],
    ) -> None:
        self.view, self.at_s, self.groups = view._replace(groups=list(groups)), at_s, groups
        self.looks = Kit(results).looks
        self.end_s = run_records.end_s(results)
        self.roster = Roster(self.view, at_s, self.looks, width_in, detail.most_chips)
        self.width_in, self.detail = width_in, detail
        self.names_in = NAMES_IN if width_in >= WIDE_IN else NARROW_NAMES_IN
        self.rows = {group.name: list(_rows(self.view, group, detail)) for group in groups}
        self.bodies_in = [HEAD_IN + GAP_IN + sum(row.height_in for row in self.rows[group.name]) for group in groups]
        self.above_in = TITLE_IN + self.roster.height_in

    @property
    def height_in(self) -> float:
        """Height of roster and rows."""
        return self.above_in + sum(self.bodies_in)

    def drawn(self, results: RunResults) -> Figure:
        """Draw roster and bars."""
        legend = _legend(self.view, self.rows)
        body_in = sum(self.bodies_in) or 0.3
        names = (
            self._names() if any(self.rows.values()) else [Name(BESIDE_IN - self.names_in, 0.15, "no role was held")]
        )
        self.page: Sheet = sheet(results, names, body_in, legend, self.width_in, self.above_in, self.detail.has_key)
        for number, (group, top_in, high_in) in enumerate(self._bands()):
            if number % 2 == 0:
                self.page.band(top_in, high_in)
            head_in = top_in + (HEAD_IN + GAP_IN) / 2
            self._mark(group.name, "", head_in)
            if not group.is_founded:
                self._exists(group, head_in)
            for row, at_in in self._placed(group, top_in):
                self._row(row, at_in)
        self.page.axes.axvline(self.at_s, color=style.BLACK, linewidth=1.2, zorder=4)
        figure = self.page.finished()
        self._draw_roster()
        return figure

    def _bands(self) -> Iterator[tuple[GroupNode, float, float]]:
        """Yield each group with the top and height of its rows."""
        tops_in = [0.0, *accumulate(self.bodies_in)]
        yield from zip(self.groups, tops_in, self.bodies_in, strict=False)

    def _placed(self, group: GroupNode, top_in: float) -> Iterator[tuple[RoleRow, float]]:
        """Yield the rows of a group with their tops."""
        rows = self.rows[group.name]
        tops_in = accumulate((row.height_in for row in rows), initial=top_in + HEAD_IN + GAP_IN / 2)
        yield from zip(rows, tops_in, strict=False)

    def _names(self) -> list[Name]:
        names = []
        for group, top_in, _ in self._bands():
            title = style.fitted(group.name, self.names_in, style.TINY_PT, "bold")
            names.append(Name(BESIDE_IN - self.names_in, top_in + (HEAD_IN + GAP_IN) / 2, title, weight="bold"))
            for row, at_in in self._placed(group, top_in):
                label = style.fitted(row.name, self.names_in - 0.08, style.TINY_PT)
                names.append(Name(BESIDE_IN + 0.08 - self.names_in, at_in + row.height_in / 2, label))
        return names

    def _draw_roster(self) -> None:
        axes = self.page.above
        assert axes is not None
        room = axes.get_position()
        axes.set_position((0.0, room.y0, 1.0, room.height))  # beside it are no names
        axes.set(xlim=(0.0, self.width_in), ylim=(self.above_in, 0.0))
        seen = f"as {self.view.viewer} sees it" if self.view.viewer else "as every vehicle sees itself"
        title = f"Organisation at {words.time(self.at_s)}, {seen}"
        title = style.fitted(title, self.width_in - 2 * MARGIN_IN, style.TEXT_PT)
        axes.text(MARGIN_IN, TITLE_IN / 2, title, fontsize=style.TEXT_PT, va="center_baseline")
        self.roster.draw(axes, TITLE_IN)

    def _exists(self, group: GroupNode, middle_in: float) -> None:
        """Draw a line over the lifetime of a group formed at run time."""
        for span in self.view.exists[group.name]:
            times_s = [span.start_s, min(span.end_s, self.end_s)]
            self.page.axes.plot(times_s, [middle_in] * 2, color=style.BLACK, linewidth=1.2, zorder=5)

    def _row(self, row: RoleRow, top_in: float) -> None:
        for span in row.vacant:
            self.page.axes.broken_barh([self._along(span)], (top_in + 0.01, row.height_in - 0.02), **HATCH)
        if row.is_counted:
            self._count(row, top_in)
        for number, lane in enumerate([] if row.is_counted else row.lanes):
            for holding in lane:
                self._bar(holding, top_in + 0.01 + number * row.lane_in, row.lane_in)
        self._mark(row.group.name, row.role, top_in + row.height_in / 2)

    def _bar(self, holding: Holding, top_in: float, lane_in: float) -> None:
        """Draw a bar, pale during absence, labelled if the name fits."""
        colour = self.looks[holding.vehicle].colour if holding.vehicle in self.looks else style.GREY
        where_in = top_in + 0.008, lane_in - 0.016
        axes = self.page.axes
        for spans, strength in (([holding.span], PALE), (holding.present, 1.0)):
            bars = [self._along(span) for span in spans]
            axes.broken_barh(bars, where_in, facecolor=style.tint(colour, strength), linewidth=0, zorder=2)
        left_s, length_s = self._along(holding.span)
        inch_s = self.page.inch_s
        has_room = style.width_in(holding.vehicle, style.TINY_PT) <= length_s / inch_s - 0.08
        if has_room and lane_in >= LABELLED_IN:
            is_here = any(span.holds(left_s) for span in holding.present)
            axes.text(
                left_s + 0.04 * inch_s, top_in + lane_in / 2, holding.vehicle.replace("$", r"\$"),
                fontsize=style.TINY_PT, va="center_baseline", zorder=3,
                color=ink(colour) if is_here else style.BLACK,
            )  # fmt: skip

    def _along(self, span: Span) -> tuple[float, float]:
        """Return start and duration of a bar."""
        return span.start_s, min(span.end_s, self.end_s) - span.start_s

    def _count(self, row: RoleRow, top_in: float) -> None:
        """Draw the number of holders as a share of its maximum."""
        present = [holding.present for lane in row.lanes for holding in lane]
        for span, share in shares(present, len(row.lanes)):
            high_in = share * (COUNT_IN - 0.03)
            where_in = top_in + COUNT_IN - 0.01 - high_in, high_in
            self.page.axes.broken_barh([self._along(span)], where_in, facecolor=style.GREY, linewidth=0, zorder=2)

    def _mark(self, group: str, role: str, middle_in: float) -> None:
        for mark in self.view.marks:
            if (mark.group, mark.role) == (group, role):
                self.page.axes.plot([mark.time_s], [middle_in], **{**MARK, **MARKS[mark.kind][0]})


def _rows(view: View, group: GroupNode, detail: DetailLevel) -> Iterator[RoleRow]:
    """Yield a row for each role of a group that was ever held, required or marked."""
    vacancies = view.vacancies(group)
    marked = {mark.role for mark in view.marks if mark.group == group.name}
    for role in group.roles:
        lanes = _lanes(view.holdings.get((group.name, role.name), ()))
        if not (lanes or vacancies[role.name] or role.name in marked):
            continue
        lane_in = detail.lane_in if len(lanes) <= FEW else detail.crowded_in
        is_counted = len(lanes) > detail.most_lanes and len(lanes) * lane_in > COUNT_IN
        n_lanes = max(1, len(lanes), min(role.minimum, FEW) if vacancies[role.name] else 0)
        height_in = COUNT_IN if is_counted else n_lanes * lane_in
        counted = f" ({len(lanes)})" if is_counted else ""
        name = f"{HEAD if role.is_head else ''}{role.name}{counted}"
        height_in = max(height_in + 0.02, 0.11)
        yield RoleRow(group, name, role.name, lanes, vacancies[role.name], is_counted, lane_in, height_in)


def _lanes(holdings: Sequence[Holding]) -> list[list[Holding]]:
    """Assign holdings to lanes: reuse a free lane, preferably that of the same vehicle."""
    lanes: list[list[Holding]] = []
    for holding in holdings:
        free = [lane for lane in lanes if lane[-1].span.end_s <= holding.span.start_s]
        own = [lane for lane in free if lane[-1].vehicle == holding.vehicle]
        if free:
            (own or free)[0].append(holding)
        else:
            lanes.append([holding])
    return lanes


def _legend(view: View, rows: dict[str, list[RoleRow]]) -> list[Artist]:
    all_rows = [row for own in rows.values() for row in own]
    holdings = [holding for row in all_rows for lane in row.lanes for holding in lane]
    is_away = any(holding.present != (holding.span,) for holding in holdings)
    away = "taken for absent" if view.viewer else "out of the mission"
    marks = [kind for kind in MARKS if any(mark.kind == kind for mark in view.marks)]
    chips: list[Artist] = [Patch(facecolor=style.GREY, linewidth=0, label="holds the role (colour: vehicle)")]
    if is_away:
        chips.append(Patch(facecolor=style.tint(style.GREY, PALE), edgecolor=style.GREY, linewidth=0.5, label=away))
    if any(row.is_counted for row in all_rows):
        chips.append(Patch(facecolor=style.GREY, linewidth=0, label="height: share of the most holders"))
    if any(row.vacant for row in all_rows):
        chips.append(Patch(label="below minimum", **HATCH))
    ticks = {CREATED, DISSOLVED} & {*marks}
    if ticks:
        chips.append(Line2D([], [], label="group formed until dissolved", **{**MARK, **TICK, "linestyle": "-"}))
    return [
        *chips,
        *(Line2D([], [], label=MARKS[kind][1], **{**MARK, **MARKS[kind][0]}) for kind in marks if kind not in ticks),
    ]


def _caption(results: RunResults, drawing: _Drawing, left_out: int) -> str:
    view = drawing.view
    seen = f"in the view of {view.viewer}" if view.viewer else "as every vehicle sees itself"
    is_vacant = any(row.vacant for rows in drawing.rows.values() for row in rows)
    return captions.of_run(
        results,
        f"Organisation {seen}: above at {words.time(drawing.at_s)}, below over mission time, where a thick line is "
        "that time.",
        "Roles have the number of holders that they demand; a star: who plays the role leads the group. A group is "
        "indented below the one that supervises it.",
        f"Reserves hold no role: {words.listed([chip.text for chip in drawing.roster.reserves])}."
        if drawing.roster.reserves else "",
        "Hatched: fewer holders in the mission than the role demands." if is_vacant else "",
        f"{left_out} groups are left out." if left_out else "",
        _refused(view),
        is_timed=True,
    )  # fmt: skip


def _refused(view: View) -> str:
    n = sum(mark.kind == REFUSED for mark in view.marks)
    by = f"by {view.viewer}" if view.viewer else "by any vehicle"
    return f"Requests refused {by} are crossed at {n} {'place' if n == 1 else 'places'}." if n else ""
