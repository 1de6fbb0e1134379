"""Reception and age of information, from the tables of packets and of knowledge.

The age of a vehicle's information on a peer counts from the sending time of the last packet received from it; before
the first packet, from the start of the mission. It is undefined while either is out of the mission.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from missions.figure import RunResults, round_up, run_end_s
from missions.spans import Span
from visualisation import run_records
from visualisation.run_records import HEARD, UNREACHED, Floats, Ints, array, outages, packet_outcomes

Flags = NDArray[np.bool_]

WORST_FRAMES = 10  # age of information, in TDMA frames, that is drawn black
HUNDREDTHS = 100  # columns of a run without slots


@dataclass(frozen=True)
class RunPackets:
    """All packets of a run: senders as indices into ``vehicles`` (scenario order), ``out`` spans out of the mission.

    ``outcome`` is by packet (row) and vehicle (column), as of ``packet_outcomes``. ``is_tdma`` is False for a recording
    of programs that sent at any time.
    """

    vehicles: tuple[str, ...]
    time_s: Floats
    slot: Ints
    sender: Ints
    outcome: Ints
    end_s: float
    out: Mapping[str, Sequence[Span]] = field(default_factory=dict)
    is_tdma: bool = True

    @property
    def lost_shares(self) -> Floats:
        """Share of packets lost by receiver (row) and sender (column); NaN without packets."""
        return self.shares_lost(lambda packet, receiver: (receiver, self.sender[packet]), (len(self.vehicles),) * 2)

    def shares_lost(self, place: Callable[[Ints, Ints], tuple[Ints, ...]], shape: tuple[int, ...]) -> Floats:
        """Return the share of receptions that failed at each place of an array; NaN without packets.

        ``place`` returns the indices of receptions from those of their packets and receivers.
        """
        packet, receiver = np.nonzero(self.outcome != UNREACHED)
        places, failed = place(packet, receiver), self.outcome[packet, receiver] != HEARD
        lost, all_sent = np.zeros(shape), np.zeros(shape)
        np.add.at(lost, places, failed)
        np.add.at(all_sent, places, 1.0)
        shares: Floats = np.divide(lost, all_sent, out=np.full(shape, np.nan), where=all_sent > 0)
        return shares

    def ages_s(self, at_s: Floats) -> Floats:
        """Return ages of information by receiver, sender and time; NaN while either is absent."""
        n = len(self.vehicles)
        ages = np.full((n, n, at_s.size), np.nan)
        for receiver, sender in permutations(range(n), 2):
            sent_s = self._news_s(receiver, sender)
            ages[receiver, sender] = at_s - sent_s[np.searchsorted(sent_s, at_s, side="right") - 1]
        for vehicle, name in enumerate(self.vehicles):
            gone = is_out(self.out.get(name, ()), at_s)
            ages[vehicle, :, gone] = np.nan
            ages[:, vehicle, gone] = np.nan
        return ages

    def _news_s(self, receiver: int, sender: int) -> Floats:
        return np.concatenate([[0.0], self.time_s[(self.sender == sender) & (self.outcome[:, receiver] == HEARD)]])

    @property
    def slot_s(self) -> float:
        """Duration (s) of a slot, or without slots median interval between packets; rounded."""
        n_slots = np.diff(self.slot)
        slots_s = np.diff(self.time_s)[n_slots > 0] / n_slots[n_slots > 0]
        # A median, so that all runs of a scenario agree in spite of rounded times.
        return round(float(np.median(slots_s)), 2) if slots_s.size else 1.0

    @property
    def frames(self) -> Ints:
        """Frame number of each packet, with a slot for each vehicle; without slots, hundredth of the run."""
        if self.is_tdma:
            return self.slot // max(1, len(self.vehicles))
        return np.minimum(HUNDREDTHS * self.time_s / self.end_s, HUNDREDTHS - 1).astype(np.int64)


def is_out(gaps: Sequence[Span], at_s: Floats) -> Flags:
    """Return a flag per time: whether a vehicle with these outages is out of the mission."""
    out: Flags = np.zeros(at_s.shape, dtype=bool)
    for gap in gaps:
        out |= (gap.start_s <= at_s) & (at_s < gap.end_s)
    return out


def worst_age_s(packets: RunPackets) -> float:
    """Return the age drawn black in all runs of a scenario: ``WORST_FRAMES`` frames, rounded up."""
    return round_up(WORST_FRAMES * max(1, len(packets.vehicles)) * packets.slot_s)


def traffic(results: RunResults) -> RunPackets:
    """Return all packets of a run, except those of vehicles outside its scenario."""
    vehicles, packets = run_records.vehicle_names(results), results.table("packets")
    numbers = np.array(
        [vehicles.index(name) if name in vehicles else -1 for name in packets["sender"].to_pylist()], int
    )
    own = numbers >= 0
    return RunPackets(
        tuple(vehicles),
        array(packets["time_s"])[own],
        array(packets["slot"])[own],
        numbers[own],
        packet_outcomes(packets, results.rows("refused"), vehicles)[own],
        run_end_s(results),
        outages(results),
        results.scenario_tables.get("mission", {}).get("access") != "free",
    )


def items_lacking(results: RunResults, at_s: Floats) -> Floats:
    """Return missing items of peers by vehicle and time; NaN while out of the mission."""
    out = outages(results)
    vehicles = run_records.vehicle_names(results)
    observed: dict[str, tuple[float, str]] = {}
    received: dict[str, dict[str, float]] = {name: {} for name in vehicles}
    for row in results.rows("knowledge"):
        if row["event"] == "observed":
            observed.setdefault(row["item"], (row["time_s"], row["vehicle"]))
        elif row["event"] == "received" and row["vehicle"] in received:
            received[row["vehicle"]].setdefault(row["item"], row["time_s"])
    lacking = np.zeros((len(vehicles), at_s.size))
    for index, name in enumerate(vehicles):
        told_s = np.sort([time_s for time_s, origin in observed.values() if origin != name])
        held_s = np.sort([time_s for item, time_s in received[name].items() if item in observed])
        n_told, n_held = (np.searchsorted(times_s, at_s, side="right") for times_s in (told_s, held_s))
        lacking[index] = np.maximum(n_told - n_held, 0)
        lacking[index, is_out(out.get(name, ()), at_s)] = np.nan
    return lacking
