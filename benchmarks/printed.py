"""Reproduce the figures that pages print.

    python -m benchmarks printed --sample 0.1      reproduce a tenth of the lines; exit 1 if a page differs
    python -m benchmarks printed --page docs/validation.md --write     reproduce its lines and update the page
    python -m benchmarks printed --list            the lines with their numbers of runs

Each line has a template and runs in ``printed.toml``; only the pages hold the figures. A template is a Python format
string: ``{run.mission_time_s.mean:.0f}`` is the mean over the seeds of a summary field of the run named ``run``. Other
statistics of a field: ``least``, ``greatest``, ``half`` (of the 95 % interval of the mean, Student's t), ``count`` (of
true values), ``each`` (all values, comma-separated) and ``percent`` (of the mean). A milestone is a field by its name,
that of one vehicle or group by ``NAME_VEHICLE``. ``<key>`` stands for each of its values in ``where``, so that a table
is one entry.

Arguments ``sweep STUDY COLUMN=VALUE ...`` select runs of a study. Arguments ``mechanism NAME with`` or ``without``
select a measurement of ``benchmarks.mechanisms``, in the field ``measured``. ``pairs`` names differences of two runs by
seed, such as ``later = ["off", "on"]``. They also have ``low`` and ``high``, the ends of the interval, and ``share``,
the mean in per cent of that of the second run.
"""

from __future__ import annotations

import argparse
import itertools
import json
import random
import re
import shlex
import statistics
import string
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import remoras
from benchmarks.mechanisms import MECHANISMS, measured
from missions.statistics import t_half_width

ENTRIES = Path(__file__).with_name("printed.toml")
ROOT = Path(__file__).parents[1]
COMMAND = [sys.executable, "-c", "from remoras.cli import main; main()"]
FIGURE = r"-?[0-9][0-9 ]*(?:\.[0-9]+)?(?:e-?[0-9]+)?"
"""A number as pages print it."""
Source = tuple[str, int]
"""Arguments of ``remoras run``, and a seed; or of runs of a study or a mechanism, see the text of this module."""
Summary = dict[str, Any]


@dataclass(frozen=True)
class PrintedLine:
    """A line that a page prints.

    Attributes:
        page: where it stands, below the repository's root.
        template: of the line.
        runs: arguments of ``remoras run``, by the name that the template has for them.
        seeds: of each run.
        pairs: differences of two of the runs, by the name that the template has for them.
        is_long: True if it takes minutes: made again by a release, or where it is asked for.
    """

    page: str
    template: str
    runs: dict[str, str]
    seeds: tuple[int, ...]
    pairs: dict[str, tuple[str, str]]
    is_long: bool

    @property
    def sources(self) -> list[Source]:
        """All runs that the line takes."""
        return [(arguments, seed) for arguments in self.runs.values() for seed in self.seeds]

    def printed(self, text: str) -> str | None:
        """The line as a page has it; None if it has no such line, or several."""
        matches = list(re.finditer(self._pattern, text))
        return matches[0][0] if len(matches) == 1 else None

    @property
    def _pattern(self) -> str:
        parts = string.Formatter().parse(self.template)
        return "".join(re.escape(text) + (f"{FIGURE}(?:, {FIGURE})*" if field else "") for text, field, _, _ in parts)

    def made(self, summaries: dict[Source, list[Summary]]) -> str:
        """The line as it is to be printed by what came of its runs."""
        values = {
            name: Measured([of for seed in self.seeds for of in summaries[arguments, seed]])
            for name, arguments in self.runs.items()
        }
        paired = {name: Paired(values[one], values[other]) for name, (one, other) in self.pairs.items()}
        return self.template.format(**values, **paired)


class Measured:
    """What came of a run for each of its seeds; its fields are those of a summary, and milestones."""

    def __init__(self, summaries: Sequence[Summary]) -> None:
        self._summaries = summaries

    @property
    def n(self) -> int:
        """How many seeds."""
        return len(self._summaries)

    def __getattr__(self, name: str) -> OverSeeds:
        return OverSeeds([_value(summary, name) for summary in self._summaries])


