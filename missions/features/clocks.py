"""Vehicle clocks, ``[communication.clocks]`` and ``[vehicle.clock]``: offset and drift.

At true time ``t`` a clock shows ``t + offset + drift * t + correction``, at least 0, the start of the mission. A
vehicle uses its clock for slots, observation times, arrivals and leases.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from statistics import median
from typing import TYPE_CHECKING

from pydantic import Field

from exchange.arithmetic import distance, length
from exchange.channel import loss
from missions.feature import Feature, Joining
from remoras.events import Host, Observer
from remoras.recorder import TIME, VEHICLE, Column, Recorder, Row, Table
from remoras.table import Section

if TYPE_CHECKING:
    from exchange.packets import Reception
    from missions.scenarios.scenario import Scenario
    from remoras.fleet.vehicle import Vehicle

KEY, OF_VEHICLE = "clocks", "clock"
PPM = 1e-6
OFFSET, DRIFT = range(2)  # keys of the draws, in place of the receiver
MOST_OFF_S, MOST_DRIFT_PPM = 86_400.0, 10_000.0  # bounds on offset (a day) and on drift (1 %)


class ClocksTable(Section):
    """The table ``[communication.clocks]``."""

    offset_s: float = Field(
        0.0,
        ge=0.0,
        le=MOST_OFF_S,
        description="largest offset of a clock at the start, drawn uniformly once per run",
    )
    drift_ppm: float = Field(
        0.0,
        ge=0.0,
        le=MOST_DRIFT_PPM,
        description="largest drift of a clock (ppm), drawn uniformly once per run",
    )
    apart_s: float = Field(
        0.0,
        ge=0.0,
        le=MOST_OFF_S,
        description="largest difference of two clocks that slots tolerate: guard and clock tolerances cover it",
    )
    discipline: bool = Field(False, description="vehicles adjust their clocks by arrival times of packets, one way")


class VehicleClockTable(Section):
    """The table ``[vehicle.clock]``; a value given here replaces the drawn one."""

    offset_s: float | None = Field(None, ge=-MOST_OFF_S, le=MOST_OFF_S, description="clock offset at the start")
    drift_ppm: float | None = Field(None, ge=-MOST_DRIFT_PPM, le=MOST_DRIFT_PPM, description="drift (ppm)")


CLOCKS = Table("clocks", (
    TIME, VEHICLE, Column("offset_s", "float", "s"), Column("peers", "list"), Column("estimates_s", "floats", "s"),
))  # fmt: skip
"""Clock error at the end of every TDMA frame, and the estimated lead over each of ``peers``."""


@dataclass(slots=True)
class OwnClock:
    """Clock of one vehicle: ``offset_s`` is the lead at true time 0, ``correction_s`` the sum of adjustments.

    ``true_s``, the true time of the last reading, is for the fleet and its records only.

    >>> clock = OwnClock(offset_s=0.5, drift_ppm=100.0)
    >>> clock.reads(10_000.0), round(clock.true_time_s(10_001.5), 9)
    (10001.5, 10000.0)
    """

    offset_s: float = 0.0
    drift_ppm: float = 0.0
    correction_s: float = 0.0
    disciplined: bool = False
    true_s: float = 0.0

    def reads(self, true_s: float) -> float:
        """Return the reading (s) at a true time (s), and record that time."""
        self.true_s = true_s
        return max(0.0, true_s + self.ahead_s(true_s))

    def ahead_s(self, true_s: float) -> float:
        """Lead (s) over the true time."""
        return self.offset_s + PPM * self.drift_ppm * true_s + self.correction_s

    def true_time_s(self, shown_s: float) -> float:
        """True time (s) for a clock reading, with present corrections."""
        return (shown_s - self.offset_s - self.correction_s) / (1.0 + PPM * self.drift_ppm)

    def set_by(self, by_s: float) -> None:
        """Adjust the clock by ``by_s``, negative to put it back."""
        self.correction_s += by_s

    def recording(self, recorder: Recorder) -> Recorder:
        """Return a recorder that replaces the clock's time by the true time in each row."""
        # Rows of all vehicles carry the true time, so that they can be compared.
        return recorder if self.is_exact and not self.disciplined else RecorderByClock(recorder, self)

    @property
    def is_exact(self) -> bool:
        """True without offset, drift or correction."""
        return self.offset_s == self.drift_ppm == self.correction_s == 0.0


