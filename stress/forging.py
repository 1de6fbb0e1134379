"""Forged packets: in good form, from a true one, with a value or a time in it that its sender did not say."""

from __future__ import annotations

from collections.abc import Callable

from exchange.errors import ExchangeError
from exchange.packets import Fragment, Packet
from exchange.schedule import TdmaSchedule
from exchange.wire.codec import Codec
from worldmodel import PropertyValue, WorldModel

LATER_EVERY = 4
"""In one of so many forged packets a time is another one, in the others a value."""
LATER_S = (20.0, 200.0, 2000.0)
"""By how much."""


def forger(codec: Codec, slots: TdmaSchedule, model: Callable[[], WorldModel]) -> Callable[[bytes, int, int], bytes]:
    """What forges packets of a fleet.

    Args:
        codec: of the fleet; slots: its TDMA.
        model: a world model of the fleet, which knows what values are in range.
    """

    def forge(data: bytes, slot: int, draw: int) -> bytes:
        frame, start_s = slots.frame_of(slot), slots.start_s(slot)
        try:
            packet = codec.decode(data, frame, start_s, codec.era_of(data, frame) or 0)
            forged = _forged(packet, draw, model())
            if forged == packet:
                return data
            return codec.encode(
                forged.sender, forged.rows, forged.fragments, forged.signals, frame, forged.epoch, start_s,
                forged.summary,
            )  # fmt: skip
        except ExchangeError:
            return data  # damaged before: it stays what it is

    return forge


def _forged(packet: Packet, draw: int, model: WorldModel) -> Packet:
    """The packet with one time or value of one of its fragments changed; as it is if it has none that could be."""
    fragments = list(packet.fragments)
    if fragments and draw % LATER_EVERY == 0:
        at = draw // LATER_EVERY % len(fragments)
        one = fragments[at]
        later_s = one.time_s + LATER_S[draw // LATER_EVERY % len(LATER_S)]
        fragments[at] = _with(one, one.facts, later_s)
        return packet._replace(fragments=tuple(fragments))
    for index in range(len(fragments)):
        at = (draw + index) % len(fragments)
        fact = fragments[at].facts[draw % len(fragments[at].facts)]
        for other in _others(fact, draw):
            if other != fact and model.may_record(other):
                facts = tuple(other if told is fact else told for told in fragments[at].facts)
                fragments[at] = _with(fragments[at], facts, fragments[at].time_s)
                return packet._replace(fragments=tuple(fragments))
    return packet._replace(signals=tuple(signal._replace(value=-128) for signal in packet.signals))


def _with(one: Fragment, facts: tuple[PropertyValue, ...], time_s: float) -> Fragment:
    return Fragment(one.origin, one.sequence, time_s, facts, one.index, one.count, one.epoch)


def _others(fact: PropertyValue, draw: int) -> list[PropertyValue]:
    """Facts that differ in their value."""
    value = fact.value
    if isinstance(value, bool):
        return [fact._replace(value=not value)]
    if isinstance(value, tuple):
        return [fact._replace(value=(value[0] + far_m, value[1] - far_m)) for far_m in (5000.0, 300.0, -200.0)]
    if isinstance(value, int | float):
        kind = type(value)
        return [fact._replace(value=kind(value + step)) for step in (1 + draw % 7, -(1 + draw % 7), 1)]
    return []