class Paired:
    """By how much a run is above another one, seed by seed; its fields are theirs."""

    def __init__(self, one: Measured, other: Measured) -> None:
        self._one, self._other = one, other

    def __getattr__(self, name: str) -> Difference:
        one, other = getattr(self._one, name), getattr(self._other, name)
        return Difference.between(one, other)


def _value(summary: Summary, name: str) -> float:
    if name in summary:
        return float(summary[name] or 0.0)
    times = [
        of["time_s"]
        for of in summary.get("milestones", ())
        if name in (of["name"], f"{of['name']}_{of['vehicle'] or of['group']}")
    ]
    if not times:
        known = ", ".join(sorted({*summary, *(of["name"] for of in summary.get("milestones", ()))}))
        raise KeyError(f"{name} is no field of a summary and no milestone; allowed: {known}")
    return float(times[0])


class OverSeeds(float):
    """A field over all seeds; as a number its mean."""

    values: Sequence[float]

    def __new__(cls, values: Sequence[float]) -> OverSeeds:
        made = super().__new__(cls, statistics.fmean(values))
        made.values = values
        return made

    @property
    def mean(self) -> float:
        """Over the seeds."""
        return float(self)

    @property
    def least(self) -> float:
        """Of all seeds."""
        return min(self.values)

    @property
    def greatest(self) -> float:
        """Of all seeds."""
        return max(self.values)

    @property
    def half(self) -> float:
        """Half of the 95 % interval of the mean, Student's t."""
        return t_half_width(self.values)

    @property
    def count(self) -> int:
        """Seeds for which it is true."""
        return sum(map(bool, self.values))

    @property
    def percent(self) -> float:
        """The mean, in per cent."""
        return 100.0 * self

    @property
    def each(self) -> Listed:
        """All values, in the order of the seeds."""
        return Listed(self.values)


class Difference(OverSeeds):
    """Paired differences; as a number their mean."""

    base: float

    @classmethod
    def between(cls, one: OverSeeds, other: OverSeeds) -> Difference:
        """Of values that are of the same seeds."""
        made = cls([there - here for there, here in zip(one.values, other.values, strict=True)])
        made.base = float(other)
        return made

    @property
    def low(self) -> float:
        """The lower end of the 95 % interval of the mean."""
        return self - self.half

    @property
    def high(self) -> float:
        """The upper end of it."""
        return self + self.half

    @property
    def n_above(self) -> int:
        """Pairs in which the first is above the second."""
        return sum(value > 0.0 for value in self.values)

    @property
    def share(self) -> float:
        """The mean in per cent of the mean that it is a difference to."""
        return 100.0 * self / self.base


class Listed(tuple[float, ...]):
    """Values that are printed with commas between."""

    def __format__(self, spec: str) -> str:
        return ", ".join(format(value, spec) for value in self)


def lines() -> Iterator[PrintedLine]:
    """All lines that have an entry, tables line by line."""
    for entry in tomllib.loads(ENTRIES.read_text(encoding="utf-8"))["printed"]:
        first, _, last = str(entry["seeds"]).partition("-")
        seeds = tuple(range(int(first), int(last or first) + 1))
        where = entry.get("where", {})
        for values in itertools.product(*where.values()):
            chosen = dict(zip(where, values, strict=True))
            runs = {name: _with(arguments, chosen) for name, arguments in entry["runs"].items()}
            pairs = {name: (one, other) for name, (one, other) in entry.get("pairs", {}).items()}
            line = _with(entry["line"], chosen)
            yield PrintedLine(entry["page"], line, runs, seeds, pairs, entry.get("long", False))


def _with(text: str, chosen: dict[str, str]) -> str:
    for key, value in chosen.items():
        text = text.replace(f"<{key}>", value)
    return text


