"""The channel ``trace``: outcomes of links that were recorded, at sea or in a run, replayed from a file.

The file is CSV with a line of names, or Parquet, of the columns

    time_s    start of a packet, from the start of the run
    sender    name of the vehicle that sent it
    receiver  name of one that listened
    lost      1 if it was lost there, 0 if not; or in its place
    per       packet error rate of the link from then on

in any order of rows; other columns are passed over. A row holds until the next of its link, the first also for what was
before it. The trace lasts until its last row, and as long after that as the median time between two rows of a link.
"""

from __future__ import annotations

import csv
import math
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any

from pydantic import Field

from exchange.acoustics.link import LinkModel, Transmission
from exchange.acoustics.models import (
    ChannelModel,
    Deployment,
    LinkFileError,
    LinkFileGoneError,
    SettingFault,
    same_hash,
)

ROUNDING_S = 0.001
"""A row holds this much before its time: a writer may have rounded it."""
KEYS = ("time_s", "sender", "receiver")
OUTCOMES = {"0": 0.0, "1": 1.0, "false": 0.0, "true": 1.0}
KINDS = "a CSV or Parquet file"


@dataclass(frozen=True, slots=True)
class LossSeries:
    """Loss of one directed link: at each time it begins to be what stands at the same place of ``per``."""

    times_s: tuple[float, ...]
    per: tuple[float, ...]

    def at(self, time_s: float) -> float:
        """Probability of loss at a time.

        >>> LossSeries((0.0, 10.0), (1.0, 0.0)).at(9.9)
        1.0
        """
        return self.per[max(0, bisect_right(self.times_s, time_s + ROUNDING_S) - 1)]

    def mean(self, until_s: float) -> float:
        """Mean over the time from 0 to ``until_s``."""
        if until_s <= 0.0:
            return self.per[0]
        begins_s = (0.0, *self.times_s[1:], until_s)
        held_s = [end - begin for begin, end in pairwise(begins_s)]
        return math.fsum(p * time_s for p, time_s in zip(self.per, held_s, strict=True)) / until_s


@dataclass(frozen=True, slots=True)
class Trace:
    """What a file holds: a series of each directed link, by the names of its vehicles; the time that it lasts."""

    links: Mapping[tuple[str, str], LossSeries]
    until_s: float

    @property
    def vehicles(self) -> list[str]:
        """Names of all vehicles in it."""
        return sorted({name for link in self.links for name in link})

    @property
    def start_s(self) -> float:
        """Time of the first row."""
        return min(series.times_s[0] for series in self.links.values())

    @property
    def longest_gap_s(self) -> float:
        """Longest time between two rows of a link."""
        return max(
            (end - begin for series in self.links.values() for begin, end in pairwise(series.times_s)), default=0.0
        )


@dataclass(frozen=True, slots=True)
class TraceLinks:
    """Links that do what was recorded; a trace that is repeated starts anew when it has ended."""

    series: Mapping[tuple[int, int], LossSeries]
    until_s: float
    repeat: bool

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """What the trace says of the link at the start of the packet."""
        time_s = packet.start_s
        if self.repeat and self.until_s > 0.0:
            time_s %= self.until_s
        return self.series[packet.sender, receiver].at(time_s)


class TraceChannel(ChannelModel):
    """Losses as they were recorded."""

    title = "losses of each link as recorded in channel.file: outcomes, or rates over time"

    file: str = Field("", description="trace: CSV or Parquet file of the columns time_s, sender, receiver, lost or per")
    repeat: bool = Field(False, description="trace: start anew when the file has ended")
    sha256: str = Field(
        "",
        description="trace, network: hash of the file, which results repeat; another file under its name is refused",
    )

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Links of the file's vehicles."""
        trace, nodes = trace_of(self.file, self.sha256), deployment.nodes
        series = {(nodes[sender], nodes[receiver]): link for (sender, receiver), link in trace.links.items()}
        return TraceLinks(series, trace.until_s, self.repeat)

    def mean_per(self, deployment: Deployment) -> float:
        """Over the time that the file lasts, and its links."""
        trace = trace_of(self.file, self.sha256)
        return math.fsum(series.mean(trace.until_s) for series in trace.links.values()) / len(trace.links)

    @classmethod
    def faults(cls, settings: Mapping[str, Any]) -> Iterator[SettingFault]:
        """No file is named."""
        if not settings.get("file"):
            yield SettingFault("file", "", f"missing: a CSV or Parquet file of {', '.join(KEYS)}, and lost or per")

    def misfits(self, deployment: Deployment) -> Iterator[SettingFault]:
        """A file that cannot be read, that is of other vehicles, or that ends before the run.

        Results whose file is gone can still be read: if the hash is given, that is a fault of a new run alone.
        """
        if not self.file:
            return
        try:
            trace = trace_of(self.file, self.sha256)
        except LinkFileGoneError as error:
            if not self.sha256:
                yield SettingFault("file", f'"{self.file}"', str(error))
            return
        except LinkFileError as error:
            yield SettingFault("file", f'"{self.file}"', str(error))
            return
        if misfit := _misfit(trace, deployment, self.repeat):
            yield SettingFault("file", f'"{self.file}"', misfit)


