"""Figures of the policy study, their data as CSV, and captions.

Unloaded exchange (one item, no competing traffic): times relative to ACK on the left, as in the paper, absolute times
on the right. Colour shows the acknowledgement; line style and marker fill show repeats.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MultipleLocator

from exchange.study.parameters import BOUND
from exchange.study.study import KINDS, StudyRow, TrialMean
from missions import words
from missions.words import REPEAT
from visualisation import output, page, style
from visualisation.output import DrawingError, unknown

BODY_IN, LOADED_BODY_IN = 2.3, 1.75
LEGEND_COLUMNS = 3

REPEATING = (0, (4, 1.2))
OF_THE_BOUND = (0, (1, 1.5))


class Unloaded(NamedTuple):
    """Time of one item without competing traffic: row fields of both panels, and its end event."""

    relative: str
    absolute: str
    until: str


UNLOADED = {
    "delivered": Unloaded("relative_delivered", "delivered_slots", "all nodes hold the item"),
    "source": Unloaded("relative_source", "source_acked_slots", "the source knows that all nodes hold the item"),
    "senders": Unloaded("relative_senders", "senders_acked_slots", "all senders know that all nodes hold the item"),
}

LOADED = (
    ("delivered_slots", words.axis("delivery latency", "slots")),
    ("source_acked_slots", words.axis("acknowledgement latency", "slots")),
    ("items_in_flight", "items in flight"),
    ("goodput_items_per_slot", words.axis("goodput", "items per slot")),
)


def contents(rows: Sequence[StudyRow], kind: str, name: str, format: str) -> list[tuple[str, bytes]]:
    """Return names and contents of figure, caption and CSV of a study; DrawingError for an unknown kind, or no rows.

    ``kind`` is `delivered`, `source`, `senders` or `loaded`, with studies that differ in their rate only.
    """
    if kind not in (*UNLOADED, "loaded"):
        raise unknown("kind of figure", kind, (*UNLOADED, "loaded"))
    if not rows:
        raise DrawingError("a figure needs rows of a study, and there are none")
    drawn = loaded_figure(rows) if kind == "loaded" else unloaded_figure(rows, kind)
    return style.contents(name, format, drawn, caption(rows, kind), as_csv(rows))


def unloaded_figure(rows: Sequence[StudyRow], kind: str) -> Figure:
    """Draw times relative to ACK, and in slots, over packet error rate, with intervals."""
    shown = UNLOADED[kind]
    with style.paper():
        drawn, (left, right) = _panels(rows, 1, BODY_IN)
        for axes, field in ((left, shown.relative), (right, shown.absolute)):
            _series(axes, rows, lambda row: row.per, field)
            axes.set_xlabel("packet error rate")
            axes.set_xlim(0.0, max(0.8, *(row.per for row in rows)) + 0.02)
            axes.xaxis.set_major_locator(MultipleLocator(0.2))
        left.set_ylim(bottom=0.0)
        left.set_ylabel("time relative to ACK")
        right.set_ylabel(words.axis("time", "slots"))
        style.logarithmic(right)
        page.lay_out(drawn, [left], BODY_IN)
    return drawn


def loaded_figure(rows: Sequence[StudyRow]) -> Figure:
    """Draw latencies, items in flight and goodput over offered load."""
    with style.paper():
        drawn, panels = _panels(rows, 2, LOADED_BODY_IN)
        for axes, (field, label) in zip(panels, LOADED, strict=True):
            _series(axes, rows, _offered, field)
            axes.set_ylabel(label)
            axes.set_xlim(0.0, 1.03 * max(_offered(row) for row in rows))
            if field.endswith("slots"):
                style.logarithmic(axes)
            else:
                axes.set_ylim(bottom=0.0)
        goodput = panels[3]
        top = goodput.get_ylim()[1]
        goodput.plot([0, top], [0, top], color=style.GREY, linewidth=0.6, linestyle=(0, (1, 1.5)), zorder=1)
        goodput.set_ylim(top=top)
        goodput.text(0.80 * top, 0.84 * top, "all offered items", color=style.GREY, fontsize=style.TINY_PT, ha="right")
        for axes in panels[2:]:
            axes.set_xlabel(words.axis("offered load", "items per slot"))
        page.lay_out(drawn, panels[::2], LOADED_BODY_IN)
    return drawn


def caption(rows: Sequence[StudyRow], kind: str) -> str:
    """Return the caption: content, conditions, trials and seed."""
    first = rows[0]
    evidence = "counts" if first.carrier_evidence else "does not count"
    trials = f"n = {first.trials} trials per point, seed {first.seed}; bands: 95 % confidence intervals of the means"
    carrying = f"sending an item {evidence} as evidence of holding it"
    censored = sum(row.censored_senders for row in rows)
    note = f" Censored trials, not in the means: {censored}." if censored else ""
    if any(row.policy == BOUND.name for row in rows):
        note += " Dotted, the bound: receivers take all items they lack from the sender, and knowledge is free."
    if kind == "loaded":
        return (
            f"Loaded exchange: N = {first.nodes} nodes, packet error rate {first.per:g}, items of {first.item_bits} "
            f"bits generated at every node (Poisson), packets of {first.capacity_bits} bits, headers charged. "
            f"Latencies from an item's generation to its delivery to all nodes, and to the knowledge of its source. "
            f"A node keeps a bounded queue of own items and refuses more. {trials}; {carrying}.{note}"
        )
    return (
        f"Mean time until {UNLOADED[kind].until}; left: relative to ACK in the same trials, right: in slots. "
        f"N = {first.nodes} nodes, load {first.load}; {trials}; {carrying}.{note}"
    )


def as_csv(rows: Sequence[StudyRow]) -> bytes:
    """Encode rows as CSV: three columns per estimate, without machine-dependent fields."""
    table = [_flat(row) for row in rows]
    return output.as_csv(table[0], (line.values() for line in table))


def _flat(row: StudyRow) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name in StudyRow.__dataclass_fields__:
        value = getattr(row, name)
        if name in ESTIMATES:
            for part in ("mean", "ci95_low", "ci95_high"):
                flat[f"{name}_{part}"] = None if value is None else getattr(value, part)
        elif name != "cpu_s":
            flat[name] = value
    return flat


ESTIMATES = frozenset(name for name, field in StudyRow.__dataclass_fields__.items() if "TrialMean" in str(field.type))


def _offered(row: StudyRow) -> float:
    if row.offered_items_per_slot is None:
        raise DrawingError(f"load {row.load} has no offered load: the loaded figure needs rows of Poisson load")
    return row.offered_items_per_slot.mean


def _series(axes: Axes, rows: Sequence[StudyRow], x_of: Any, field: str) -> None:
    for policy, look in _looks(rows).items():
        points: list[tuple[float, TrialMean]] = sorted(
            (x_of(row), getattr(row, field)) for row in rows if row.policy == policy and getattr(row, field) is not None
        )
        xs = [x for x, _ in points]
        # A single trial has no interval.
        low = [estimate.mean if estimate.ci95_low is None else estimate.ci95_low for _, estimate in points]
        high = [estimate.mean if estimate.ci95_high is None else estimate.ci95_high for _, estimate in points]
        axes.fill_between(xs, low, high, color=look["color"], alpha=0.2, linewidth=0)
        axes.plot(xs, [estimate.mean for _, estimate in points], **look)


def _looks(rows: Sequence[StudyRow]) -> dict[str, dict[str, Any]]:
    policies = dict.fromkeys(row.policy for row in rows)
    kinds = list(dict.fromkeys([*KINDS, *(policy.removesuffix(REPEAT) for policy in policies)]))
    looks: dict[str, dict[str, Any]] = {}
    for policy in policies:
        if policy == BOUND.name:
            looks[policy] = {"color": style.GREY, "linestyle": OF_THE_BOUND, "label": "bound"}
            continue
        colour, _, marker = style.look(kinds.index(policy.removesuffix(REPEAT)))
        repeats = policy.endswith(REPEAT)
        looks[policy] = {
            "color": colour, "marker": marker, "linestyle": REPEATING if repeats else "-", "markeredgewidth": 0.8,
            "markerfacecolor": "white" if repeats else colour, "label": policy,
        }  # fmt: skip
    return looks


def _panels(rows: Sequence[StudyRow], n_rows: int, body_in: float) -> tuple[Figure, list[Axes]]:
    figure = page.opened(style.PAGE_IN, n_rows * body_in)
    page.legend(figure, [Line2D([], [], **look) for look in _looks(rows).values()], ncols=LEGEND_COLUMNS)
    return figure, page.panels(figure, 2 * n_rows, 2, [""] * 2 * n_rows)