def summaries_of(source: Source) -> list[Summary]:
    """The summaries of a run, which is one, or of the runs of a study."""
    arguments, seed = source
    first, *others = shlex.split(arguments)
    if first == "sweep":
        return runs_of_study(others[0], dict(column.split("=", 1) for column in others[1:]))
    if first == "mechanism":
        return [{"measured": measured(MECHANISMS[others[0]], seed, others[1] == "without")}]
    command = [*COMMAND, "run", first, *others, "--seed", str(seed), "--json"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):  # 1: the mission was not completed
        raise SystemExit(f"remoras run {arguments} --seed {seed}: {done.stderr.strip()}")
    return [json.loads(done.stdout)]


def runs_of_study(study: str, chosen: dict[str, str]) -> list[Summary]:
    """Rows of the runs of a study that have these values; a run that did not complete has its whole time."""
    rows = [row for row in swept(study) if all(str(row[column]) == value for column, value in chosen.items())]
    rows.sort(key=lambda row: int(row["repeat"]))  # runs end in any order, and pairs are of one repeat
    if not rows:
        raise SystemExit(f"study {study} has no runs with {chosen}; its columns: {', '.join(swept(study)[0])}")
    return rows


@cache
def swept(study: str) -> list[Summary]:
    """All runs of a study."""
    with tempfile.TemporaryDirectory() as folder:
        runs = remoras.sweep(study, Path(folder) / study).runs()
    return [{str(column): value for column, value in row.items()} for row in runs.to_dict("records")]


def drawn(among: Sequence[PrintedLine], share: float, seed: int) -> list[PrintedLine]:
    """A share of the lines, at least one, in their order."""
    chosen = set(random.Random(seed).sample(range(len(among)), max(1, round(share * len(among)))))
    return [line for place, line in enumerate(among) if place in chosen]


def main(arguments: Sequence[str] | None = None) -> int:
    """Make lines again, and say what differs."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks printed", description=__doc__.partition("\n\n")[0])
    parser.add_argument("--sample", type=float, default=1.0, metavar="SHARE", help="share of the lines; default all")
    parser.add_argument("--seed", type=int, default=1, help="of the sample")
    parser.add_argument("--page", default="", help="lines of this page alone")
    parser.add_argument("--long", action="store_true", help="those that take minutes, too")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--write", action="store_true", help="put what came out into the pages")
    parser.add_argument("--list", action="store_true", help="make nothing; say which lines there are")
    given = parser.parse_args(arguments)
    if not 0.0 < given.sample <= 1.0:
        parser.error(f"--sample {given.sample}: allowed is a share above 0, at most 1")
    chosen = [line for line in lines() if line.page.startswith(given.page) and (given.long or not line.is_long)]
    if not chosen:
        parser.error(f"--page {given.page}: allowed are {', '.join(sorted({line.page for line in lines()}))}")
    chosen = drawn(chosen, given.sample, given.seed)
    if given.list:
        for line in chosen:
            print(f"{line.page}: {len(line.sources):4} runs  {line.template}")
        return 0
    return repeated(chosen, given.jobs, writes=given.write)


def repeated(chosen: Sequence[PrintedLine], jobs: int, *, writes: bool) -> int:
    """Make lines again; 1 if a page prints something else."""
    sources = list(dict.fromkeys(source for line in chosen for source in line.sources))
    with ThreadPoolExecutor(jobs) as pool:
        summaries = dict(zip(sources, pool.map(summaries_of, sources), strict=True))
    n_other = 0
    for line in chosen:
        page = ROOT / line.page
        text = page.read_text(encoding="utf-8")
        before, made = line.printed(text), line.made(summaries)
        if before == made:
            continue
        n_other += 1
        print(f"{line.page}\n  prints  {before}\n  made    {made}")
        if writes and before is not None:
            page.write_text(text.replace(before, made), encoding="utf-8")
    print(f"{len(chosen) - n_other} of {len(chosen)} lines repeat ({len(sources)} runs)")
    return int(n_other > 0)
