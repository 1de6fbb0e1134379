"""Roles of every vehicle over mission time: held, and driving the vehicle (figure 7 of the REMORAS paper)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from missions.figure import RunResults
from visualisation import style
from visualisation.page import Picture
from visualisation.runs import captions, reading
from visualisation.runs.reading import Tenure, VehicleFault
from visualisation.runs.sheet import sheet

ROOMY_ROWS = 45
BAND_GAP_IN = 0.06
VEHICLE_ROOM_IN = 1.0
ROLE_ROOM_IN = 1.5
GROUP_ROOM_IN = 2.5
HELD, DRIVING = 0.3, 0.68
"""Share of a row that a bar fills."""
HATCHES = ("", "", "", "/////", ".....", "xxxxx")
PALETTE = (style.BLUE, style.ORANGE, style.BLACK, style.GREEN, style.VERMILLION, style.SKY_BLUE)


FAULT: dict[str, Any] = {
    "facecolor": "none", "edgecolor": style.tint(style.VERMILLION, 0.6), "hatch": "////", "linewidth": 0, "zorder": 1,
}  # fmt: skip
"""Look of a band while a fault holds."""


class GroupLook(NamedTuple):
    """How bars of one group are filled."""

    colour: str
    hatch: str


def picture(results: RunResults) -> Picture:
    """A band of rows per vehicle, a row per role; a thin bar while held, a solid one while it drives."""
    tenures = reading.tenures(results)
    n_rows = sum(max(1, len(own)) for own in tenures.values())
    row_in, size_pt = (0.15, style.SMALL_PT) if n_rows <= ROOMY_ROWS else (0.12, style.TINY_PT)
    names = {vehicle: style.fitted(vehicle, VEHICLE_ROOM_IN, size_pt, "bold") for vehicle in tenures}
    known = {tenure.role for own in tenures.values() for tenure in own}
    roles = {role: style.fitted(role, ROLE_ROOM_IN, size_pt) for role in known}
    names_in = max((style.width_in(name, size_pt, "bold") for name in names.values()), default=0.0)
    roles_in = max((style.width_in(role, size_pt) for role in roles.values()), default=0.3)
    left_in = 0.08 + names_in + 0.12 + roles_in + 0.06
    looks = _looks(tenures.values())
    faults = reading.vehicle_faults(results)
    with style.paper():
        body_in = n_rows * row_in + len(tenures) * BAND_GAP_IN
        page = sheet(results, left_in, body_in, _legend(looks, bool(faults)))
        top_in = 0.0
        for number, (vehicle, own) in enumerate(tenures.items()):
            band_in = max(1, len(own)) * row_in + BAND_GAP_IN
            for axes in page.panels if number % 2 == 0 else ():
                axes.axhspan(top_in, top_in + band_in, color=style.PALE, linewidth=0, zorder=0)
            _faults(page.panels, [one for one in faults if one.vehicle == vehicle], top_in, band_in)
            page.note(0.08, top_in + band_in / 2, names[vehicle], size_pt, weight="bold")
            for row, tenure in enumerate(own):
                middle_in = top_in + BAND_GAP_IN / 2 + (row + 0.5) * row_in
                page.note(left_in - 0.06, middle_in, roles[tenure.role], size_pt, horizontalalignment="right")
                for axes in page.panels:
                    _bars(axes, tenure, middle_in, row_in, looks[tenure.group])
            top_in += band_in
    return Picture(page.figure, captions.roles(results))


def _looks(bands: Iterable[list[Tenure]]) -> dict[str, GroupLook]:
    groups = dict.fromkeys(tenure.group for own in bands for tenure in own)
    return {
        group: GroupLook(PALETTE[number % len(PALETTE)], HATCHES[number % len(HATCHES)])
        for number, group in enumerate(groups)
    }


def _faults(panels: Iterable[Axes], faults: Iterable[VehicleFault], top_in: float, band_in: float) -> None:
    """Hatch the band of a vehicle while something has befallen it."""
    for fault in faults:
        length_s = fault.span.end_s - fault.span.start_s
        for axes in panels:
            axes.broken_barh([(fault.span.start_s, length_s)], (top_in, band_in), **FAULT)


def _legend(looks: dict[str, GroupLook], with_faults: bool) -> list[Artist]:
    meanings: list[Artist] = [
        Line2D([], [], color=style.tint(style.BLACK, 0.35), linewidth=2.0, label="role held"),
        Line2D([], [], color=style.GREY, linewidth=6.0, label="role drives the vehicle"),
    ]
    meanings += [Patch(label="fault", **FAULT)] if with_faults else []
    return meanings + [
        Patch(facecolor=look.colour, edgecolor="white", hatch=look.hatch, linewidth=0,
              label=style.fitted(f"group {group}", GROUP_ROOM_IN, style.SMALL_PT))
        for group, look in looks.items()
    ]  # fmt: skip


def _bars(axes: Axes, tenure: Tenure, middle_in: float, row_in: float, look: GroupLook) -> None:
    for spans, share, colour, hatch in (
        (tenure.held, HELD, style.tint(look.colour, 0.4), ""),
        (tenure.active, DRIVING, look.colour, look.hatch),
    ):
        boxes = [(span.start_s, span.end_s - span.start_s) for span in spans]
        where_in = middle_in - share * row_in / 2, share * row_in
        axes.broken_barh(boxes, where_in, facecolor=colour, edgecolor=colour, linewidth=0.4, zorder=2)
        if hatch:
            axes.broken_barh(boxes, where_in, facecolor="none", edgecolor="white", hatch=hatch, linewidth=0)
