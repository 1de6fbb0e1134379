"""Invariants of the record: nothing that happened is missing in the tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from exchange.packets import ItemUid
from missions.fault import Absence, absence
from remoras.faults import OVER
from stress.invariants.seam import Heard, Moment, Scene


class WholeTables:
    """Tracks, packets, receptions, faults and roles stand in the tables as they were."""

    name = "tables"
    moment = Moment.EVENT
    not_under = frozenset[str]()

    def __init__(self) -> None:
        self._sent: set[tuple[int, str]] = set()
        self._received: Counter[tuple[str, ItemUid]] = Counter()

    def broken(self, scene: Scene) -> str | None:
        """Note what is heard during the mission; at the end compare."""
        if scene.heard is not None:
            if scene.fleet.running:
                self._note(scene, scene.heard)
            return None
        return next(self._missing(scene), None) if scene.finished is not None else None

    def _note(self, scene: Scene, heard: Heard) -> None:
        if heard.aired is not None:
            self._sent.add((heard.aired.slot, scene.fleet.vehicles[heard.aired.sender.node].name))
        if heard.reception.items and heard.reception.fault is None:
            self._received.update([(heard.vehicle.name, uid) for uid in heard.reception.items])

    def _missing(self, scene: Scene) -> Iterator[str]:
        fleet, recorder = scene.fleet, scene.fleet.recorder
        due, n_rows = len(fleet.vehicles) * fleet.steps, len(recorder.trajectories)
        if n_rows != due:
            yield f"trajectories has {n_rows} rows of {len(fleet.vehicles)} vehicles in {fleet.steps} ticks"
        for slot, sender in sorted(self._sent - {(row[0], row[2]) for row in recorder.packets}):
            yield f"packets lacks that of {sender} in slot {slot}, which was heard"
        rows = Counter((row[1], row[2]) for row in recorder.knowledge if row[4] == "received")
        received = Counter({(vehicle, str(uid)): n_times for (vehicle, uid), n_times in self._received.items()})
        wrong = received - rows
        if not scene.is_selective:  # there what was set aside is received when it comes to be needed
            wrong |= rows - received
        for vehicle, uid in sorted(wrong):
            n_rows, n_times = rows[vehicle, uid], received[vehicle, uid]
            yield f"knowledge has {n_rows} rows of {vehicle} receiving {uid}, which it did {n_times} times"
        yield from _heard(scene)
        yield from _faults(scene)
        yield from _roles(scene)


def _heard(scene: Scene) -> Iterator[str]:
    """Packets that somebody is said to have heard who was deaf or off, or whose sender was mute."""
    for fault in scene.fleet.medium.faults:
        begins_s, ends_s = fault.from_s, fault.until_s
        for row in scene.fleet.recorder.packets:
            slot, sent_s, sender, receivers, arrivals_s = row[0], row[1], row[2], row[6], row[9]
            is_out = sender == fault.vehicle and begins_s < sent_s < ends_s
            if fault.leaves.is_mute and is_out and receivers:
                yield f"packets has {receivers} hearing {sender} in slot {slot}, which was mute"
            if not fault.leaves.hears and fault.vehicle in receivers:
                heard_s = arrivals_s[receivers.index(fault.vehicle)]
                if begins_s < heard_s and sent_s < ends_s:
                    yield f"packets has {fault.vehicle} hearing {sender} in slot {slot}: {fault.kind} befell it"


def _faults(scene: Scene) -> Iterator[str]:
    """Faults of which the begin or the end is missing."""
    fleet = scene.fleet
    told = {(row[1], row[2], row[3] == OVER, row[0]) for row in fleet.recorder.faults}
    for fault in fleet.medium.faults:
        for at_s, is_over in zip((fault.from_s, fault.until_s), (False, True), strict=True):
            if at_s < fleet.ended_s and (fault.vehicle, fault.kind, is_over, at_s) not in told:
                event = "was over at" if is_over else "befell"
                yield f"faults lacks that {fault.kind} {event} {fault.vehicle} at {at_s:g} s"


def _is_pause(kind: str) -> bool:
    """True if a vehicle begins anew once a fault of a kind is over."""
    return absence(kind) is Absence.PAUSE


def _roles(scene: Scene) -> Iterator[str]:
    """Roles that a vehicle plays, as it sees itself, and that its rows do not come to, or the other way round."""
    fleet = scene.fleet
    anew_s = {row[1]: row[0] for row in fleet.recorder.faults if row[3] == OVER and _is_pause(row[2])}
    for vehicle in fleet.vehicles:
        told: set[tuple[str, str]] = set()
        for time_s, name, group, role, event in fleet.recorder.roles:
            if name != vehicle.name or time_s < anew_s.get(name, 0.0):
                continue
            if event == "assigned":
                told.add((group, role))
            elif event == "left":
                told.discard((group, role))
        plays = {(role.group, role.role) for role in vehicle.social.organisation.roles_of(vehicle.name)}
        if told != plays:
            yield f"roles comes to {sorted(told)} of {vehicle.name}, which plays {sorted(plays)}"
