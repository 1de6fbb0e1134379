"""Print the tables of study ``strategies-under-loss`` for the page on strategies.

A folder holds a study, finished or not; incomplete repeats are ignored. If several folders have a strategy, the last
one counts. A mission without end counts with its horizon. Differences to the baseline are paired by repeat, averaged
over conditions first, with the standard deviation over the repeats.
"""

from __future__ import annotations

import argparse
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from statistics import fmean, stdev
from typing import Any

from missions.errors import OutputError
from missions.sweeps.folder import SweepResults

HORIZON_S = 7200.0
BASELINE = "plan-and-dispatch"
NOTHING, FAST, CHANNEL = "nothing", "nanomodem-v3", "channel.per"
STRATEGY, CASE, MODEM, GROUND = "strategy.name", "unforeseen", "communication.modem", "scenario"
Line = Mapping[str, Any]
Condition = tuple[Any, ...]


def settings_of(line: Line) -> Mapping[str, Any]:
    """What was varied in a run."""
    return {**line["settings"], GROUND: line["summary"]["scenario"]}


def mission_s(line: Line) -> float:
    """How long it took."""
    return float(line["summary"]["mission_time_s"]) if line["summary"]["completed"] else HORIZON_S


def whole(lines: Iterable[Line]) -> list[Line]:
    """Runs of repeats of which as many are made as of the first."""
    made = list(lines)
    n = Counter(line["repeat"] for line in made)
    return [line for line in made if n[line["repeat"]] == max(n.values())]


class Runs:
    """The runs of a study, by strategy.

    Args:
        lines: of its ledger that are done.
    """

    def __init__(self, lines: Iterable[Line]) -> None:
        self.lines = whole(lines)
        self.repeats = sorted({line["repeat"] for line in self.lines})
        by_strategy: dict[str, list[Line]] = defaultdict(list)
        for line in self.lines:
            by_strategy[settings_of(line)[STRATEGY]].append(line)
        self.by_strategy = dict(sorted(by_strategy.items(), key=lambda of: self.mean_s(of[1])))

    def mean_s(self, lines: Iterable[Line]) -> float:
        """Mean mission time (s)."""
        return fmean(map(mission_s, lines))

    def time_of(self, lines: Sequence[Line]) -> str:
        """Mean mission time, and that not all were completed, if so."""
        share = fmean(bool(line["summary"]["completed"]) for line in lines)
        return f"{self.mean_s(lines):.0f}" + ("" if share == 1.0 else f", {share:.0%}" if share else ", none")

    def where(self, strategy: str, **conditions: Any) -> list[Line]:
        """Runs of a strategy under conditions: ``unforeseen``, ``per``, ``modem``, ``ground``."""
        keys = {"unforeseen": CASE, "per": CHANNEL, "modem": MODEM, "ground": GROUND}
        wanted = {keys[name]: value for name, value in conditions.items()}
        return [line for line in self.by_strategy[strategy] if wanted.items() <= settings_of(line).items()]

    def values(self, name: str) -> list[Any]:
        """What a setting was in these runs, in order."""
        return sorted({settings_of(line)[name] for line in self.lines})

    def table(
        self, columns: Sequence[Any], cell: Callable[..., str], rows: Iterable[str] = (), title: str = "strategy"
    ) -> Iterator[str]:
        """Lines of a table in Markdown, a row for each strategy, and an empty one."""
        body = ([f"`{name}`", *(cell(name, column) for column in columns)] for name in rows or self.by_strategy)
        head = [title, *map(str, columns)]
        yield from ("| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *body))
        yield ""

    def difference(self, strategy: str, **conditions: Any) -> tuple[float, float]:
        """How much later missions of a strategy end than those of the baseline, and the standard deviation (s)."""
        means = [
            {n: self.mean_s(line for line in self.where(of, **conditions) if line["repeat"] == n) for n in self.repeats}
            for of in (strategy, BASELINE)
        ]
        later = [means[0][n] - means[1][n] for n in self.repeats]
        return fmean(later), stdev(later) if len(later) > 1 else float("nan")


def said(mean: float, deviation: float) -> str:
    """A difference with its standard deviation over the repeats."""
    return f"{mean:.0f} ± {deviation:.0f}"


def mean_of(lines: Iterable[Line], name: str) -> str:
    """Mean of a metric over the runs that have it."""
    values = [float(line["summary"][name]) for line in lines if line["summary"].get(name) is not None]
    return f"{fmean(values):.0f}" if values else "-"


def tables(runs: Runs, cases: Sequence[str]) -> Iterator[str]:
    """All tables; ``cases`` is what is unforeseen, in order."""
    losses, modems, grounds = map(runs.values, (CHANNEL, MODEM, GROUND))
    rivals = [name for name in runs.by_strategy if name != BASELINE]
    yield f"{len(runs.lines)} runs, {len(runs.repeats)} repeats; mission time / s by what is unforeseen\n"
    yield from runs.table(cases, lambda name, case: runs.time_of(runs.where(name, unforeseen=case)))
    yield f"the same, less that of {BASELINE}\n"
    yield from runs.table(cases, lambda name, case: said(*runs.difference(name, unforeseen=case)), rivals)
    yield "by loss\n"
    yield from runs.table(losses, lambda name, per: runs.time_of(runs.where(name, per=per)))
    yield f"the same, less that of {BASELINE}\n"
    yield from runs.table(losses, lambda name, per: said(*runs.difference(name, per=per)), rivals)
    yield "by modem, at the greatest loss\n"
    yield from runs.table(modems, lambda name, modem: runs.time_of(runs.where(name, modem=modem, per=losses[-1])))
    yield "nothing unforeseen, nothing lost, the faster modem: time to 95 % of the goal and mission time / s\n"
    calm = {"unforeseen": NOTHING, "per": losses[0], "modem": FAST}
    yield from runs.table(
        grounds,
        lambda name, ground: ", ".join(
            [mean_of(of := runs.where(name, ground=ground, **calm), "time_to_95_s"), runs.time_of(of)]
        ),
    )
    yield "other figures by loss, means\n"
    for metric in ("bits_assignments", "idle_s", "n_bytes", "recovery_time_s"):
        yield from runs.table(losses, lambda name, per, of=metric: mean_of(runs.where(name, per=per), of), title=metric)


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.under_loss", description=__doc__)
    parser.add_argument("folder", nargs="+", type=Path)
    folders = parser.parse_args().folder
    by_strategy: dict[str, list[Line]] = {}
    try:
        studies = [SweepResults.read(folder) for folder in folders]
        lines = [[line for line in study.lines.values() if line["status"] == "done"] for study in studies]
        cases = [case.name for case in studies[0].file.unforeseen]
    except OutputError as error:
        parser.error(str(error))
    for done in lines:
        for name in {settings_of(line)[STRATEGY] for line in done}:
            by_strategy[name] = [line for line in done if settings_of(line)[STRATEGY] == name]
    if BASELINE not in by_strategy:
        parser.error(f"{folders[0]}: no finished run of {BASELINE}, to which others are compared")
    print(*tables(Runs(line for of in by_strategy.values() for line in of), cases), sep="\n")


if __name__ == "__main__":
    main()
