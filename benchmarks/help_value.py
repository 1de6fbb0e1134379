"""Value of help in a folder of the study ``help``: ``python -m benchmarks.help_value DIR [--figure FILE]``.

Ratio of the mission times without and with help, by share of escorted lines, level of help and loss: geometric mean
over organisations and instances (incomplete runs count with the full duration). The instance is the unit, since all
organisations and levels share its lines, speeds and losses. Intervals of 95 % are by sign flips of the instances; p
values are corrected for all cells by step-down. The least ratio is the one that a test at 5 % finds with probability
0.8.

Then the planned contrasts, differences of log ratios within each instance: help with loss, help with the share,
and organisation with loss, as the growth of the time without help beyond that of the mean organisation. Last, the pairs
of organisation and level that differ in the mean over all cells, and their share of the variance.
"""

from __future__ import annotations

import argparse
import itertools
import math
from collections import defaultdict
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from missions.statistics import Array, NoInterval, detectable, difference_interval, step_down_p
from missions.sweeps.folder import SweepResults
from visualisation import style

HELP, SHARE = "strategy.parameters.help", "drawn_lines.escorted_share"
NONE, BURSTS = "none", "0.8 in bursts"


class Times(NamedTuple):
    """Logs of mission times (s), shape (instances, shares, levels, losses, organisations); no help comes first."""

    shares: list[float]
    levels: list[str]
    losses: list[str]
    organisations: list[str]
    logs: Array

    @classmethod
    def of(cls, results: SweepResults) -> Times:
        """Return the times of the instances with all runs."""
        times: dict[int, dict[tuple[float, str, str, str], float]] = defaultdict(dict)
        for line in results.lines.values():
            summary, settings = line["summary"], line["settings"]
            loss = BURSTS if settings.get("channel.name") == "gilbert-elliott" else f"{summary['per']:g}"
            time_s = summary["mission_time_s"] if summary.get("completed") else line["duration_s"]
            cell = settings[SHARE], settings[HELP], loss, summary["strategy"]
            times[line["repeat"]][cell] = math.log(time_s)
        shares, levels, losses, organisations = map(sorted, map(set, zip(*times[0], strict=True)))
        axes = shares, sorted(levels, key=lambda level: level != NONE), losses, organisations
        cells = list(itertools.product(*axes))
        logs = [[own[cell] for cell in cells] for own in times.values() if len(own) == len(cells)]
        return cls(*axes, np.array(logs).reshape(-1, *map(len, axes)))

    @property
    def gains(self) -> Array:
        """Log ratio of the times without and with help, shape (instances, shares, levels but none, losses)."""
        return np.asarray((self.logs[:, :, :1] - self.logs[:, :, 1:]).mean(axis=-1))

    @property
    def contrasts(self) -> dict[str, Array]:
        """Planned contrasts by name, one value per instance."""
        gains, lossy = self.gains[:, -2:], self.losses.index("0.9")
        grown = (self.logs[:, :, 0, lossy] - self.logs[:, :, 0, 0]).mean(axis=1)
        beyond = grown - grown.mean(axis=1, keepdims=True)
        return {
            "help, at no loss over loss 0.9": (gains[..., 0] - gains[..., lossy]).mean(axis=(1, 2)),
            f"help, at share {self.shares[-1]:g} over {self.shares[-2]:g}": (gains[:, 1] - gains[:, 0]).mean(
                axis=(1, 2)
            ),
            **{f"{name}, growth up to loss 0.9": beyond[:, n] for n, name in enumerate(self.organisations)},
        }

    @property
    def entrants(self) -> Array:
        """Logs of mission times, shape (instances, cells, entrants): an entrant is an organisation with a level."""
        by_cell = self.logs.transpose(0, 1, 3, 2, 4)
        return by_cell.reshape(len(by_cell), by_cell.shape[1] * by_cell.shape[2], -1)

    @property
    def n_differing(self) -> tuple[int, int]:
        """Number of pairs of entrants that differ at 5 % (step-down over all pairs), and of all pairs."""
        mean = self.entrants.mean(axis=1)
        pairs = list(itertools.combinations(mean.T, 2))
        differs = [p < 0.05 for p in step_down_p(np.array([one - other for one, other in pairs]).T)]
        return sum(differs), len(pairs)

    @property
    def entrants_share(self) -> tuple[float, float]:
        """Share of the variance that the entrant explains: of all runs, and within each cell of each instance."""
        logs = self.entrants
        own = float(((logs.mean(axis=(0, 1)) - logs.mean()) ** 2).mean())
        return own / float(logs.var()), own / float(logs.var(axis=2).mean())