def _misfit(trace: Trace, deployment: Deployment, repeat: bool) -> str:
    """Why a trace is not one of this fleet and its run; empty if it is."""
    fleet = list(deployment.nodes)
    others = [name for name in trace.vehicles if name not in deployment.nodes]
    if others:
        return f"is of vehicle {', '.join(others)}; those of the scenario are {', '.join(fleet)}: rename them in either"
    missing = [
        (sender, other) for sender in fleet for other in fleet if sender != other and (sender, other) not in trace.links
    ]
    if missing:
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        return f"has no row of the link from {missing[0][0]} to {missing[0][1]}{more}: every link needs one at least"
    if trace.start_s > trace.longest_gap_s:
        return f"begins at {trace.start_s:g} s only: subtract that from time_s, which counts from the start of the run"
    if trace.until_s < deployment.duration_s and not repeat:
        return (
            f"ends at {trace.until_s:g} s, the run at {deployment.duration_s:g} s: "
            "set scenario.duration_s to that at most, or channel.repeat = true"
        )
    return ""


def trace_of(file: str, sha256: str = "") -> Trace:
    """The trace in a file, which is read once as long as it stays the same.

    Args:
        file: path of a CSV or Parquet file.
        sha256: hash that its content must have; any if empty.

    Raises:
        LinkFileGoneError: there is no such file, or it has another hash.
        LinkFileError: it is no trace.
    """
    return _read(file, same_hash(file, sha256, KINDS))


@lru_cache(maxsize=16)
def _read(file: str, sha256: str) -> Trace:
    """The trace in a file of this content."""
    names, rows = _parquet(file) if file.endswith(".parquet") else _csv(file)
    kind = "lost" if "lost" in names else "per"
    missing = [name for name in (*KEYS, kind) if name not in names]
    if missing or ("lost" in names and "per" in names):
        raise LinkFileError(
            f"has the columns {', '.join(names) or 'none'}; needed are {', '.join(KEYS)} and lost or per"
        )
    places = [names.index(name) for name in (*KEYS, kind)]
    losses: dict[tuple[str, str], dict[float, float]] = {}
    for where, row in rows:
        values = [row[place] if place < len(row) else "" for place in places]
        time_s, sender, receiver, per = _checked(where, kind, values)
        if time_s in (of_link := losses.setdefault((sender, receiver), {})):
            raise LinkFileError(f"{where}: a second one of {sender} to {receiver} at {time_s:g} s")
        of_link[time_s] = per
    if not losses:
        raise LinkFileError("has no rows")
    links = {link: LossSeries(*zip(*sorted(of_link.items()), strict=True)) for link, of_link in sorted(losses.items())}
    gaps_s = [end - begin for series in links.values() for begin, end in pairwise(series.times_s)]
    latest_s = max(series.times_s[-1] for series in links.values())
    from statistics import median

    return Trace(links, latest_s + (median(gaps_s) if gaps_s else 0.0))


Rows = Iterable[tuple[str, list[Any]]]
"""Where each row stands in its file, and its values."""


def _csv(file: str) -> tuple[list[str], Rows]:
    try:
        reader = csv.reader(Path(file).read_text(encoding="utf-8-sig").splitlines())
        names = [name.strip() for name in next(reader, [])]
        return names, [(f"line {reader.line_num}", line) for line in reader if line]
    except (UnicodeDecodeError, csv.Error) as error:
        raise LinkFileError(f"is no CSV: {error}") from None


def _parquet(file: str) -> tuple[list[str], Rows]:
    from pyarrow import ArrowException, parquet

    try:
        table = parquet.read_table(file)
    except (ArrowException, OSError) as error:
        raise LinkFileError(f"is no Parquet: {str(error).splitlines()[0]}") from None
    rows = zip(*(column.to_pylist() for column in table.columns), strict=True)
    return table.column_names, [(f"row {number}", list(row)) for number, row in enumerate(rows, 1)]


def _checked(where: str, kind: str, row: list[Any]) -> tuple[float, str, str, float]:
    """Time, sender, receiver and loss of a row."""
    time, sender, receiver, outcome = (str(value).strip() for value in row)
    if not sender or not receiver or sender == receiver:
        raise LinkFileError(f"{where}: from {sender!r} to {receiver!r} is no link of two vehicles")
    time_s = _number(time)
    if not 0.0 <= time_s < math.inf:
        raise LinkFileError(f"{where}: time_s = {time!r} must be a number of seconds, 0 or more")
    per = OUTCOMES.get(outcome.lower(), math.nan) if kind == "lost" else _number(outcome)
    if not 0.0 <= per <= 1.0:
        allowed = "0 or 1" if kind == "lost" else "a number from 0 to 1"
        raise LinkFileError(f"{where}: {kind} = {outcome!r} must be {allowed}")
    return time_s, sender, receiver, per


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
