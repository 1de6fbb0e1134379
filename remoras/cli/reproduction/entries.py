"""Entries of ``remoras reproduce``: expected values, their source, and the runs that measure them.

``published.toml`` has results of papers, ``printed.toml`` the tables of our documents. An entry has ``runs``, arguments
of ``remoras run`` by name, or ``measure``, a function of ``measures``. Each of its ``rows`` has a ``value``, a Python
format string over these, and the ``expected`` one: a number ``within`` a relative tolerance, a range, or a text. An
entry with a ``page`` has ``lines`` in place of rows, templates of lines that the page prints; only the page holds the
figures. ``{run.mission_time_s.mean:.0f}`` is the mean over the seeds of a summary field of the run named ``run``.
Other statistics of a field: ``least``, ``greatest``, ``half`` (of the 95 % interval of the mean, Student's t), ``low``
and ``high`` (its ends), ``count`` (of true values), ``n_above`` (of values above 0), ``each`` (all values,
comma-separated) and ``percent`` (of the mean). A milestone is a field by its name, that of one vehicle or group by
``NAME_VEHICLE``. ``<key>`` stands for each of its values in ``where``, so that a table is one entry.

Arguments ``sweep STUDY COLUMN=VALUE ...`` select runs of a study. Arguments ``mechanism NAME with`` or ``without``
select a measurement of ``benchmarks.mechanisms``, in the field ``measured``. ``pairs`` names differences of two runs by
seed, such as ``later = ["off", "on"]``; their ``percent`` is that of the mean of the second run.
"""

from __future__ import annotations

import itertools
import json
import math
import re
import shlex
import statistics
import string
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict

from missions.statistics import t_half_width

HERE = Path(__file__).parent
ROOT = HERE.parents[2]
COMMAND = [sys.executable, "-c", "from remoras.cli import main; main()"]
FIGURE = r"-?[0-9][0-9 ]*(?:\.[0-9]+)?(?:e-?[0-9]+)?"
"""A number as pages print it."""
AGREES, DEVIATES, UNMEASURED = "agrees", "deviates", "not measurable"
MISSING = "none"
"""Measured text where a run has no such value, such as a milestone that was not reached."""
Source = tuple[str, int]
"""Arguments of ``remoras run``, and a seed; or of runs of a study or a mechanism, see the text of this module."""
Summary = dict[str, Any]


class CannotMeasureError(Exception):
    """A page, module or command of an entry is missing or fails."""


class Outcome(NamedTuple):
    """Expected beside measured, with the verdict; ``reason`` of a known deviation, or of no measurement."""

    quantity: str
    expected: str
    measured: str
    verdict: str
    reason: str = ""

    @property
    def fails(self) -> bool:
        """True for a deviation without a known reason."""
        return self.verdict == DEVIATES and not self.reason