class Ratio(NamedTuple):
    """Ratio of times with its 95 % interval (nan below eight instances), p value and least ratio found."""

    mean: float
    low: float
    high: float
    p: float
    least: float

    def __str__(self) -> str:
        return f"{self.mean:.2f} ({self.low:.2f} to {self.high:.2f}), p = {self.p:.4f}, least {self.least:.2f}"


def ratios(logs: Array) -> list[Ratio]:
    """Return the ratio of each column of log ratios, shape (instances, comparisons)."""
    found = []
    for column, p in zip(logs.T, step_down_p(logs), strict=True):
        interval = difference_interval([*column])
        low, high = (math.nan, math.nan) if isinstance(interval, NoInterval) else interval
        least = detectable(float(column.std(ddof=1)), len(column)) if len(column) > 1 else math.nan
        found.append(Ratio(math.exp(column.mean()), math.exp(low), math.exp(high), p, math.exp(least)))
    return found


def figure(times: Times, found: list[Ratio]) -> Figure:
    """Draw the ratios over loss, a panel per level of help and a line per share."""
    shown = [place for place, loss in enumerate(times.losses) if loss != BURSTS]
    losses = [float(times.losses[place]) for place in shown]
    table = np.array(found).reshape(len(times.shares), len(times.levels) - 1, len(times.losses), -1)[:, :, shown]
    with style.paper():
        drawn = Figure(figsize=(style.PAGE_IN, 2.5), layout="constrained")
        panels = drawn.subplots(1, len(times.levels) - 1, sharey=True, squeeze=False)[0]
        for number, (axes, level) in enumerate(zip(panels, times.levels[1:], strict=True)):
            axes.axhline(1.0, color=style.GREY, linewidth=0.6)
            for place, share in enumerate(times.shares):
                means, lows, highs = table[place, number, :, :3].T
                xs, look = np.array(losses) + 0.008 * (place - 1), style.look(place)
                label = f"{100.0 * share:g} % of the lines need a second vehicle"
                axes.plot(xs, means, color=look.colour, linestyle=look.line, marker=look.marker, label=label)
                axes.vlines(xs, lows, highs, color=look.colour, linewidth=0.7)
            axes.set(title=f"({'ab'[number]}) {level}", xlabel="packet error rate", yscale="log")
            axes.set_yticks([0.5, 0.7, 1.0, 1.5, 2.0, 3.0], ["0.5", "0.7", "1", "1.5", "2", "3"])
            axes.minorticks_off()
        panels[0].set_ylabel("time without / with help")
        panels[0].legend(loc="lower left")
    return drawn


def main() -> None:
    """Print ratios and contrasts of a study; draw the ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--figure", type=Path)
    asked = parser.parse_args()
    times = Times.of(SweepResults.read(asked.folder))
    n = len(times.logs)
    found = ratios(times.gains.reshape(n, -1))
    print(f"n = {n} instances, {', '.join(times.organisations)}")
    cells = itertools.product(times.shares, times.levels[1:], times.losses)
    for (share, level, loss), ratio in zip(cells, found, strict=True):
        print(f"escorted {share:g}, {level}, loss {loss}: {ratio}")
    for name, ratio in zip(times.contrasts, ratios(np.array([*times.contrasts.values()]).T), strict=True):
        print(f"{name}: {ratio}")
    (n_differing, n_pairs), (of_all, within) = times.n_differing, times.entrants_share
    print(f"pairs of organisation and help that differ: {n_differing} of {n_pairs}")
    print(f"share of the variance: {of_all:.1%}, within cells of instances {within:.0%}")
    if asked.figure is not None:
        figure(times, found).savefig(asked.figure, dpi=style.DPI)


if __name__ == "__main__":
    main()
