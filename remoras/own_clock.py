"""A vehicle's own clock, which may be off and drift; the fleet's heap alone knows the true time.

A clock shows ``t + offset + drift * t + correction`` at the true time ``t``, and never less than 0, when the mission
begins by it. All that a vehicle does by time goes by what its clock shows: its slots, the times of its observations,
what it makes of arrivals, leases. Rows of its tables have the true time, so that vehicles can be compared.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from remoras.recorder import TIME, VEHICLE, Column, Recorder, Row, Table

if TYPE_CHECKING:
    from collections.abc import Mapping

CLOCKS = Table("clocks", (
    TIME, VEHICLE, Column("offset_s", "float", "s"), Column("peers", "list"), Column("estimates_s", "floats", "s"),
))  # fmt: skip
"""How far the clock of a vehicle is off the true time, at the end of every TDMA frame, and by how much it takes itself
to be ahead of each of ``peers``; written where the scenario has clocks."""
PPM = 1e-6


@dataclass(slots=True)
class OwnClock:
    """The clock of one vehicle.

    Attributes:
        offset_s: by how much it is ahead at the true time 0.
        drift_ppm: by how much it gains, in millionths.
        correction_s: by which its vehicle has set it since.
        true_s: true time at which it was read last; only the fleet and its records look at it.

    >>> clock = OwnClock(offset_s=0.5, drift_ppm=100.0)
    >>> clock.reads(10_000.0), round(clock.true_time_s(10_001.5), 9)
    (10001.5, 10000.0)
    """

    offset_s: float = 0.0
    drift_ppm: float = 0.0
    correction_s: float = 0.0
    true_s: float = 0.0

    def reads(self, true_s: float) -> float:
        """What it shows at a true time (s)."""
        self.true_s = true_s
        return max(0.0, true_s + self.ahead_s(true_s))

    def ahead_s(self, true_s: float) -> float:
        """By how much it is ahead at a true time (s)."""
        return self.offset_s + PPM * self.drift_ppm * true_s + self.correction_s

    def true_time_s(self, shown_s: float) -> float:
        """The true time at which it shows a time (s), with the corrections made so far."""
        return (shown_s - self.offset_s - self.correction_s) / (1.0 + PPM * self.drift_ppm)

    def set_by(self, by_s: float) -> None:
        """Put it forward by that much (s); back if it is negative."""
        self.correction_s += by_s

    @property
    def is_exact(self) -> bool:
        """True if it shows the true time, and always will."""
        return self.offset_s == self.drift_ppm == self.correction_s == 0.0


class _AtTrueTime(list[Row]):
    """Takes the rows of a table and hands them on with the true time in place of what the own clock shows."""

    def __init__(self, rows: list[Row], column: int, clock: OwnClock) -> None:
        super().__init__()
        self._handed_on = rows
        self._column = column
        self._clock = clock

    def append(self, row: Row) -> None:
        """Hand on a row."""
        self._handed_on.append((*row[: self._column], self._clock.true_s, *row[self._column + 1 :]))

    def extend(self, rows: Iterable[Row]) -> None:
        """Hand on rows."""
        for row in rows:
            self.append(row)


NOW: Mapping[str, str] = {"items": "recorded_s"}
"""Columns that have the time of writing, where that is not the first column of ``TIME``."""


class RecorderByClock(Recorder):
    """Takes the rows of a vehicle whose clock may be off; they get the true time.

    Args:
        recorder: of the whole fleet, which gets the rows.
        clock: of the vehicle.
    """

    def __init__(self, recorder: Recorder, clock: OwnClock) -> None:
        self._recorder = recorder
        self._clock = clock
        super().__init__(recorder.tables.values())
        self.bits = recorder.bits

    def declare(self, table: Table) -> None:
        """Take rows of another table, too."""
        self._recorder.declare(table)
        self.tables.setdefault(table.name, table)
        rows, now = self._recorder.rows(table.name), NOW.get(table.name, TIME.name)
        if now in table.column_names:
            rows = _AtTrueTime(rows, table.column_names.index(now), self._clock)
        self._rows.setdefault(table.name, rows)