class Row(BaseModel):
    """One value of an entry; ``deviates`` gives the reason of a known deviation, if the value is ``known``, ± 10 %."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    quantity: str
    expected: float | str | tuple[float, float]
    value: str
    within: float = 0.0
    deviates: str = ""
    known: float | str = ""

    def outcome(self, values: Mapping[str, Any]) -> Outcome:
        """Compare with the measured values by name."""
        if (measured := _filled(self.value, values)) == MISSING:
            return Outcome(self.quantity, f"{self.expected}", MISSING, DEVIATES)
        if isinstance(self.expected, str):
            return self._judged(self.expected, measured, measured == self.expected)
        number = float(measured)
        shown = f"{number:.4g}" if abs(number) < 1000.0 else f"{number:.0f}"
        if isinstance(self.expected, tuple):
            low, high = self.expected
            return self._judged(f"{low:g} to {high:g}", shown, low <= number <= high)
        within = f" ± {100.0 * self.within:g} %" if self.within else ""
        is_near = abs(number - self.expected) <= self.within * abs(self.expected) + 1e-9
        return self._judged(f"{self.expected:g}{within}", shown, is_near)

    def _judged(self, expected: str, measured: str, agrees: bool) -> Outcome:
        as_known = measured == self.known or (
            isinstance(self.known, float) and math.isclose(float(measured), self.known, rel_tol=0.1)
        )
        reason = self.deviates if not agrees and as_known else ""
        return Outcome(self.quantity, expected, measured, AGREES if agrees else DEVIATES, reason)


class Entry(BaseModel):
    """A published result or a table of our documents.

    Attributes:
        source: paper and place in it, or page.
        duration: quick (seconds to a minute), minutes (up to ten), hours (more).
        command: shows the result to a user; ``n`` is the number of samples.
        unavailable: reason for no measurement; empty if it is possible.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    source: str = ""
    duration: Literal["quick", "minutes", "hours"] = "quick"
    command: str = ""
    n: str = ""
    seeds: str = "1"
    runs: dict[str, str] = {}
    pairs: dict[str, tuple[str, str]] = {}
    where: dict[str, tuple[str, ...]] = {}
    measure: str = ""
    rows: tuple[Row, ...] = ()
    page: str = ""
    lines: tuple[str, ...] = ()
    unavailable: str = ""

    @property
    def origin(self) -> str:
        """Paper or page of the expected values."""
        return self.source or self.page

    @property
    def recipe(self) -> str:
        """Commands that produce the values, with their seeds."""
        given = self.command or "; ".join(dict.fromkeys(map(_shown, self.runs.values())))
        seeds = f", seeds {self.seeds}" if self.runs and not self.command and "-" in self.seeds else ""
        return given + seeds + (f" ({self.n})" if self.n else "")

    def printed(self) -> Iterator[PrintedLine]:
        """Lines of the page, for each choice of ``where``."""
        for values in itertools.product(*self.where.values()):
            chosen = dict(zip(self.where, values, strict=True))
            runs = {name: _with(arguments, chosen) for name, arguments in self.runs.items()}
            for line in self.lines:
                yield PrintedLine(self.page, _with(line, chosen), runs)

    def outcomes(self) -> Iterator[Outcome]:
        """Measure; yield each row or line at once."""
        if self.unavailable or not (self.runs or self.measure):
            yield Outcome(self.name, "", "", UNMEASURED, self.unavailable or f"only by its command: {self.recipe}")
            return
        try:
            for line in self.printed():
                line.printed()  # before runs that may take hours
            for line in self.printed():
                yield line.outcome(self._values(line.runs))
            if self.lines:
                return
            values = self._values(self.runs)
            if self.measure:
                from remoras.cli.reproduction import measures  # loaded for measurements only

                values |= _measured(getattr(measures, self.measure))
        except CannotMeasureError as error:
            yield Outcome(self.name, "", "", UNMEASURED, str(error))
            return
        for row in self.rows:
            yield row.outcome(values)

    def _values(self, runs: Mapping[str, str]) -> dict[str, Any]:
        first, _, last = self.seeds.partition("-")
        seeds = range(int(first), int(last or first) + 1)
        values: dict[str, Any] = {
            name: Measured([of for seed in seeds for of in summaries_of((arguments, seed))])
            for name, arguments in runs.items()
        }
        return values | {name: Paired(values[one], values[other]) for name, (one, other) in self.pairs.items()}


class PrintedLine(NamedTuple):
    """Line that a page prints: the page below the repository's root, the template, the runs by name."""

    page: str
    template: str
    runs: dict[str, str]

    def printed(self) -> str:
        """Return the line as the page has it; CannotMeasureError without the page, or such a line."""
        if not (ROOT / self.page).is_file():
            raise CannotMeasureError(f"{self.page} comes with a checkout only")
        matches = list(re.finditer(self._pattern, (ROOT / self.page).read_text(encoding="utf-8")))
        if len(matches) != 1:
            raise CannotMeasureError(f"{self.page} has {len(matches)} lines {self.template!r}, expected 1")
        return matches[0][0]

    @property
    def _pattern(self) -> str:
        parts = string.Formatter().parse(self.template)
        return "".join(re.escape(text) + (f"{FIGURE}(?:, {FIGURE})*" if field else "") for text, field, _, _ in parts)

    def outcome(self, values: Mapping[str, Any]) -> Outcome:
        """Compare the line of the page with the measured one."""
        before, made = self.printed(), _filled(self.template, values)
        return Outcome(self.page, before, made, AGREES if before == made else DEVIATES)


@cache
def entries() -> dict[str, Entry]:
    """All entries by name, published results first."""
    read = [Entry(**values) for file in ("published", "printed")
            for values in tomllib.loads((HERE / f"{file}.toml").read_text(encoding="utf-8"))["entry"]]  # fmt: skip
    return {entry.name: entry for entry in read}


