"""What becomes of what a vehicle has to tell: the tables ``deliveries`` and ``unsaid``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from remoras.recorder import TIME, VEHICLE, Column, Table

if TYPE_CHECKING:
    from exchange.packets import ItemUid
    from exchange.queueing.queue import Queue
    from exchange.queueing.reasons import Expiry
    from remoras.recorder import Recorder
    from worldmodel import WorldModel

DELIVERIES = Table("deliveries", (
    TIME, VEHICLE, Column("item", "str"), Column("event", "str"), Column("reason", "str"),
    Column("latency_s", "float", "s"),
))  # fmt: skip
"""What became of an item or status that a vehicle had to tell: ``acknowledged`` (all who need it are known to hold it),
``expired`` (said no more, with the reason: time to live, overflow, superseded, not needed, said once), or ``postponed``
(no room: it waits outside of the queue). The latency counts from the observation."""
UNSAID = Table("unsaid", (
    Column("slot", "int"), TIME, VEHICLE, Column("reason", "str"), Column("candidates", "int"),
))  # fmt: skip
"""How many items and statuses that wait a vehicle did not say in its slot, by the reason, see
``exchange.queueing.reasons.Unsaid``; or nothing open, once."""


def note_acknowledged(
    recorder: Recorder, names: Sequence[str], model: WorldModel, uids: Iterable[ItemUid], now_s: float
) -> None:
    """Rows for items of which all who need them are known to hold them.

    Args:
        recorder: takes the rows.
        names: of the vehicles, by node.
        model: of the vehicle that knows it.
        uids: of the items.
        now_s: the time (s).
    """
    rows, vehicle = recorder.rows(DELIVERIES.name), names[model.owner]
    for uid in uids:
        recorder.knowledge.append((now_s, vehicle, str(uid), names[uid.origin], "acknowledged"))
        block = model.arrived((uid.origin, uid.epoch, uid.sequence))
        latency_s = None if block is None else now_s - block.time_s
        rows.append((now_s, vehicle, str(uid), "acknowledged", "", latency_s))


def note_expired(recorder: Recorder, vehicle: str, expired: Iterable[Expiry], now_s: float) -> None:
    """Rows for what a vehicle says no more.

    Args:
        recorder: takes the rows.
        vehicle: that says it no more.
        expired: what, and why.
        now_s: the time (s).
    """
    rows = recorder.rows(DELIVERIES.name)
    for expiry in expired:
        event = "postponed" if expiry.comes_back else "expired"
        rows.append((now_s, vehicle, str(expiry.uid), event, expiry.reason.value, expiry.latency_s))


def note_slot(recorder: Recorder, vehicle: str, queue: Queue, slot: int, now_s: float) -> None:
    """Rows for what waits and was not said in an own slot, and for what has come to be said no more.

    Args:
        recorder: takes the rows.
        vehicle: whose slot it is.
        queue: its own, after the slot.
        slot: which one.
        now_s: the time (s).
    """
    note_expired(recorder, vehicle, queue.take_expired(), now_s)
    rows = recorder.rows(UNSAID.name)
    rows.extend([(slot, now_s, vehicle, reason.value, count) for reason, count in queue.unsaid.items()])
