"""Channel ``trace``: recorded link outcomes, at sea or in a run, replayed from a file.

The file is CSV with a header and the columns

    time_s    start of a packet, from the start of the run
    sender    name of the sending vehicle
    receiver  name of a receiving vehicle
    lost      1 if lost there, else 0; or in its place
    per       packet error rate of the link from then on

A row holds until the next one of its link, the first also before its time. The trace ends one median row interval of a
link after its last row.
"""

from __future__ import annotations

import csv
import math
from bisect import bisect_right
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

from pydantic import Field

from exchange.channel.link import LinkModel, Transmission
from exchange.channel.models import (
    ChannelModel,
    Deployment,
    LinkFileError,
    LinkFileGoneError,
    SettingFault,
    hash_of,
    number_in,
)

ROUNDING_S = 0.001
"""Tolerance (s) by which a row takes effect early, for times rounded by the writer."""
KEYS = ("time_s", "sender", "receiver")
OUTCOMES = {"0": 0.0, "1": 1.0, "false": 0.0, "true": 1.0}
KINDS = "a CSV file"


@dataclass(frozen=True, slots=True)
class LossSeries:
    """Loss of one directed link: ``per[i]`` from ``times_s[i]`` on."""

    times_s: tuple[float, ...]
    per: tuple[float, ...]

    def at(self, time_s: float) -> float:
        """Return the loss probability at a time.

        >>> LossSeries((0.0, 10.0), (1.0, 0.0)).at(9.9)
        1.0
        """
        return self.per[max(0, bisect_right(self.times_s, time_s + ROUNDING_S) - 1)]

    def mean(self, until_s: float) -> float:
        """Return the mean over the time from 0 to ``until_s``."""
        if until_s <= 0.0:
            return self.per[0]
        # The first row holds from the start on.
        begins_s = (0.0, *self.times_s[1:], until_s)
        held_s = [end - begin for begin, end in pairwise(begins_s)]
        return math.fsum(p * time_s for p, time_s in zip(self.per, held_s, strict=True)) / until_s


@dataclass(frozen=True, slots=True)
class Trace:
    """Loss series by (sender, receiver), and the end of the trace (s)."""

    links: Mapping[tuple[str, str], LossSeries]
    until_s: float

    @property
    def gaps_s(self) -> list[float]:
        """Times between successive rows of a link (s)."""
        return [end - begin for series in self.links.values() for begin, end in pairwise(series.times_s)]


@dataclass(frozen=True, slots=True)
class TraceLinks:
    """Links as recorded; with ``repeat`` the trace restarts after its end."""

    series: Mapping[tuple[int, int], LossSeries]
    until_s: float
    repeat: bool

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """Return the loss of the link at the start of the packet."""
        time_s = packet.start_s
        if self.repeat and self.until_s > 0.0:
            time_s %= self.until_s
        return self.series[packet.sender, receiver].at(time_s)


