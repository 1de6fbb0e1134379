"""Roster of an organisation at one time: groups in columns, each with its roles and their holders.

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

LINE_IN, CHIP_IN, GAP_IN = 0.155, 0.118, 0.06
"""Heights of a line and of a chip, and gap between groups."""
COLUMN_IN, INDENT_IN, MARGIN_IN = 2.3, 0.12, 0.08
"""Minimum width of a column; indent of roles, and of groups for each group above them; margin of the drawing."""
ROLE_SHARE = 0.55
"""Maximum share of a column for role names."""
HEAD = "\u2605 "
"""Prefix of roles that lead their group."""
VACANT: dict[str, Any] = {"facecolor": "none", "edgecolor": style.BLACK, "linestyle": (0, (2, 1.5)), "linewidth": 0.6}
LEAST_LIGHT = 0.45
"""Names on colours with a luminance (0 to 1) up to this are white."""


class Chip(NamedTuple):
    """Name of a holder: a vehicle with its colour, paler while absent, or a note as "2 vacant"."""

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


class GroupEntry(NamedTuple):
    """Group with its roles and a note of its supervisor; without a title the reserves."""

    title: str
    note: str
    indent_in: float
    roles: list[RoleLine]

    @property
    def height_in(self) -> float:
        """Height, with the gap below."""
        return LINE_IN * (bool(self.title) + sum(role.n_lines for role in self.roles)) + GAP_IN


class Roster:
    """Roster of an organisation at a time; supervised groups are indented below their supervisor.

    Args:
        width_in: of the drawing.
        most_chips: maximum per role; further holders become a count.
    """

    def __init__(
        self, view: View, at_s: float, looks: Mapping[str, VehicleLook], width_in: float, most_chips: int = 99
    ) -> None:
        self._view, self._at_s, self._looks, self._most = view, at_s, looks, most_chips
        groups = list(_by_supervision(view, at_s))
        busy = {holding.vehicle for own in view.holdings.values() for holding in own if holding.holds(at_s)}
        self.reserves = self._named([name for name in looks if name not in busy], set())
        n_entries = len(groups) + bool(self.reserves)
        n_columns = max(1, min(n_entries, int(width_in / COLUMN_IN)))
        self._column_in = (width_in - MARGIN_IN) / n_columns
        entries = [self._entry(group, INDENT_IN * depth) for group, depth in groups]
        if self.reserves:
            entries.append(
                GroupEntry("", "", 0.0, [self._line("reserves", self.reserves, 0.55, self._column_in - 0.1)])
            )
        self._columns = _columns(entries, n_columns)
        self.height_in = max((sum(entry.height_in for entry in column) for column in self._columns), default=0.0)

    def draw(self, axes: Axes, top_in: float) -> None:
        """Draw the roster on axes in inches, from ``top_in`` down."""
        for number, column in enumerate(self._columns):
            at_in = top_in
            for entry in column:
                left_in, down_in = MARGIN_IN + number * self._column_in + entry.indent_in, at_in
                if entry.title:
                    beside_in = left_in + style.width_in(entry.title, style.SMALL_PT, "bold")
                    middle_in = down_in + LINE_IN / 2
                    look: dict[str, Any] = {"va": "center_baseline"}
                    axes.text(beside_in, middle_in, entry.note, fontsize=style.TINY_PT, **look)
                    axes.text(left_in, middle_in, entry.title, fontsize=style.SMALL_PT, weight="bold", **look)
                    left_in, down_in = left_in + INDENT_IN, down_in + LINE_IN
                for role in entry.roles:
                    _draw_line(axes, role, left_in, down_in)
                    down_in += LINE_IN * role.n_lines
                at_in += entry.height_in

    def _entry(self, group: GroupNode, indent_in: float) -> GroupEntry:
        names = {role.name: f"{HEAD * role.is_head}{role.name} {role.cardinality}".rstrip() for role in group.roles}
        room_in = self._column_in - indent_in - 2 * INDENT_IN
        widest_in = max((style.width_in(name, style.TINY_PT) for name in names.values()), default=0.0)
        names_in = min(widest_in + 0.08, ROLE_SHARE * room_in)
        roles = [
            self._line(names[role.name], self._chips(group, role.name, role.minimum), names_in, room_in)
            for role in group.roles
        ]
        title = style.fitted(group.name, room_in, style.SMALL_PT, "bold")
        beside_in = room_in - style.width_in(title, style.SMALL_PT, "bold")
        note = style.fitted(f"  below {group.above}", beside_in, style.TINY_PT) if indent_in else ""
        return GroupEntry(title, note if len(note) > len("  below ") else "", indent_in, roles)

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


def _by_supervision(view: View, at_s: float) -> Iterator[tuple[GroupNode, int]]:
    """Yield the groups at a time, each with the number of groups above it, before those that it supervises."""
    groups = {
        group.name: group for group in view.groups
        if any(span.holds(at_s) for span in view.exists[group.name])
    }  # fmt: skip
    front = [(group, 0) for group in groups.values() if group.above not in groups][::-1]
    while front:
        group, depth = front.pop()
        yield group, depth
        front += [(below, depth + 1) for below in groups.values() if below.above == group.name][::-1]


def _columns(entries: Sequence[GroupEntry], n_columns: int) -> list[list[GroupEntry]]:
    """Split entries into columns of similar height."""
    most_in = sum(entry.height_in for entry in entries) / n_columns
    columns: list[list[GroupEntry]] = [[]]
    for entry in entries:
        deep_in = sum(other.height_in for other in columns[-1])
        if columns[-1] and deep_in + entry.height_in > 1.1 * most_in and len(columns) < n_columns:
            columns.append([])
        columns[-1].append(entry)
    return columns


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
