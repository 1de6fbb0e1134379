"""After the mission the exchange goes on, until nobody has anything left to tell: all who hear each other know alike.

Vehicles stay where they are and as they are: they speak in their slots what is still open, and take in what they hear.
Nobody senses, decides, records anything new or uses energy, and faults neither begin nor end. What is heard stands in a
table of its own, so no other table, metric or truth of the mission knows of it; packets that were refused are faults.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from exchange.packets import name_of
from remoras.fleet import Fleet
from remoras.recorder import SETTLING, Recorder
from remoras.traffic import Arrives, SlotOpens
from remoras.vehicle import Vehicle

if TYPE_CHECKING:
    from exchange.acoustics.channel import Arrival


class Settled(NamedTuple):
    """How the exchange after a mission ended: how long it went on (s), and True if nothing was open then."""

    time_s: float
    complete: bool


def settle(fleet: Fleet, settle_s: float) -> Settled:
    """Let the exchange go on after the mission.

    Args:
        fleet: whose run is over; its clock goes on.
        settle_s: for how long at most.
    """
    began_s, record = fleet.now_s, Recorder()
    fleet.recorder.declare(SETTLING)
    for vehicle in fleet.vehicles:
        vehicle.radio.record_into(fleet.medium.recorder_of(vehicle.data.node, record))
    resting = _Resting(fleet, record)
    while not _is_settled(fleet):
        event = fleet.clock.next_before(began_s + settle_s)
        if event is None:
            break
        if isinstance(event, SlotOpens | Arrives):
            event.act(resting)
    complete = _is_settled(fleet)
    for vehicle in fleet.vehicles:
        vehicle.radio.record_into(fleet.recorder)
    fleet.recorder.rows(SETTLING.name).extend(record.knowledge)
    fleet.recorder.faults.extend(record.faults)
    fleet.recorder.refused.extend(record.refused)
    return Settled((fleet.now_s if complete else began_s + settle_s) - began_s, complete)


def _is_settled(fleet: Fleet) -> bool:
    """True if no vehicle that speaks has an item left that somebody lacks, who may only seem to be away.

    What it leaves to another, that one has.

    Nor has anybody given up waiting for what another one holds, or begun anew and not been heard since: then the others
    do not know yet what it lacks.
    """
    speaking = [vehicle for vehicle in fleet.vehicles if _speaks(vehicle)]
    if any(vehicle.radio.manager.n_open for vehicle in speaking):
        return False
    in_contact = [vehicle for vehicle in speaking if not (vehicle.condition.is_mute or vehicle.condition.is_deaf)]
    there = {vehicle.data.node: vehicle.radio.manager for vehicle in in_contact}
    lives = {vehicle.data.node: vehicle.beliefs.model.epoch for vehicle in in_contact}
    if any(
        not one.knows_life(peer, epoch) for node, one in there.items() for peer, epoch in lives.items() if peer != node
    ):
        return False
    lacking = {
        (node, uid)
        for manager in there.values()
        for node, uid in manager.postponed()
        if node in there and (there[node] is manager or not there[node].holds(uid))
    }
    items = {uid for _, uid in lacking}
    return not any(one.holds(uid) and (node, uid) not in lacking for node, one in there.items() for uid in items)


def _speaks(vehicle: Vehicle) -> bool:
    return vehicle.is_alive and vehicle.radio.communicates and not vehicle.social.is_silent


class _Resting:
    """A fleet whose mission is over, as the events of its traffic see it.

    Args:
        fleet: that is at rest.
        record: takes the rows of what is heard.
    """

    def __init__(self, fleet: Fleet, record: Recorder) -> None:
        self._fleet = fleet
        self._record = record

    def transmit(self, slot: int, node: int) -> None:
        """Let a vehicle say what is still open."""
        fleet, sender = self._fleet, self._fleet.vehicles[node]
        shown_s = fleet.traffic.opened(slot, sender, fleet.now_s)
        if shown_s is None or not _speaks(sender):
            return
        sent = sender.radio.manager.packet_to_send(shown_s)
        if not sender.condition.is_mute:
            fleet.traffic.carry(slot, sender, sent, fleet.vehicles, None)

    def end_frame(self, frame: int, node: int | None) -> None:
        """Nobody consults any more."""

    def deliver(self, arrival: Arrival) -> None:
        """Let a vehicle take in what it hears."""
        fleet, vehicle = self._fleet, self._fleet.vehicles[arrival.receiver]
        if not vehicle.is_alive or vehicle.condition.is_deaf:
            return
        heard = vehicle.radio.hear(arrival.data, fleet.shown_s(vehicle))
        vehicle.beliefs.note()
        for block in heard.reception.blocks:
            if block.is_status:
                origin = vehicle.beliefs.name(block.origin)
                self._record.knowledge.append((fleet.now_s, vehicle.name, name_of(block), origin, "received"))