class TraceChannel(ChannelModel):
    """Channel model that replays the recorded losses of each link."""

    title = "losses of each link as recorded in channel.file: outcomes, or rates over time"

    file: str = Field("", description="trace: CSV file of the columns time_s, sender, receiver, lost or per")
    repeat: bool = Field(False, description="trace: restart when the file has ended")
    sha256: str = Field(
        "",
        description="trace, network: hash of the file, recorded in results; another file under its name is refused",
    )

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Return the recorded links, by node numbers of this fleet."""
        trace, nodes = trace_of(self.file, self.sha256), deployment.nodes
        series = {(nodes[sender], nodes[receiver]): link for (sender, receiver), link in trace.links.items()}
        return TraceLinks(series, trace.until_s, self.repeat)

    def mean_per(self, deployment: Deployment) -> float:
        """Return the mean loss probability over the duration and links of the file."""
        trace = trace_of(self.file, self.sha256)
        return math.fsum(series.mean(trace.until_s) for series in trace.links.values()) / len(trace.links)

    def misfits(self, deployment: Deployment) -> Iterator[SettingFault]:
        """Yield a fault for a missing or unreadable file, or one that does not fit the fleet or the duration."""
        if not self.file:
            yield SettingFault("file", "", f"missing: {KINDS} of {', '.join(KEYS)}, and lost or per")
            return
        try:
            trace = trace_of(self.file, self.sha256)
            misfit = _misfit(trace, deployment, self.repeat)
        except LinkFileError as error:
            # With a hash, the settings are of results: these stay readable without the file, only a new run fails.
            is_gone = isinstance(error, LinkFileGoneError) and self.sha256
            misfit = "" if is_gone else str(error)
        if misfit:
            yield SettingFault("file", f'"{self.file}"', misfit)


def _misfit(trace: Trace, deployment: Deployment, repeat: bool) -> str:
    fleet = list(deployment.nodes)
    others = sorted({name for link in trace.links for name in link} - deployment.nodes.keys())
    if others:
        return f"names the vehicle {', '.join(others)}; the scenario has {', '.join(fleet)}: rename it in one of them"
    missing = [
        (sender, other) for sender in fleet for other in fleet if sender != other and (sender, other) not in trace.links
    ]
    if missing:
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        return f"has no row of the link from {missing[0][0]} to {missing[0][1]}{more}: every link needs at least one"
    start_s = min(series.times_s[0] for series in trace.links.values())
    # A longer pause than any in the trace: its times count from elsewhere.
    if start_s > max(trace.gaps_s, default=0.0):
        return f"begins at {start_s:g} s: subtract that from time_s, which counts from the start of the run"
    if trace.until_s < deployment.duration_s and not repeat:
        return (
            f"ends at {trace.until_s:g} s, the run at {deployment.duration_s:g} s: "
            "set scenario.duration_s to that at most, or channel.repeat = true"
        )
    return ""


def trace_of(file: str, sha256: str = "") -> Trace:
    """Return the trace of a CSV file with the hash ``sha256``, if given.

    Raises LinkFileGoneError for a missing file or another hash, LinkFileError for invalid content.
    """
    return _read(file, hash_of(file, KINDS, sha256))


@lru_cache(maxsize=16)  # a file of megabytes, read by each check and run
def _read(file: str, sha256: str) -> Trace:
    losses: dict[tuple[str, str], dict[float, float]] = {}
    try:
        reader = csv.DictReader(Path(file).read_text(encoding="utf-8-sig").splitlines(), restval="")
        reader.fieldnames = names = [name.strip() for name in reader.fieldnames or ()]
        kind = "lost" if "lost" in names else "per"
        if not {*KEYS, kind} <= {*names} or {"lost", "per"} <= {*names}:
            raise LinkFileError(
                f"has the columns {', '.join(names) or 'none'}; needed are {', '.join(KEYS)} and lost or per"
            )
        for row in reader:
            where, values = f"line {reader.line_num}", [row[name].strip() for name in (*KEYS, kind)]
            time_s, sender, receiver, per = _checked(where, kind, *values)
            if time_s in (of_link := losses.setdefault((sender, receiver), {})):
                raise LinkFileError(f"{where}: a second row from {sender} to {receiver} at {time_s:g} s")
            of_link[time_s] = per
    except (UnicodeDecodeError, csv.Error) as error:
        raise LinkFileError(f"is no CSV: {error}") from None
    if not losses:
        raise LinkFileError("has no rows")
    links = {link: LossSeries(*zip(*sorted(of_link.items()), strict=True)) for link, of_link in sorted(losses.items())}
    trace = Trace(links, max(series.times_s[-1] for series in links.values()))
    from statistics import median

    # The last row holds as long as a usual one; the median ignores pauses.
    return replace(trace, until_s=trace.until_s + median(trace.gaps_s or [0.0]))


def _checked(
    where: str, kind: str, time: str, sender: str, receiver: str, outcome: str
) -> tuple[float, str, str, float]:
    if not sender or not receiver or sender == receiver:
        raise LinkFileError(f"{where}: from {sender!r} to {receiver!r} is no link of two vehicles")
    time_s = number_in(time)
    if not 0.0 <= time_s < math.inf:
        raise LinkFileError(f"{where}: time_s = {time!r} must be a number of seconds, 0 or more")
    per = OUTCOMES.get(outcome.lower(), math.nan) if kind == "lost" else number_in(outcome)
    if not 0.0 <= per <= 1.0:
        allowed = "0 or 1" if kind == "lost" else "a number from 0 to 1"
        raise LinkFileError(f"{where}: {kind} = {outcome!r} must be {allowed}")
    return time_s, sender, receiver, per
