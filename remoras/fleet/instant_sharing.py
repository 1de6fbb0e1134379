"""Instant sharing of all statements, for an upper bound (``remoras.strategies.oracle``)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from exchange.packets import Transmission, name_of
from remoras.beliefs import Fact
from remoras.events import Host, Observer
from remoras.fleet.radio import Radio
from worldmodel import STATUS, Block, Change

if TYPE_CHECKING:
    from remoras.fleet.vehicle import Vehicle


class RadioAtOnce(Radio):
    """Radio that stores statements for instant sharing and sends nothing."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._told: list[Block] = []

    def tells(self, facts: Iterable[Fact], is_sent: bool = True) -> bool:
        return is_sent

    def tell(self, change: Change, who: Callable[[Change], Mapping[str, set[str]]], now_s: float) -> None:
        block = change.block
        if block.sequence < STATUS:
            super().tell(change, who, now_s)
            return
        self._told.append(block)
        self.log.facts(block, name_of(block), "status" if block.is_status else "told", now_s)

    def told(self) -> tuple[Block, ...]:
        """Return and clear the blocks stated since the last call."""
        blocks, self._told = self._told, []
        return tuple(blocks)

    def speak(self, signals: Iterable[tuple[tuple[str, str], int]], now_s: float) -> Transmission | None:
        """Return None: all facts are already known."""
        return None

    def learn(self, emitter: str, blocks: Sequence[Block], now_s: float) -> tuple[Change, ...]:
        """Merge the blocks of another vehicle."""
        self._peers.heard_s[emitter] = now_s
        return self._merged(blocks, now_s)


class InstantSharing(Observer):
    """Sharing without packets; a vehicle without statement for ``lease_frames`` is absent."""

    radio = RadioAtOnce
    lease_frames = 2.0

    def __init__(self) -> None:
        self._early: dict[str, list[tuple[str, Block]]] = {}

    def on_start(self, host: Host) -> None:
        self._fleet = host

    def on_tick(self, vehicle: Vehicle) -> None:
        blocks = _radio(vehicle).told()
        for other in self._fleet.vehicles if blocks or self._early else ():
            for name, block in self._early.pop(other.name, ()):
                self._learn(other, name, [block])
            if blocks and other is not vehicle:
                self._learn(other, vehicle.name, blocks)

    on_slot = on_frame_end = on_statement = on_tick

    def on_restart(self, vehicle: Vehicle) -> None:
        for other in self._fleet.vehicles:
            if other is not vehicle:
                model = other.beliefs.model
                blocks = [block for _, block in model.items() if block is not None]
                self._learn(vehicle, other.name, [*blocks, *model.statuses()])

    def _learn(self, vehicle: Vehicle, emitter: str, blocks: Sequence[Block]) -> None:
        if vehicle.functional.exhausted:
            return
        now_s = self._fleet.shown_s(vehicle)
        vehicle.consider(_radio(vehicle).learn(emitter, blocks, now_s), now_s)
        model = vehicle.beliefs.model
        # A vehicle whose clock is behind rejects blocks from its future: they are shared again until accepted.
        early = [(emitter, block) for block in blocks if not (block.is_status or model.has_arrived(block.guid))]
        if early:
            self._early.setdefault(vehicle.name, []).extend(early)


def _radio(vehicle: Vehicle) -> RadioAtOnce:
    radio = vehicle.radio
    assert isinstance(radio, RadioAtOnce)  # the same part made it
    return radio
