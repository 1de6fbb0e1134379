"""Box chart of an organisation at one time: groups with roles, below their supervisors.

All lengths are in inches, y down from the top of the drawing.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patches import Rectangle

from missions.figure import VehicleLook
from missions.graphs import GroupNode
from visualisation import style
from visualisation.runs.views import View

LINE_IN, CHIP_IN, TITLE_IN = 0.155, 0.118, 0.19
"""Heights of a line of a box, of a chip, and of the title bar of a box."""
PAD_IN, GAP_IN, DROP_IN, INDENT_IN = 0.06, 0.1, 0.13, 0.16
"""Padding within a box; gaps between boxes, across and down; indent of supervised groups."""
LEAST_IN = 2.0
"""Minimum width of a box among several in a row, and of a column of roles in a box."""
FEW = 3
"""Maximum number of roles that always form a single column."""
ROLE_SHARE = 0.5
"""Maximum share of a column for role names."""
MARGIN_IN = 0.08
HEAD = "\u2605 "
"""Prefix of roles that lead their group."""
LINE: dict[str, Any] = {"color": style.GREY, "linewidth": 0.8, "zorder": 1}
VACANT: dict[str, Any] = {"facecolor": "none", "edgecolor": style.BLACK, "linestyle": (0, (2, 1.5)), "linewidth": 0.6}
LEAST_LIGHT = 0.45
"""Names on colours with a luminance (0 to 1) up to this are white."""


class Chip(NamedTuple):
    """Name in a box: a vehicle with its colour, paler while absent, or a note as "2 vacant"."""

    text: str
    colour: str = ""
    is_away: bool = False
    is_vacant: bool = False

    @property
    def width_in(self) -> float:
        """Width of the chip, padding included."""
        return style.width_in(self.text, style.TINY_PT) + 0.07


class RoleLine(NamedTuple):
    """Role with its chips; each has its distance from the left edge and the index of its line."""

    name: str
    chips: list[tuple[Chip, float, int]]

    @property
    def n_lines(self) -> int:
        """Number of lines of the role."""
        return 1 + max((line for *_, line in self.chips), default=0)


class BoxTree(NamedTuple):
    """Laid-out box of a group: roles in columns, and the boxes of supervised groups."""

    title: str
    columns: list[list[RoleLine]]
    below: list[tuple[float, float, BoxTree]]
    """Supervised boxes, with offsets to the right and down from the top left corner of this one."""
    width_in: float
    box_in: float
    height_in: float

    @property
    def column_in(self) -> float:
        """Distance between columns of roles."""
        return (self.width_in - PAD_IN) / max(1, len(self.columns))


class BoxChart:
    """Box chart of an organisation at a time.

    Args:
        width_in: of the drawing.
        most_chips: maximum per role; further holders become a count.
    """

    def __init__(
        self, view: View, at_s: float, looks: Mapping[str, VehicleLook], width_in: float, most_chips: int = 99
    ) -> None:
        self._view, self._at_s, self._looks, self._most = view, at_s, looks, most_chips
        there = {
            group.name for group in view.groups
            if any(span.start_s <= at_s < span.end_s for span in view.exists[group.name])
        }  # fmt: skip
        groups = [group for group in view.groups if group.name in there]
        tops = [group for group in groups if group.above not in there]
        below: dict[str, list[GroupNode]] = {}
        for group in groups:
            below.setdefault(group.above, []).append(group)
        room_in = width_in - 2 * MARGIN_IN
        self._blocks, down_in = self._side_by_side(tops, below, room_in, frozenset())
        self.reserves = self._reserve()
        self._reserve_line = self._line("reserves", self.reserves, 0.55, room_in)
        self._reserve_in = down_in + (DROP_IN if self._blocks else 0.0)
        n_lines = self._reserve_line.n_lines if self.reserves else 0
        self.height_in = self._reserve_in + n_lines * LINE_IN if n_lines else down_in

    def draw(self, axes: Axes, top_in: float) -> None:
        """Draw the boxes on axes in inches, from ``top_in`` down."""
        for left_in, down_in, block in self._blocks:
            _draw(axes, block, MARGIN_IN + left_in, top_in + down_in)
        if self.reserves:
            _draw_line(axes, self._reserve_line, MARGIN_IN, top_in + self._reserve_in)

    def _side_by_side(
        self, groups: Sequence[GroupNode], below: Mapping[str, list[GroupNode]], room_in: float, seen: frozenset[str]
    ) -> tuple[list[tuple[float, float, BoxTree]], float]:
        """Lay out groups in rows, as many per row as fit; return the blocks and their total height."""
        if not groups:
            return [], 0.0
        columns = max(1, min(len(groups), int((room_in + GAP_IN) / (LEAST_IN + GAP_IN))))
        width_in = (room_in - (columns - 1) * GAP_IN) / columns
        placed: list[tuple[float, float, BoxTree]] = []
        down_in = 0.0
        for first in range(0, len(groups), columns):
            row = [self._block(group, below, width_in, seen) for group in groups[first : first + columns]]
            down_in += DROP_IN if first else 0.0
            placed += [(at * (width_in + GAP_IN), down_in, block) for at, block in enumerate(row)]
            down_in += max(block.height_in for block in row)
        return placed, down_in

    def _block(
        self, group: GroupNode, below: Mapping[str, list[GroupNode]], width_in: float, seen: frozenset[str]
    ) -> BoxTree:
        seen = seen | {group.name}
        names = {role.name: f"{HEAD * role.is_head}{role.name} {role.cardinality}".rstrip() for role in group.roles}
        widest_in = max((style.width_in(name, style.TINY_PT) for name in names.values()), default=0.0)
        n_columns = 1 if len(names) <= FEW else max(1, min(int(width_in / LEAST_IN), 3))
        column_in = (width_in - PAD_IN) / n_columns
        names_in = min(widest_in + 0.08, ROLE_SHARE * column_in)
        lines = [
            self._line(names[role.name], self._chips(group, role.name, role.minimum), names_in, column_in - PAD_IN)
            for role in group.roles
        ]
        columns = _columns(lines, n_columns)
        deepest = max((sum(line.n_lines for line in column) for column in columns), default=0)
        box_in = TITLE_IN + LINE_IN * deepest + (PAD_IN / 2 if lines else 0.0)
        supervised = [node for node in below.get(group.name, ()) if node.name not in seen]
        blocks, deep_in = self._side_by_side(supervised, below, width_in - INDENT_IN, seen)
        under = [(INDENT_IN + left_in, box_in + DROP_IN + down_in, block) for left_in, down_in, block in blocks]
        title = style.fitted(group.name, width_in - 2 * PAD_IN, style.SMALL_PT, "bold")
        return BoxTree(title, columns, under, width_in, box_in, box_in + (DROP_IN + deep_in if under else 0.0))

    def _chips(self, group: GroupNode, role: str, minimum: int) -> list[Chip]:
        holders = [holding for holding in self._view.holdings.get((group.name, role), ()) if holding.holds(self._at_s)]
        present = {holder.vehicle for holder in holders if holder.is_present(self._at_s)}
        order = list(self._looks)
        names = sorted(
            dict.fromkeys(holder.vehicle for holder in holders),
            key=lambda name: order.index(name) if name in order else -1,
        )
        chips = self._named(names, set(names) - present)
        lacking = minimum - len(present)
        return chips + (
            [Chip("vacant" if lacking == 1 else f"{lacking} vacant", is_vacant=True)] if lacking > 0 else []
        )

    def _reserve(self) -> list[Chip]:
        busy = {holding.vehicle for own in self._view.holdings.values() for holding in own if holding.holds(self._at_s)}
        return self._named([name for name in self._looks if name not in busy], set())

    def _named(self, names: Sequence[str], away: Iterable[str]) -> list[Chip]:
        shown = names if len(names) <= self._most else names[: self._most - 1]
        looks = self._looks
        chips = [Chip(name, looks[name].colour if name in looks else style.GREY, name in away) for name in shown]
        return chips + ([Chip(f"+{len(names) - len(shown)}")] if len(shown) < len(names) else [])

    @staticmethod
    def _line(name: str, chips: Sequence[Chip], names_in: float, room_in: float) -> RoleLine:
        placed: list[tuple[Chip, float, int]] = []
        at_in, line = names_in, 0
        for chip in chips:
            most_in = room_in - names_in - 0.07
            shown = chip._replace(text=style.fitted(chip.text, most_in, style.TINY_PT))
            if placed and at_in + shown.width_in > room_in:
                at_in, line = names_in, line + 1
            placed.append((shown, at_in, line))
            at_in += shown.width_in + 0.03
        return RoleLine(style.fitted(name, names_in - 0.05, style.TINY_PT), placed)


def _columns(lines: Sequence[RoleLine], n_columns: int) -> list[list[RoleLine]]:
    """Split lines into columns of similar height."""
    most = -(-sum(line.n_lines for line in lines) // n_columns)
    columns: list[list[RoleLine]] = [[]]
    for line in lines:
        deep = sum(column.n_lines for column in columns[-1])
        if columns[-1] and deep + line.n_lines > most and len(columns) < n_columns:
            columns.append([])
        columns[-1].append(line)
    return columns


def _draw(axes: Axes, block: BoxTree, left_in: float, top_in: float) -> None:
    axes.add_patch(
        Rectangle((left_in, top_in), block.width_in, block.box_in, facecolor="white", edgecolor=style.BLACK,
                  linewidth=0.7, zorder=2)
    )  # fmt: skip
    axes.add_patch(
        Rectangle(
            (left_in, top_in), block.width_in, TITLE_IN - 0.03, facecolor=style.PALE, edgecolor="none", zorder=2.1
        )
    )
    middle_in = top_in + (TITLE_IN - 0.03) / 2
    axes.text(left_in + PAD_IN, middle_in, block.title, fontsize=style.SMALL_PT, weight="bold", va="center_baseline")
    for at, column in enumerate(block.columns):
        down_in = top_in + TITLE_IN
        for line in column:
            _draw_line(axes, line, left_in + PAD_IN + at * block.column_in, down_in)
            down_in += LINE_IN * line.n_lines
    for x_in, y_in in _elbows(block):
        axes.plot([left_in + x for x in x_in], [top_in + y for y in y_in], **LINE)
    for right_in, down_in, under in block.below:
        _draw(axes, under, left_in + right_in, top_in + down_in)


def _elbows(block: BoxTree) -> Iterator[tuple[tuple[float, ...], tuple[float, ...]]]:
    """Yield supervision lines: down the left edge, across above each row, into each title."""
    trunk_in = INDENT_IN / 2
    for x_in, y_in, under in block.below:
        into_in, bus_in = x_in + min(0.3, under.width_in / 2), y_in - DROP_IN / 2
        yield (trunk_in, trunk_in, into_in, into_in), (block.box_in, bus_in, bus_in, y_in)


def _draw_line(axes: Axes, line: RoleLine, left_in: float, top_in: float) -> None:
    axes.text(left_in, top_in + LINE_IN / 2, line.name, fontsize=style.TINY_PT, va="center_baseline", zorder=3)
    for chip, at_in, number in line.chips:
        corner = left_in + at_in, top_in + number * LINE_IN + (LINE_IN - CHIP_IN) / 2
        axes.add_patch(Rectangle(corner, chip.width_in, CHIP_IN, zorder=3, **_look(chip)))
        axes.text(
            corner[0] + chip.width_in / 2, corner[1] + CHIP_IN / 2, chip.text, fontsize=style.TINY_PT, ha="center",
            va="center_baseline", color=ink(chip.colour) if chip.colour and not chip.is_away else style.BLACK, zorder=4,
        )  # fmt: skip


def _look(chip: Chip) -> dict[str, Any]:
    if chip.is_vacant:
        return VACANT
    if not chip.colour:
        return {"facecolor": "none", "edgecolor": style.GREY, "linewidth": 0.6}
    if chip.is_away:
        return {"facecolor": style.tint(chip.colour, 0.25), "edgecolor": chip.colour, "linewidth": 0.6}
    return {"facecolor": chip.colour, "edgecolor": "none"}


def ink(colour: str) -> str:
    """Return black or white, whichever is legible on a colour."""
    red, green, blue = to_rgb(colour)
    return style.BLACK if 0.299 * red + 0.587 * green + 0.114 * blue > LEAST_LIGHT else "white"
