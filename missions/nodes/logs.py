"""Logs of a node, and how they are played: the same vehicle, the same packets, without a modem.

A log is a text file of one JSON object a line, each written at once:

* ``{"log": "remoras node", "version": ..., "plan": {...}}`` first, with all that the vehicle follows from;
* ``{"kind": "salt", ...}`` under a key, with the salt that the process drew;
* ``{"kind": "sent", "time_s": ..., "data": HEX}`` for a packet of its own, with the time at which its slot opened;
* ``{"kind": "heard", ...}`` for one of others, with the time at which it was heard, twice for one heard twice;
* ``{"kind": "lost", ...}`` for one that was drawn to be lost here; playing passes it over;
* ``{"kind": "end", "time_s": ..., "state_hash": ...}`` last, unless the node was killed.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple

from missions.errors import ConfigurationError, ConfigurationFault, OutputError
from missions.files import text_of
from missions.nodes.alone import NodePlan, alone
from remoras.solo import Sent, just_after
from remoras.version import __version__

FORMAT = "remoras node"
"""Value of ``log`` in the first line."""
ENDING = ".jsonl"
"""Ends the name of a log; before it stands that of its vehicle."""


class LineKind(StrEnum):
    """What a line is about."""

    SALT = "salt"
    SENT = "sent"
    HEARD = "heard"
    LOST = "lost"
    END = "end"


class LogEntry(NamedTuple):
    """A packet of a log, or the salt of its packets."""

    kind: LineKind
    time_s: float
    data: bytes


def refuse_written(folder: Path, plan: NodePlan) -> Path:
    """The file that the log of a plan is to be written to; raises OutputError if it is there already."""
    path = folder / f"{plan.vehicle}{ENDING}"
    if path.exists():
        raise OutputError(f"{path}: is there already; name another folder by --out")
    return path


class NodeLog:
    """A log that is being written.

    Args:
        folder: that it is written to, made if it is not there; its name is that of the vehicle.
        plan: what the vehicle follows from.

    Raises:
        OutputError: the file is there already, or cannot be written.
    """

    def __init__(self, folder: Path, plan: NodePlan) -> None:
        self.path = refuse_written(folder, plan)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._file = self.path.open("x", encoding="utf-8")
        except OSError as error:
            raise OutputError(f"{self.path}: cannot be written: {error.strerror}") from None
        self._line({"log": FORMAT, "version": __version__, "plan": asdict(plan)})

    def write(self, entry: LogEntry) -> None:
        """Add a packet."""
        self._line({"kind": entry.kind, "time_s": entry.time_s, "data": entry.data.hex()})

    def end(self, time_s: float, state_hash: str) -> None:
        """Say how the node ended."""
        self._line({"kind": LineKind.END, "time_s": time_s, "state_hash": state_hash})

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _line(self, value: dict[str, Any]) -> None:
        self._file.write(json.dumps(value) + "\n")
        self._file.flush()


@dataclass(frozen=True, slots=True)
class Logged:
    """A log that was read.

    Attributes:
        plan: what the vehicle followed from.
        entries: its packets in order.
        state_hash: at the end; None for a node that was killed.
    """

    plan: NodePlan
    entries: tuple[LogEntry, ...]
    state_hash: str | None


def read_log(path: Path) -> Logged:
    """The log of a file; a last line that a killed node has not finished is passed over.

    Raises:
        ConfigurationError: it cannot be read, or is no log.
    """
    lines = text_of(path).split("\n")
    unfinished = lines.pop()
    if not lines:
        raise _no_log(path, 1, unfinished)
    plan = _plan(path, lines[0])
    entries: list[LogEntry] = []
    state_hash = None
    for number, line in enumerate(lines[1:], start=2):
        try:
            value = json.loads(line)
            kind, time_s = LineKind(value["kind"]), float(value["time_s"])
            if not math.isfinite(time_s):
                raise ValueError
            if kind is LineKind.END:
                state_hash = str(value["state_hash"])
            else:
                entries.append(LogEntry(kind, time_s, bytes.fromhex(value["data"])))
        except (ValueError, TypeError, KeyError):
            raise _no_log(path, number, line) from None
    return Logged(plan, tuple(entries), state_hash)


def _plan(path: Path, line: str) -> NodePlan:
    try:
        value = json.loads(line)
        if value["log"] != FORMAT:
            raise ValueError
        return NodePlan(**value["plan"])
    except (ValueError, TypeError, KeyError):
        raise _no_log(path, 1, line) from None


def _no_log(path: Path, number: int, line: str) -> ConfigurationError:
    allowed = "no line of a log; name a file that remoras node or remoras swarm has written with --out"
    return ConfigurationError(str(path), [ConfigurationFault("line", line, allowed, number)])


@dataclass(frozen=True, slots=True)
class Played:
    """What came of playing a log.

    Attributes:
        vehicle: its name.
        packets_sent, packets_heard: in the log.
        state_hash: of the world model at the end.
        difference: the first packet that differs, or the state at the end, in words; empty if all is the same.
    """

    vehicle: str
    packets_sent: int
    packets_heard: int
    state_hash: str
    difference: str


def play(log: Logged) -> Played:
    """Let the vehicle of a log hear again what it heard, and compare what it says.

    Raises:
        ConfigurationError: this version cannot read the scenario in the log.
    """
    salt = next((entry.data for entry in log.entries if entry.kind is LineKind.SALT), None)
    plan, solo = log.plan, alone(log.plan, salt).solo
    heard = [entry for entry in log.entries if entry.kind is LineKind.HEARD]
    logged = [entry for entry in log.entries if entry.kind is LineKind.SENT]
    for entry in heard:
        solo.hear(entry.data, entry.time_s)
    is_whole = log.state_hash is not None
    until_s = plan.end_s if is_whole else just_after(logged[-1].time_s) if logged else 0.0
    difference = next(_differences(logged, solo.advance(until_s)), "")
    state_hash = solo.vehicle.beliefs.model.state_hash()
    if is_whole and not difference and state_hash != log.state_hash:
        difference = f"state at {plan.end_s:g} s: {state_hash}, not {log.state_hash} as in the log"
    return Played(plan.vehicle, len(logged), len(heard), state_hash, difference)


def _differences(logged: list[LogEntry], said: list[Sent]) -> Iterator[str]:
    """Packets that differ, in words."""
    for number, (old, new) in enumerate(zip(logged, said, strict=False), start=1):
        data = new.packet.data
        if (old.time_s, old.data) != (new.time_s, data):
            yield f"packet {number}: {data.hex()} at {new.time_s!r} s, not {old.data.hex()} at {old.time_s!r} s"
    if len(said) > len(logged):
        first = said[len(logged)]
        yield f"packet {len(logged) + 1}: {first.packet.data.hex()} at {first.time_s!r} s, where the log has none"
    if len(logged) > len(said):
        yield f"packet {len(said) + 1}: none, where the log has one at {logged[len(said)].time_s!r} s"
