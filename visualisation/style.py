"""Common style of figures. Each series also has a line style and marker, for greyscale print."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from itertools import pairwise
from typing import Any, NamedTuple

import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from visualisation import colours
from visualisation.output import check_format

COLUMN_IN = 3.5  # width of a figure in one column of a paper
PAGE_IN = 7.2  # width of a figure over both columns

TEXT_PT = 8.0  # labels and titles
SMALL_PT = 7.0  # ticks, legends and notes
TINY_PT = 6.0  # smallest legible size

BLACK, BLUE, GREEN = colours.BLACK, colours.BLUE, colours.GREEN
YELLOW, VERMILLION = colours.YELLOW, colours.VERMILLION
GREY = "#666666"
PALE = "#EEEEEE"
COLOURS, VEHICLES = colours.COLOURS, colours.VEHICLES

LINES: tuple[Any, ...] = ("-", (0, (4, 1.2)), (0, (1.2, 1)), (0, (5, 1.2, 1.2, 1.2)))
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">")

DPI = 300
LEGEND_HANDLE_IN = 0.5  # width of a legend column beyond its widest label
_SETTINGS: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": TEXT_PT,
    "axes.titlesize": TEXT_PT,
    "axes.labelsize": TEXT_PT,
    "axes.labelpad": 2.0,
    "axes.titlelocation": "left",
    "axes.titlepad": 3.0,
    "figure.constrained_layout.h_pad": 0.05,
    "figure.constrained_layout.w_pad": 0.04,
    "figure.constrained_layout.hspace": 0.0,
    "figure.constrained_layout.wspace": 0.0,
    "xtick.labelsize": SMALL_PT,
    "ytick.labelsize": SMALL_PT,
    "legend.fontsize": SMALL_PT,
    "axes.linewidth": 0.6,
    "axes.axisbelow": True,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "lines.linewidth": 1.0,
    "lines.markersize": 3.5,
    "lines.solid_capstyle": "butt",
    "legend.frameon": False,
    "legend.borderpad": 0.0,
    "legend.borderaxespad": 0.45,
    "legend.handlelength": 2.6,
    "legend.handletextpad": 0.5,
    "legend.columnspacing": 1.2,
    "legend.labelspacing": 0.4,
    "hatch.linewidth": 0.5,
    # TrueType in PDF, since publishers refuse Type 3; outlines in SVG, which needs no font then; constant ids in SVG.
    "pdf.fonttype": 42,
    "svg.fonttype": "path",
    "svg.hashsalt": "remoras",
}

UNSAID: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
}
"""Metadata removed from files, since they differ between versions or days."""


class Look(NamedTuple):
    """Style of a series."""

    colour: str
    line: Any
    marker: str


def look(number: int) -> Look:
    """Return the style of series ``number`` from 0; the first 28 differ in colour and line style."""
    return Look(COLOURS[number % len(COLOURS)], LINES[number % len(LINES)], MARKERS[number % len(MARKERS)])


def vehicle_look(number: int) -> Look:
    """Return the style of vehicle ``number`` from 0, in all figures of a run; the first 32 differ."""
    # Each turn through the colours shifts the lines, so that vehicles of one colour differ.
    turn, place = divmod(number, len(VEHICLES))
    return Look(VEHICLES[place], LINES[(place + turn) % len(LINES)], MARKERS[number % len(MARKERS)])


def tint(colour: str, strength: float) -> tuple[float, float, float]:
    """Mix ``colour`` with white: strength 1 is the colour, 0 is white."""
    red, green, blue = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return tuple(round(1 - strength * (1 - part), 4) for part in (red, green, blue))  # type: ignore[return-value]


def width_in(text: str, size_pt: float, weight: str = "normal") -> float:
    """Return the width of a line of text in inches under ``paper()``."""
    font = FontProperties(family="DejaVu Sans", size=size_pt, weight=weight)
    width_pt: float = text_to_path.get_text_width_height_descent(text, font, ismath=False)[0]
    return width_pt / 72.0


def fitted(text: str, room_in: float, size_pt: float, weight: str = "normal", share: float = 1.0) -> str:
    """Shorten ``text`` to ``room_in`` inches with an ellipsis behind ``share`` of the rest; escape dollar signs.

    >>> fitted("Survey(line 1)", 0.5, 6.0), fitted("Survey(line 1)", 0.5, 6.0, share=1 / 3)
    ('Survey(li\u2026', 'Sur\u2026ine 1)')
    """
    shown, n = text, len(text)
    while len(shown) > 1 and width_in(shown, size_pt, weight) > room_in:
        n -= 1
        first = math.ceil(share * n)
        shown = text[:first].rstrip() + "\u2026" + text[len(text) - n + first :].lstrip()
    # Matplotlib takes text between dollar signs for a formula.
    return shown.replace("$", r"\$")


def wrapped(text: str, room_in: float, size_pt: float) -> str:
    """Break ``text`` at spaces into lines of at most ``room_in`` inches; longer words are shortened."""
    lines = [""]
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}".lstrip()
        if lines[-1] and width_in(longer, size_pt) > room_in:
            lines.append(word)
        else:
            lines[-1] = longer
    return "\n".join(fitted(line, room_in, size_pt) for line in lines)


def legend_columns(labels: Sequence[str], room_in: float) -> int:
    """Return the number of legend columns for ``room_in`` inches: fewest rows, then evenly filled.

    >>> legend_columns(["a", "b", "c", "d"], 7.0), legend_columns(["a", "b", "c", "d"], 2.0)
    (4, 2)
    """
    widths_in = [max(width_in(line, SMALL_PT) for line in label.split("\n")) + LEGEND_HANDLE_IN for label in labels]
    for n_columns in range(len(labels), 1, -1):
        n_rows, more = divmod(len(labels), n_columns)  # matplotlib gives the first columns one entry more
        ends = [n_rows * column + min(column, more) for column in range(n_columns + 1)]
        if sum(max(widths_in[first:last]) for first, last in pairwise(ends)) <= room_in:
            return -(-len(labels) // -(-len(labels) // n_columns))
    return 1


def paper() -> AbstractContextManager[None]:
    """Context of drawing settings, independent of the user's matplotlib settings."""
    return matplotlib.style.context(["default", _SETTINGS])  # type: ignore[no-any-return, unused-ignore]


