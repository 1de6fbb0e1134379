"""Main effects of a study's factors: a row per factor, a panel per condition.

Whiskers are 95 % intervals.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from missions.comparison.effects import ALL, MainEffect
from missions.metric import Metric
from visualisation import page, style, words

ROW_IN, LABEL_IN = 0.34, 1.8
COLUMNS = 2
RATE = re.compile(r" per (?=[\d.]+$)")


def short_label(term: str) -> str:
    """Return the last part of a factor's key."""
    return term.rpartition(".")[2]


def titles(conditions: Sequence[str]) -> list[str]:
    """Return the parts of conditions that not all share, with loss rates as in captions.

    >>> titles(["all", "patches, bernoulli per 0.4", "patches, bernoulli per 0.8"])
    ['all', 'bernoulli, PER 0.4', 'bernoulli, PER 0.8']
    """
    parts = [condition.split(", ") for condition in conditions if condition != ALL]
    shared = set(parts[0]).intersection(*parts[1:]) if parts else set()
    return [
        ", ".join(RATE.sub(", PER ", part) for part in condition.split(", ") if part not in shared)
        for condition in conditions
    ]


def effects_figure(rows: Sequence[MainEffect], metric: Metric, width_in: float | None = None) -> Figure:
    """Draw main effects on one metric, the first factor on top.

    Args:
        rows: effects under all conditions.
        width_in: None for a page of a paper.
    """
    conditions = list(dict.fromkeys(row.condition for row in rows))
    main = [row for row in rows if row.is_main]
    levels = {row.term: f"{row.low} to {row.high}" for row in main}
    page_in = style.PAGE_IN if width_in is None else width_in
    columns = min(COLUMNS if page_in > style.COLUMN_IN else 1, len(conditions))
    body_in = ROW_IN * len(levels) + 0.1
    ends = [end for row in main for end in (row.effect, row.ci95_low, row.ci95_high, 0.0) if end is not None]
    spare = 0.06 * ((max(ends) - min(ends)) or 1.0)
    with style.paper():
        figure = page.opened(page_in, len(conditions) * body_in)
        panels = page.panels(figure, len(conditions), columns, titles(conditions) if len(conditions) > 1 else ())
        for number, (axes, condition) in enumerate(zip(panels, conditions, strict=True)):
            axes.axvline(0.0, color=style.GREY, linewidth=0.6, zorder=1)
            for row in (row for row in main if row.condition == condition):
                place = list(levels).index(row.term)
                if row.ci95_low is not None and row.ci95_high is not None:
                    axes.plot([row.ci95_low, row.ci95_high], [place, place], color=style.BLUE, linewidth=1.2, zorder=2)
                axes.plot([row.effect], [place], marker="o", color=style.BLUE, linestyle="none", zorder=3)
            axes.set_xlim(min(ends) - spare, max(ends) + spare)
            axes.set_ylim(len(levels) - 0.5, -0.5)
            axes.xaxis.set_major_locator(MaxNLocator(5))
            axes.set_yticks(range(len(levels)), labels=[])
            if number % columns == 0:
                named = ((short_label(factor), between) for factor, between in levels.items())
                fitted = ([style.fitted(text, LABEL_IN, style.SMALL_PT) for text in texts] for texts in named)
                axes.set_yticks(range(len(levels)), labels=["\n".join(texts) for texts in fitted])
            axes.set_xlabel(f"effect on {words.axis(words.within(metric.label), metric.unit)}")
        first = panels[::columns]
        page.lay_out(figure, first, [body_in] * len(first))
    return figure
