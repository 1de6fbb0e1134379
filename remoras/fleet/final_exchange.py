"""Exchange after the mission, until all vehicles in contact have the same knowledge.

Receptions go to a separate table, so no other table, metric or ground truth is affected.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from exchange.packets import name_of
from remoras.events import Priority
from remoras.fleet.fleet import Fleet
from remoras.recorder import SETTLING, Recorder

if TYPE_CHECKING:
    from exchange.channel.channel import Arrival


class Settled(NamedTuple):
    """End of the exchange: duration (s), and whether nothing was outstanding."""

    time_s: float
    complete: bool


def settle(fleet: Fleet, settle_s: float) -> Settled:
    """Continue the exchange after the mission for at most ``settle_s``."""
    began_s, record = fleet.now_s, Recorder()
    fleet.recorder.declare(SETTLING)
    for vehicle in fleet.vehicles:
        vehicle.radio.log.recorder = fleet.medium.recorder_of(vehicle.data.node, record)
    resting = _Resting(fleet, record)
    fleet.clock.keep(Priority.SLOT, Priority.ARRIVAL)
    while not _is_settled(fleet) and (event := fleet.clock.next_before(began_s + settle_s)) is not None:
        event(resting)
    complete = _is_settled(fleet)
    for vehicle in fleet.vehicles:
        vehicle.radio.log.recorder = fleet.recorder
    fleet.recorder.rows(SETTLING.name).extend(record.knowledge)
    fleet.recorder.faults.extend(record.faults)
    fleet.recorder.refused.extend(record.refused)
    return Settled((fleet.now_s if complete else began_s + settle_s) - began_s, complete)


def _is_settled(fleet: Fleet) -> bool:
    """Return whether no sending vehicle has an item left that a peer lacks, absent or not."""
    # Nor may a vehicle in contact lack a postponed item that another holds. Missing items of an incarnation that is
    # not known to all would be unknown.
    speaking = [vehicle for vehicle in fleet.vehicles if vehicle.exchanges]
    if any(vehicle.radio.manager.n_open for vehicle in speaking):
        return False
    in_contact = [vehicle for vehicle in speaking if not (vehicle.condition.is_mute or vehicle.condition.is_deaf)]
    managers = {vehicle.data.node: vehicle.radio.manager for vehicle in in_contact}
    lives = {vehicle.data.node: vehicle.beliefs.model.epoch for vehicle in in_contact}
    if any(
        not m.knows_life(peer, epoch) for node, m in managers.items() for peer, epoch in lives.items() if peer != node
    ):
        return False
    lacking = {
        (node, uid)
        for manager in managers.values()
        for node, uid in manager.postponed()
        if node in managers and (managers[node] is manager or not managers[node].holds(uid))
    }
    items = {uid for _, uid in lacking}
    return not any(m.holds(uid) and (node, uid) not in lacking for node, m in managers.items() for uid in items)


class _Resting:
    """Fleet after its mission, as seen by events of the remaining traffic."""

    def __init__(self, fleet: Fleet, record: Recorder) -> None:
        self._fleet = fleet
        self._record = record

    def transmit(self, slot: int, node: int) -> None:
        fleet, sender = self._fleet, self._fleet.vehicles[node]
        shown_s = fleet.traffic.opened(slot, sender, fleet.now_s)
        if shown_s is None or not sender.exchanges:
            return
        sent = sender.radio.manager.packet_to_send(shown_s)
        if not sender.condition.is_mute:
            fleet.traffic.carry(slot, sender, sent, fleet.vehicles, None)

    def deliver(self, arrival: Arrival) -> None:
        fleet, vehicle = self._fleet, self._fleet.vehicles[arrival.receiver]
        if not vehicle.is_alive or vehicle.condition.is_deaf:
            return
        packet = vehicle.radio.hear(arrival.data, fleet.shown_s(vehicle))
        vehicle.beliefs.note()
        for block in packet.reception.blocks:
            if block.is_status:
                origin = vehicle.beliefs.name(block.origin)
                self._record.knowledge.append((fleet.now_s, vehicle.name, name_of(block), origin, "received"))