def logarithmic(axes: Axes, along: str = "y", subs: Sequence[float] = (1.0, 2.0, 5.0)) -> None:
    """Set a log axis with plain numbers at ``subs`` of each decade, if any point is positive."""
    axis: Axis = getattr(axes, f"{along}axis")
    if not math.isfinite(axes.dataLim.minposx if along == "x" else axes.dataLim.minposy):
        return
    axes.set(**{f"{along}scale": "log"})
    axis.set_major_locator(LogLocator(subs=subs))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def rendered(figure: Figure, format: str, about: Mapping[str, str] | None = None) -> bytes:
    """Render a figure in true size, reproducibly byte by byte; ``about`` is its provenance."""
    file = io.BytesIO()
    with paper():
        figure.savefig(
            file, format=format, dpi=DPI, metadata={**UNSAID[format], **provenance_fields(format, about or {})}
        )
    return file.getvalue()


def contents(name: str, format: str, figure: Figure, caption: str, csv: bytes) -> list[tuple[str, bytes]]:
    """Return names and contents of the files of a figure: picture, caption and data; DrawingError for its format."""
    check_format(format)
    return [
        (f"{name}.{format}", rendered(figure, format)),
        (f"{name}.txt", f"{caption}\n".encode()),
        (f"{name}.csv", csv),
    ]


def provenance_fields(format: str, about: Mapping[str, str]) -> dict[str, str]:
    """Map provenance to the metadata fields of a format: PNG text, SVG Dublin Core or PDF info.

    >>> provenance_fields("svg", {"seed": "3", "run": "a1"})
    {'Description': 'seed 3; run a1'}
    """
    line = "; ".join(f"{name} {text}" for name, text in about.items())
    if not about:
        return {}
    if format == "png":
        return {**about, "Description": line}
    return {"Description": line} if format == "svg" else {"Subject": line}