@cache  # several figures rest on one measurement
def _measured(measure: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    return measure()


def _filled(template: str, values: Mapping[str, Any]) -> str:
    try:
        return template.format(**values)
    except KeyError:
        return MISSING


def _with(text: str, chosen: Mapping[str, str]) -> str:
    for key, value in chosen.items():
        text = text.replace(f"<{key}>", value)
    return text


def _shown(arguments: str) -> str:
    first, _, rest = arguments.partition(" ")
    if first == "sweep":
        return f"remoras sweep {rest.partition(' ')[0]}"
    if first == "mechanism":
        return f"python -m benchmarks.mechanisms {shlex.quote(shlex.split(rest)[0])}"
    return f"remoras run {arguments}"


class Measured:
    """Summaries of a run over its seeds; fields of a summary and milestones are attributes."""

    def __init__(self, summaries: Sequence[Summary]) -> None:
        self._summaries = summaries

    @property
    def n(self) -> int:
        """Number of seeds."""
        return len(self._summaries)

    def __getattr__(self, name: str) -> OverSeeds:
        return OverSeeds([_value(summary, name) for summary in self._summaries])


class Paired:
    """Difference of two runs, seed by seed, with the same fields."""

    def __init__(self, one: Measured, other: Measured) -> None:
        self._one, self._other = one, other

    def __getattr__(self, name: str) -> OverSeeds:
        one, other = getattr(self._one, name), getattr(self._other, name)
        return OverSeeds([there - here for there, here in zip(one.values, other.values, strict=True)], float(other))


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
    """A field over all seeds; as a number its mean. ``STATISTICS`` are attributes.

    Of paired differences, ``base`` is the mean that they are differences to.
    """

    values: Sequence[float]
    base: float

    def __new__(cls, values: Sequence[float], base: float = 1.0) -> OverSeeds:
        made = super().__new__(cls, statistics.fmean(values))
        made.values, made.base = values, base
        return made

    def __getattr__(self, name: str) -> Any:
        if name not in STATISTICS:
            raise AttributeError(f"{name} is no statistic; allowed: {', '.join(STATISTICS)}")
        return STATISTICS[name](self)


STATISTICS: dict[str, Callable[[OverSeeds], Any]] = {
    "mean": float,
    "least": lambda of: min(of.values),
    "greatest": lambda of: max(of.values),
    "half": lambda of: t_half_width(of.values),
    "low": lambda of: of - t_half_width(of.values),
    "high": lambda of: of + t_half_width(of.values),
    "count": lambda of: sum(map(bool, of.values)),
    "n_above": lambda of: sum(value > 0.0 for value in of.values),
    "percent": lambda of: 100.0 * of / of.base,
    "each": lambda of: Listed(of.values),
}


class Listed(tuple[float, ...]):
    """Values that are printed with commas between."""

    def __format__(self, spec: str) -> str:
        return ", ".join(format(value, spec) for value in self)


@cache
def summaries_of(source: Source) -> list[Summary]:
    """Return the summary of a run, or those of the runs of a study; made once for all entries."""
    arguments, seed = source
    first, *others = shlex.split(arguments)
    if first == "sweep":
        return runs_of_study(others[0], dict(column.split("=", 1) for column in others[1:]))
    if first == "mechanism":
        try:
            from benchmarks.mechanisms import MECHANISMS, measured
        except ModuleNotFoundError:
            raise CannotMeasureError("benchmarks.mechanisms comes with a checkout only") from None
        return [{"measured": measured(MECHANISMS[others[0]], seed, others[1] == "without")}]
    command = [*COMMAND, "run", first, *others, "--seed", str(seed), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):  # 1: the mission was not completed
        raise CannotMeasureError(f"remoras run {arguments} --seed {seed}: {done.stderr.strip()}")
    return [json.loads(done.stdout)]


def runs_of_study(study: str, chosen: dict[str, str]) -> list[Summary]:
    """Return rows of the runs of a study with these values; an incomplete run has its whole time."""
    rows = [row for row in swept(study) if all(str(row[column]) == value for column, value in chosen.items())]
    rows.sort(key=lambda row: int(row["repeat"]))  # runs end in any order, and pairs are of one repeat
    if not rows:
        raise CannotMeasureError(f"study {study} has no runs with {chosen}; its columns: {', '.join(swept(study)[0])}")
    return rows


@cache
def swept(study: str) -> list[Summary]:
    """All runs of a study."""
    import remoras

    with TemporaryDirectory() as folder:
        runs = remoras.sweep(study, Path(folder) / study).runs()
    return [{str(column): value for column, value in row.items()} for row in runs.to_dict("records")]
