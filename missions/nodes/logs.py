"""Logs of a node, and their replay without a modem, which reproduces its packets bit by bit.

A log is a text file with one JSON object per line, flushed to disk line by line:

* ``{"log": "remoras node", "version": ..., "plan": {...}, "began": {...}}`` first: all inputs of the vehicle and the
  start of its mission as Unix time;
* ``{"kind": "salt", ...}``: salt of the process, only with an encryption key;
* ``{"kind": "sent", "time_s": ..., "data": HEX}``: own packet, with the start of its slot;
* ``{"kind": "heard", ...}``: received packet with its reception time; a duplicate has two lines;
* ``{"kind": "fix", ...}``: position fix of a real body, see ``missions.nodes.frontseat``;
* ``{"kind": "lost", ...}``: packet dropped at this receiver by a random draw; a replay ignores it;
* ``{"kind": "back", "time_s": ..., "data": ...}``: restart of a terminated node, off since the previous line. With a
  key, ``data`` is a new salt, so that two nodes resumed from copies of one log share none;
* ``{"kind": "end", "time_s": ..., "state_hash": ...}`` last, unless the node was killed.
"""

from __future__ import annotations

import json
import math
import os
import struct
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple

from exchange.drivers import Paced
from missions.disk import MANIFEST
from missions.errors import ConfigurationError, OutputError, writing
from missions.files import text_of
from missions.nodes.alone import LoneVehicle, NodePlan, Pause, alone
from missions.nodes.frontseat import Fix, placed
from remoras.fleet.standalone import Sent, just_after
from remoras.version import __version__

FORMAT = "remoras node"
ENDING = ".jsonl"


class LineKind(StrEnum):
    """Kinds of lines."""

    SALT = "salt"
    SENT = "sent"
    HEARD = "heard"
    LOST = "lost"
    FIX = "fix"
    BACK = "back"
    END = "end"


class LogEntry(NamedTuple):
    """Logged event: a packet, a fix, or a salt at a start or restart."""

    kind: LineKind
    time_s: float
    data: bytes


def refuse_written(folder: Path, plan: NodePlan) -> Path:
    """Return the log file of a plan; raises OutputError if it exists, or the folder has the results of a run."""
    if (folder / MANIFEST).is_file():
        raise OutputError(f"--out {folder}: holds the results of a run; name another folder")
    path = folder / f"{plan.vehicle}{ENDING}"
    if path.exists():
        raise OutputError(f"{path}: is there already; name another folder by --out")
    return path


class Began(NamedTuple):
    """Start of a mission by Unix time (s); ``speed`` is in seconds of the mission per second."""

    unix_s: float
    speed: float

    @classmethod
    def of(cls, pace: Paced) -> Began:
        """Convert the start by ``time.monotonic``, which restarts with the machine."""
        return cls(time.time() - (time.monotonic() - pace.start_s), pace.speed)

    @property
    def pace(self) -> Paced:
        """Pace of the mission by the current ``time.monotonic``."""
        return Paced(time.monotonic() - (time.time() - self.unix_s), self.speed)


class NodeLog:
    """Log being written to a new file in ``folder``; raises OutputError if it exists or is not writable."""

    def __init__(self, folder: Path, plan: NodePlan, began: Began) -> None:
        self.path = refuse_written(folder, plan)
        with writing(self.path):
            folder.mkdir(parents=True, exist_ok=True)
            self._file = self.path.open("x", encoding="utf-8")
        self._line({"log": FORMAT, "version": __version__, "plan": asdict(plan), "began": began._asdict()})

    @classmethod
    def going_on(cls, path: Path) -> NodeLog:
        """Reopen a log after its last complete line; raises OutputError if not writable."""
        log = cls.__new__(cls)
        log.path = path
        with writing(path):
            whole = path.read_bytes()
            log._file = path.open("r+", encoding="utf-8")
            # A killed node may leave half a line, which would run into the next one.
            log._file.truncate(whole.rfind(b"\n") + 1)
            log._file.seek(0, os.SEEK_END)
        return log

    def write(self, entry: LogEntry) -> None:
        """Append an event."""
        self._line({"kind": entry.kind, "time_s": entry.time_s, "data": entry.data.hex()})

    def end(self, time_s: float, state_hash: str) -> None:
        """Append the end of the node."""
        self._line({"kind": LineKind.END, "time_s": time_s, "state_hash": state_hash})

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _line(self, value: dict[str, Any]) -> None:
        self._file.write(json.dumps(value) + "\n")
        self._file.flush()
        # A flushed line survives the process, a synced one also a loss of power.
        os.fsync(self._file.fileno())


@dataclass(frozen=True, slots=True)
class Logged:
    """Log that was read; ``state_hash`` is None for a killed node."""

    plan: NodePlan
    entries: tuple[LogEntry, ...]
    state_hash: str | None
    began: Began

    @property
    def salts(self) -> list[bytes]:
        """Salts of the incarnations, under a key."""
        return [entry.data for entry in self.entries if entry.kind in (LineKind.SALT, LineKind.BACK)]

    @property
    def last_s(self) -> float:
        """Time of the last event (s)."""
        return max((entry.time_s for entry in self.entries), default=self.plan.begins_s)

    @property
    def pauses(self) -> list[Pause]:
        """Periods without the process, from just after the previous line."""
        pauses, last_s = [], self.plan.begins_s
        for entry in self.entries:
            if entry.kind is LineKind.BACK:
                pauses.append((just_after(last_s), entry.time_s))
            last_s = max(last_s, entry.time_s)
        return pauses

    def of(self, kind: LineKind) -> list[LogEntry]:
        """Return the events of a kind."""
        return [entry for entry in self.entries if entry.kind is kind]