class _AtTrueTime(list[Row]):
    def __init__(self, rows: list[Row], column: int, clock: OwnClock) -> None:
        super().__init__()
        self._handed_on = rows
        self._column = column
        self._clock = clock

    def append(self, row: Row) -> None:
        self._handed_on.append((*row[: self._column], self._clock.true_s, *row[self._column + 1 :]))

    def extend(self, rows: Iterable[Row]) -> None:
        for row in rows:
            self.append(row)


NOW: Mapping[str, str] = {"items": "recorded_s"}  # tables whose time of writing is not in the column ``TIME``


class RecorderByClock(Recorder):
    """Recorder for the fleet's tables that converts the rows of one vehicle to true time."""

    def __init__(self, recorder: Recorder, clock: OwnClock) -> None:
        self._recorder = recorder
        self._clock = clock
        super().__init__(recorder.tables.values())
        self.bits = recorder.bits

    def declare(self, table: Table) -> None:
        """Accept rows of another table, with times by the clock of the vehicle."""
        self._recorder.declare(table)
        self.tables.setdefault(table.name, table)
        rows, now = self._recorder.rows(table.name), NOW.get(table.name, TIME.name)
        if now in table.column_names:
            rows = _AtTrueTime(rows, table.column_names.index(now), self._clock)
        self._rows.setdefault(table.name, rows)


LARGEST_STEP = 0.25  # largest adjustment as a share of a slot, so that no slot is skipped
SMALLEST_STEP_S = 1e-3  # smaller differences are left: the known positions are not more precise


ARRIVALS = 9
LEAST_ARRIVALS = 3


class Offsets:
    """Lead of one vehicle's clock over each peer's, estimated from arrival times.

    A packet of duration L over distance d is complete at t + L + d/c, with t the start of its slot by the sender's
    clock. The lead is the excess of the own clock over this time. Distances come from believed positions: 15 m of error
    make 10 ms at c = 1500 m/s. The median suppresses single wrong positions and indirect paths.
    """

    def __init__(self, n_nodes: int) -> None:
        self._leads_s: list[deque[float]] = [deque(maxlen=ARRIVALS) for _ in range(n_nodes)]

    def note(self, peer: int, lead_s: float) -> None:
        """Record the lead shown by one arrival."""
        self._leads_s[peer].append(lead_s)

    def estimate_s(self, peer: int) -> float | None:
        """Return the lead over a peer's clock; None below ``LEAST_ARRIVALS``."""
        leads_s = self._leads_s[peer]
        return median(leads_s) if len(leads_s) >= LEAST_ARRIVALS else None

    def correction_s(self) -> float:
        """Return the clock correction: half the way to the median of all clocks, own included."""
        known = [offset_s for peer in range(len(self._leads_s)) if (offset_s := self.estimate_s(peer)) is not None]
        # By the median a single wrong clock converges to the others; half the way, since peers correct as well.
        return -median([0.0, *known]) / 2.0

    def shift(self, by_s: float) -> None:
        """Correct all leads after the own clock was advanced."""
        for leads_s in self._leads_s:
            for k in range(len(leads_s)):
                leads_s[k] += by_s


# Scenario settings ------------------------------------------------------------------------------


def apart_s(scenario: Scenario) -> float:
    """Greatest difference (s) between two clocks that guard and tolerances cover."""
    return _spread(scenario).apart_s


def _spread(scenario: Scenario) -> ClocksTable:
    table: ClocksTable | None = scenario.communication.of_feature(KEY)
    return table or ClocksTable()


def _own(scenario: Scenario) -> dict[int, VehicleClockTable]:
    return {
        vehicle.slot: clock for vehicle in scenario.vehicle if (clock := vehicle.of_feature(OF_VEHICLE)) is not None
    }


def most_ahead_s(scenario: Scenario) -> float:
    """Upper bound (s) on the lead of any clock in a run, corrections included."""
    spread, duration_s = _spread(scenario), scenario.scenario.duration_s
    ahead_s = []
    for clock in (VehicleClockTable(), *_own(scenario).values()):
        offset_s = spread.offset_s if clock.offset_s is None else clock.offset_s
        drift_ppm = spread.drift_ppm if clock.drift_ppm is None else clock.drift_ppm
        ahead_s.append(offset_s + PPM * drift_ppm * duration_s)
    return max(0.0, *ahead_s) + apart_s(scenario)


