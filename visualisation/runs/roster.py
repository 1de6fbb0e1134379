"""Roster of an organisation at one time: groups in columns, each with its roles and their holders.

All lengths are in inches, y down from the top of the drawing.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
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
MOST_CHIPS = 12
"""Maximum number of names in a role."""
HEAD = "\u2605 "
"""Prefix of roles that lead their group."""
VACANT: dict[str, Any] = {"facecolor": "none", "edgecolor": style.BLACK, "linestyle": (0, (2, 1.5)), "linewidth": 0.6}
COUNT: dict[str, Any] = {"facecolor": "none", "edgecolor": style.GREY, "linewidth": 0.6}
LEAST_LIGHT = 0.45
"""Names on colours with a luminance (0 to 1) up to this are white."""


class Chip(NamedTuple):
    """Name of a holder, or a note as "2 vacant", in a box."""

    text: str
    look: Mapping[str, Any]
    ink: str = style.BLACK

    @property
    def width_in(self) -> float:
        """Width of the box."""
        return style.width_in(self.text, style.TINY_PT) + 0.07


class Line(NamedTuple):
    """Title of a group with a note, or a role with its chips and the distance from its left end and row of each."""

    left_in: float
    name: str
    chips: Sequence[tuple[Chip, float, int]] = ()
    note: str | None = None

    @property
    def height_in(self) -> float:
        """Height of all rows."""
        return LINE_IN * (1 + max((row for *_, row in self.chips), default=0))


class Roster:
    """Roster of an organisation at a time; supervised groups are indented below their supervisor.

    ``width_in`` is that of the drawing.
    """

    def __init__(self, view: View, at_s: float, looks: Mapping[str, VehicleLook], width_in: float) -> None:
        self._view, self._at_s, self._looks = view, at_s, looks
        groups = list(_by_supervision(view, at_s))
        busy = {holding.vehicle for own in view.holdings.values() for holding in own if holding.holds(at_s)}
        self.reserves = [name for name in looks if name not in busy]
        n_columns = max(1, min(len(groups) + bool(self.reserves), int(width_in / COLUMN_IN)))
        self._column_in = (width_in - MARGIN_IN) / n_columns
        entries = [list(self._entry(group, INDENT_IN * depth)) for group, depth in groups]
        if self.reserves:
            entries.append([self._line(0.0, "reserves", self._named(self.reserves), 0.55)])
        self._columns = _columns(entries, n_columns)
        self.height_in = max(map(_height_in, self._columns), default=0.0)

    def draw(self, axes: Axes, top_in: float) -> None:
        """Draw the roster on axes in inches, from ``top_in`` down."""
        for number, column in enumerate(self._columns):
            at_in = top_in
            for entry in column:
                for line in entry:
                    _draw_line(axes, line, MARGIN_IN + number * self._column_in, at_in)
                    at_in += line.height_in
                at_in += GAP_IN

    def _entry(self, group: GroupNode, indent_in: float) -> Iterator[Line]:
        room_in = self._column_in - indent_in - 2 * INDENT_IN
        title = style.fitted(group.name, room_in, style.SMALL_PT, "bold")
        beside_in = room_in - style.width_in(title, style.SMALL_PT, "bold")
        note = style.fitted(f"  below {group.above}", beside_in, style.TINY_PT) if indent_in else ""
        yield Line(indent_in, title, (), note if len(note) > len("  below ") else "")
        names = {role.name: f"{HEAD * role.is_head}{role.name} {role.cardinality}".rstrip() for role in group.roles}
        widest_in = max((style.width_in(name, style.TINY_PT) for name in names.values()), default=0.0)
        names_in = min(widest_in + 0.08, ROLE_SHARE * room_in)
        for role in group.roles:
            chips = self._chips(group, role.name, role.minimum)
            yield self._line(indent_in + INDENT_IN, names[role.name], chips, names_in)

    def _chips(self, group: GroupNode, role: str, minimum: int) -> list[Chip]:
        holders = [holding for holding in self._view.holdings.get((group.name, role), ()) if holding.holds(self._at_s)]
        present = {holder.vehicle for holder in holders if holder.is_present(self._at_s)}
        held = dict.fromkeys(holder.vehicle for holder in holders)
        names = [*(name for name in held if name not in self._looks), *(name for name in self._looks if name in held)]
        chips, lacking = self._named(names, held.keys() - present), minimum - len(present)
        return chips + ([Chip("vacant" if lacking == 1 else f"{lacking} vacant", VACANT)] if lacking > 0 else [])

    def _named(self, names: Sequence[str], away: Container[str] = ()) -> list[Chip]:
        """Return a chip for each vehicle, paler while absent; the last one counts those without room."""
        shown = names if len(names) <= MOST_CHIPS else names[: MOST_CHIPS - 1]
        chips = []
        for name in shown:
            colour = self._looks[name].colour if name in self._looks else style.GREY
            pale = {"facecolor": style.tint(colour, 0.25), "edgecolor": colour, "linewidth": 0.6}
            full = {"facecolor": colour, "edgecolor": "none"}
            chips.append(Chip(name, pale) if name in away else Chip(name, full, ink(colour)))
        return chips + ([Chip(f"+{len(names) - len(shown)}", COUNT)] if len(shown) < len(names) else [])

    def _line(self, left_in: float, name: str, chips: Sequence[Chip], names_in: float) -> Line:
        """Place chips behind a name, in as many rows as they need."""
        room_in = self._column_in - left_in - INDENT_IN
        placed: list[tuple[Chip, float, int]] = []
        at_in, row = names_in, 0
        for chip in chips:
            shown = chip._replace(text=style.fitted(chip.text, room_in - names_in - 0.07, style.TINY_PT))
            if placed and at_in + shown.width_in > room_in:
                at_in, row = names_in, row + 1
            placed.append((shown, at_in, row))
            at_in += shown.width_in + 0.03
        return Line(left_in, style.fitted(name, names_in - 0.05, style.TINY_PT), placed)


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


def _height_in(entries: Sequence[Sequence[Line]]) -> float:
    return sum(line.height_in for entry in entries for line in entry) + GAP_IN * len(entries)


def _columns(entries: Sequence[Sequence[Line]], n_columns: int) -> list[list[Sequence[Line]]]:
    """Split entries into columns of similar height."""
    most_in = 1.1 * _height_in(entries) / n_columns
    columns: list[list[Sequence[Line]]] = [[]]
    for entry in entries:
        if columns[-1] and _height_in([*columns[-1], entry]) > most_in and len(columns) < n_columns:
            columns.append([])
        columns[-1].append(entry)
    return columns


def _draw_line(axes: Axes, line: Line, column_in: float, top_in: float) -> None:
    left_in, middle_in = column_in + line.left_in, top_in + LINE_IN / 2
    tiny: dict[str, Any] = {"fontsize": style.TINY_PT, "va": "center_baseline"}
    if line.note is None:
        axes.text(left_in, middle_in, line.name, **tiny, zorder=3)
    else:
        axes.text(left_in + style.width_in(line.name, style.SMALL_PT, "bold"), middle_in, line.note, **tiny)
        axes.text(left_in, middle_in, line.name, **{**tiny, "fontsize": style.SMALL_PT}, weight="bold")
    for chip, at_in, row in line.chips:
        corner = left_in + at_in, top_in + row * LINE_IN + (LINE_IN - CHIP_IN) / 2
        axes.add_patch(Rectangle(corner, chip.width_in, CHIP_IN, zorder=3, **chip.look))
        middle = corner[0] + chip.width_in / 2, corner[1] + CHIP_IN / 2
        axes.text(*middle, chip.text, **tiny, ha="center", color=chip.ink, zorder=4)


def ink(colour: str) -> str:
    """Return black or white, whichever is legible on a colour."""
    red, green, blue = to_rgb(colour)
    return style.BLACK if 0.299 * red + 0.587 * green + 0.114 * blue > LEAST_LIGHT else "white"