def read_log(path: Path) -> Logged:
    """Read a log, without an incomplete last line; raises ConfigurationError if invalid."""
    lines = text_of(path).split("\n")
    unfinished = lines.pop()
    if not lines:
        raise _no_log(path, 1, unfinished)
    plan, began = _first(path, lines[0])
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
                data = bytes.fromhex(value["data"])
                if kind is LineKind.FIX:
                    Fix.of(data)
                entries.append(LogEntry(kind, time_s, data))
        except (ValueError, TypeError, KeyError, struct.error):
            raise _no_log(path, number, line) from None
    return Logged(plan, tuple(entries), state_hash, began)


def _first(path: Path, line: str) -> tuple[NodePlan, Began]:
    try:
        value = json.loads(line)
        if value["log"] != FORMAT:
            raise ValueError
        began = value["began"]
        return NodePlan(**value["plan"]), Began(float(began["unix_s"]), float(began["speed"]))
    except (ValueError, TypeError, KeyError):
        raise _no_log(path, 1, line) from None


def _no_log(path: Path, number: int, line: str) -> ConfigurationError:
    allowed = "no line of a log; name a file that remoras node or remoras swarm has written with --out"
    return ConfigurationError.of(str(path), "line", line, allowed, number)


@dataclass(frozen=True, slots=True)
class Played:
    """Result of a replay; ``difference`` is the first unequal packet or final state, else empty."""

    vehicle: str
    packets_sent: int
    packets_heard: int
    state_hash: str
    difference: str


def play(log: Logged) -> Played:
    """Replay the received packets of a log and compare the sent ones."""
    plan, solo = log.plan, _hearing(log, log.pauses).solo
    received, logged = log.of(LineKind.HEARD), log.of(LineKind.SENT)
    is_whole = log.state_hash is not None
    # The log of a killed node proves nothing beyond its last packet.
    until_s = plan.end_s if is_whole else just_after(logged[-1].time_s) if logged else 0.0
    difference = next(_differences(logged, solo.advance(until_s)), "")
    state_hash = solo.vehicle.beliefs.model.state_hash()
    if is_whole and not difference and state_hash != log.state_hash:
        difference = f"state at {plan.end_s:g} s: {state_hash}, not {log.state_hash} as in the log"
    return Played(plan.vehicle, len(logged), len(received), state_hash, difference)


def gone_on(path: Path, plan: NodePlan) -> tuple[LoneVehicle, NodeLog, Paced]:
    """Resume a terminated vehicle from its log, in the state of its last line; return it with log and pace.

    The next epoch starts now. Raises ConfigurationError if the log has another plan, an end, or is not reproduced.
    """
    log = read_log(path)
    if replace(log.plan, begins_s=0.0, epoch=plan.epoch) != replace(plan, begins_s=0.0):
        raise _cannot(path, "the log of another scenario, seed or end", "the arguments of its node, or another --out")
    if log.state_hash is not None:
        raise _cannot(path, "complete: its mission has ended", "another folder by --out")
    pace = log.began.pace
    # The clock of the machine may have been put back, but mission time never decreases.
    now_s = max(pace.now_s, just_after(log.last_s))
    own, difference = back(log, now_s)
    if difference:
        raise _cannot(path, f"not reproduced by this version: {difference}", "the version that wrote it")
    going_on = NodeLog.going_on(path)
    going_on.write(LogEntry(LineKind.BACK, now_s, own.salt))
    return own, going_on, pace


def back(log: Logged, now_s: float) -> tuple[LoneVehicle, str]:
    """Return the vehicle of an unfinished log, restarted at ``now_s`` (s), and any difference."""
    off_s = just_after(log.last_s)
    own = _hearing(log, [*log.pauses, (off_s, now_s)])
    difference = next(_differences(log.of(LineKind.SENT), own.solo.advance(off_s)), "")
    if not difference:
        own.solo.advance(just_after(now_s))
    return own, difference


def _hearing(log: Logged, pauses: Sequence[Pause]) -> LoneVehicle:
    own = alone(log.plan, log.salts, pauses)
    for entry in log.entries:
        if entry.kind is LineKind.HEARD:
            own.solo.hear(entry.data, entry.time_s)
        elif entry.kind is LineKind.FIX and own.steered is not None:
            own.solo.note(placed(own.steered, Fix.of(entry.data)), entry.time_s)
    return own


def _cannot(path: Path, why: str, allowed: str) -> ConfigurationError:
    return ConfigurationError.of(str(path), "log", why, allowed)


def _differences(logged: list[LogEntry], sent: list[Sent]) -> Iterator[str]:
    for number, (old, new) in enumerate(zip(logged, sent, strict=False), start=1):
        data = new.packet.data
        if (old.time_s, old.data) != (new.time_s, data):
            yield f"packet {number}: {data.hex()} at {new.time_s!r} s, not {old.data.hex()} at {old.time_s!r} s"
    if len(sent) > len(logged):
        first = sent[len(logged)]
        yield f"packet {len(logged) + 1}: {first.packet.data.hex()} at {first.time_s!r} s, where the log has none"
    if len(logged) > len(sent):
        yield f"packet {len(sent) + 1}: none, where the log has one at {logged[len(sent)].time_s!r} s"
