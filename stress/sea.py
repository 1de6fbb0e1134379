"""A channel between the vehicles and theirs: what becomes of packets under the faults of a schedule."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence

from exchange.acoustics import loss
from exchange.acoustics.channel import Arrival, Channel
from exchange.schedule import TdmaSchedule
from stress.draws import PACKETS, befalls
from stress.kinds import Family, kind_of
from stress.schedule import Schedule, StressFault

Forge = Callable[[bytes, int, int], bytes]
"""Makes another packet of one: ``forge(data, slot, draw)``."""


class RoughSea:
    """Carries packets as another channel does, and lets the faults of a schedule befall them.

    Args:
        calm: the channel of the scenario.
        schedule: whose faults befall packets.
        slots: TDMA of the fleet.
        forge: makes packets that their sender did not send.
        happened: counts packets that a kind has changed.
        node_of: nodes of the fleet by the names of its vehicles; faults of others are none of its links.

    Attributes:
        is_calm: True once nothing befalls packets any more.
    """

    def __init__(
        self,
        calm: Channel,
        schedule: Schedule,
        slots: TdmaSchedule,
        forge: Forge,
        happened: Counter[str],
        node_of: Mapping[str, int],
    ) -> None:
        self.is_calm = False
        self._calm = calm
        self._slots = slots
        self._forge = forge
        self._happened = happened
        self._seed = schedule.stress.seed
        self._faults = [
            (number, fault, node_of.get(fault.vehicle), node_of.get(fault.peer))
            for number, fault in schedule.numbered()
            if kind_of(fault.kind).family is Family.LINK and {fault.vehicle, fault.peer} <= {*node_of, ""}
        ]

    def transmit(
        self, slot: int, sender: int, data: bytes, now_s: float, positions_m: Sequence[tuple[float, float]]
    ) -> list[Arrival]:
        """Arrivals as the channel of the scenario has them, after what befalls each."""
        arrivals = self._calm.transmit(slot, sender, data, now_s, positions_m)
        holding = [] if self.is_calm else [fault for fault in self._faults if fault[1].holds(now_s)]
        for number, fault, vehicle, peer in holding:
            if fault.kind == "echo":
                if sender == vehicle and befalls(self._seed, number, slot, sender, fault.share):
                    self._happened["echo"] += 1
                    late_s = fault.slots * self._slots.slot_s
                    arrivals.append(Arrival(sender, now_s + self._slots.packet_s + late_s, data))
                continue
            changed: list[Arrival] = []
            for arrival in arrivals:
                if _is_meant(fault, sender, arrival.receiver, vehicle, peer):
                    found = self._befallen(number, fault, slot, arrival)
                    self._happened[fault.kind] += found != [arrival]
                    changed += found
                else:
                    changed.append(arrival)
            arrivals = changed
        return sorted(arrivals, key=lambda arrival: (arrival.receiver, arrival.time_s))

    def _befallen(self, number: int, fault: StressFault, slot: int, one: Arrival) -> list[Arrival]:
        """What a fault makes of one arrival."""
        if fault.kind == "partition":
            return []
        if fault.kind == "bursts":
            spell = int(slot // fault.slots)
            return [] if befalls(self._seed, number, spell, one.receiver, fault.share) else [one]
        if not befalls(self._seed, number, slot, one.receiver, fault.share):
            return [one]
        draw = int(loss.uniform(self._seed, PACKETS + 1, number & 0xFFFF, slot & 0xFFFF, one.receiver) * (1 << 30))
        later = Arrival(one.receiver, one.time_s + fault.slots * self._slots.slot_s, one.data)
        match fault.kind:
            case "loss":
                return []
            case "twice":
                return [one, later]
            case "late":
                return [later]
            case "bits":
                return [Arrival(one.receiver, one.time_s, _flipped(one.data, fault.bits, draw))]
            case "cut":
                return [Arrival(one.receiver, one.time_s, one.data[: draw % max(1, len(one.data))])]
        return [Arrival(one.receiver, one.time_s, self._forge(one.data, slot, draw))]


def _is_meant(fault: StressFault, sender: int, receiver: int, vehicle: int | None, peer: int | None) -> bool:
    """True if a fault is about this link; a partition that is not one way is about both directions."""

    def lies(from_node: int, to_node: int) -> bool:
        return vehicle in (None, from_node) and peer in (None, to_node)

    both = fault.kind == "partition" and not fault.one_way
    return lies(sender, receiver) or (both and lies(receiver, sender))


def _flipped(data: bytes, bits: int, draw: int) -> bytes:
    """The bytes with so many bits turned, at different places."""
    damaged, n_bits = bytearray(data), 8 * len(data)
    for bit in range(min(bits, n_bits)):
        byte, place = divmod((draw + bit * (1 + draw % (n_bits // bits or 1))) % n_bits, 8)
        damaged[byte] ^= 128 >> place
    return bytes(damaged)
