"""Vehicles for `storm`: what they exchange, and how they are made."""

from collections.abc import Sequence
from functools import cache
from typing import Any

from stress.exchange_stress import Make, Storm
from stress.reference_record import Life

from benchmarks.manager_fleet import (
    AREA_DONE,
    DURATION_S,
    MAPPED_CELL,
    N_BLOCKS,
    POSITION,
    SLOT_S,
    TBOX,
    bay,
    instances,
    needs,
)
from exchange.manager import ExchangeManager, Options
from exchange.packets import ItemUid
from exchange.policies import POLICIES
from exchange.schedule import TdmaSchedule
from exchange.wire.codec import Codec, Framing
from worldmodel import TYPE_UID, Keeping, WorldModel
from worldmodel.world_model import remember

NEW_INSTANCES = 16
WAITING_S = 120.0
AREA = TBOX.class_named("Area").uid
PRIORITIES = {MAPPED_CELL: 1, AREA_DONE: 2, TYPE_UID: 3, POSITION: 2}


@cache
def codec_of(n_nodes: int, policy: str, crc_bits: int = 0) -> Codec:
    """Names areas that vehicles create too."""
    n_instances = len(instances(n_nodes)) + n_nodes * NEW_INSTANCES
    return Codec(TBOX, n_instances, n_nodes, POLICIES[policy], N_BLOCKS, DURATION_S, framing=Framing(crc_bits))


def schedule_of(n_nodes: int) -> TdmaSchedule:
    return TdmaSchedule(n_nodes, SLOT_S - 0.5, 0.5)


def maker(
    n_nodes: int, policy: str, payload_bytes: int = 64, carrier_evidence: bool = True, crc_bits: int = 0, **options: Any
) -> Make:
    """Vehicles that need all that any of them tells; options are those of managers."""
    schedule = schedule_of(n_nodes)
    everything = needs(range(n_nodes), PRIORITIES)

    def make(node: int, epoch: int, store: WorldModel | None, now_s: float) -> tuple[WorldModel, ExchangeManager]:
        model = WorldModel(
            TBOX,
            node,
            instances(n_nodes),
            n_origins=n_nodes,
            run_time_instances_per_origin=NEW_INSTANCES,
            epoch=epoch,
            keeping=Keeping(waiting_s=WAITING_S),
        )
        manager = ExchangeManager(
            node,
            model,
            codec_of(n_nodes, policy, crc_bits),
            schedule,
            POLICIES[policy],
            8 * payload_bytes,
            everything,
            Options(carrier_evidence, **options),
        )
        if store is not None:
            remember(model, store, now_s)
            manager.resume(now_s)
        return model, manager

    return make


def storm_of(
    n_nodes: int,
    policy: str = "ack",
    payload_bytes: int = 64,
    offsets_s: Sequence[float] = (),
    absent: tuple[int, ...] = (),
    crc_bits: int = 0,
    **options: Any,
) -> Storm:
    """Vehicles of one kind, all awake unless they are absent."""
    return Storm(
        maker(n_nodes, policy, payload_bytes, crc_bits=crc_bits, **options), schedule_of(n_nodes), offsets_s, absent
    )


def maps(storm: Storm, who: int | Life, *cells: int) -> tuple[ItemUid, ...]:
    """Let a vehicle map cells of the bay, in one block."""
    return storm.record(who, *((bay(storm.n_nodes), MAPPED_CELL, cell) for cell in cells))


def creates(storm: Storm, who: int | Life) -> tuple[ItemUid, ...]:
    """Let a vehicle create an area, and say in another block that it is done: this waits where it comes first."""
    life = storm.lives[who] if isinstance(who, int) else who
    uid = life.model.new_instance_uid()
    return storm.record(life, (uid, TYPE_UID, AREA)) + storm.record(life, (uid, AREA_DONE, life.node))