def clocks_of(scenario: Scenario, seed: int) -> dict[int, OwnClock]:
    """Return the clocks by node; draws are keyed by ``seed`` and node in a separate stream."""
    spread, own, clocks = _spread(scenario), _own(scenario), {}
    for table in sorted(scenario.vehicle, key=lambda vehicle: vehicle.slot):
        clock = own.get(table.slot, VehicleClockTable())
        clocks[table.slot] = OwnClock(
            _drawn(seed, table.slot, OFFSET, spread.offset_s) if clock.offset_s is None else clock.offset_s,
            _drawn(seed, table.slot, DRIFT, spread.drift_ppm) if clock.drift_ppm is None else clock.drift_ppm,
            disciplined=spread.discipline,
        )
    return clocks


def _drawn(seed: int, node: int, draw: int, spread: float) -> float:
    return spread * (2.0 * loss.uniform(seed, loss.CLOCKS, 0, node, draw) - 1.0) if spread else 0.0


# Run hooks --------------------------------------------------------------------------------------


class Clocks(Observer):
    """Run hooks that give each vehicle a clock and let it compare the clock with its peers', from packet arrivals."""

    def __init__(self, joining: Joining) -> None:
        joining.recorder.declare(CLOCKS)
        self._joining = joining
        self._offsets: dict[int, Offsets] = {}
        self.clocks: Mapping[int, OwnClock] = clocks_of(joining.scenario, joining.seed)

    def on_start(self, host: Host) -> None:
        self._host = host

    def on_vehicle(self, vehicle: Vehicle) -> None:
        self._offsets[vehicle.data.node] = Offsets(len(self._joining.database))

    def on_received(self, vehicle: Vehicle, reception: Reception, size_bits: int, shown_s: float) -> None:
        """Update the estimate for the sender from the arrival time, if its position is known."""
        joining, functional = self._joining, vehicle.functional
        sender = joining.database[joining.database.names[reception.sender]]
        peer_m = functional.picture.peers.positions_m.get(sender.name)
        if peer_m is None:
            return
        away_m = distance(functional.believed.position_m, peer_m)
        range_m = length(away_m, joining.database[vehicle.name].depth_m - sender.depth_m)
        sent_s = shown_s - joining.packet_s(size_bits) - range_m / joining.scenario.sound_speed_mps
        self._offsets[vehicle.data.node].note(reception.sender, sent_s - joining.schedule.start_s(reception.slot))

    def on_frame_end(self, vehicle: Vehicle) -> None:
        if not vehicle.is_alive:
            return
        clock, offsets = self.clocks[vehicle.data.node], self._offsets[vehicle.data.node]
        estimates_s = {name: offsets.estimate_s(node) for node, name in enumerate(self._joining.database.names)}
        known_s = {name: lead_s for name, lead_s in estimates_s.items() if lead_s is not None}
        row = clock.true_s, vehicle.name, clock.ahead_s(clock.true_s), list(known_s), list(known_s.values())
        self._joining.recorder.rows(CLOCKS.name).append(row)

    def on_slot(self, vehicle: Vehicle) -> None:
        """Correct a disciplined clock by a limited step, and reschedule the vehicle's slot."""
        clock, offsets = self.clocks[vehicle.data.node], self._offsets[vehicle.data.node]
        if not clock.disciplined:
            return
        most_s = LARGEST_STEP * self._joining.schedule.slot_s
        by_s = max(-most_s, min(most_s, offsets.correction_s()))
        if abs(by_s) >= SMALLEST_STEP_S:
            clock.set_by(by_s)
            offsets.shift(by_s)
            self._host.await_slot(vehicle.data.node)


def observer_of(joining: Joining) -> Clocks | None:
    """Return the run hooks; None for a single-vehicle process."""
    # A single-vehicle process runs by the clock of its machine.
    return None if joining.is_alone else Clocks(joining)


FEATURE = Feature(
    {
        "communication": {
            KEY: (
                ClocksTable | None,
                Field(None, description="clock errors of vehicles; none if absent"),
            )
        },
        "vehicle": {
            OF_VEHICLE: (
                VehicleClockTable | None,
                Field(None, description="clock error; drawn if absent"),
            )
        },
    },
    observer_of,
    apart_s=apart_s,
    ahead_s=most_ahead_s,
)
