"""Cost of the exchange manager of a vehicle: how it grows with what waits, with what is settled, and with the sea.

A fleet of five on a perfect link tells in turns what one of its vehicles waits to tell, in packets of 64 bytes. Beside
that, 100 groups of ten vehicles with a schedule and a channel each run the same mission side by side, in turns tick by
tick, against one group alone.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

from benchmarks.measuring import row, setup_of
from exchange.manager import ExchangeManager
from exchange.policies import POLICIES
from exchange.schedule import TdmaSchedule
from exchange.wire.codec import Codec, Widths
from missions.mapping.mission import MappingMission
from missions.runs.assembly import assemble
from remoras.collecting import rare_collections
from worldmodel import InformationNeed, Instance, NeedsIndex, WorldModel, core_ontology_paths, merge, read_tbox

FEW, MANY = 100, 10_000
N_NODES = 5
REPEATS = 5
SLOTS = 20
PAYLOAD_BITS = 512
GROUP, GROUPS = 10, 100
MISSION_S = 60.0
PRIORITIES = (1, 3, 10)


class Small:
    """Five vehicles that need each other's cells, areas and batteries."""

    def __init__(self) -> None:
        tbox = read_tbox(*core_ontology_paths(), *MappingMission.vocabulary)
        named = [("AUV", f"AUV{node}") for node in range(N_NODES)] + [("Area", "bay")]
        instances = tuple(Instance(uid, tbox.class_named(kind).uid, name) for uid, (kind, name) in enumerate(named))
        self.cell = tbox.attribute_named("mappedCell").uid
        needs = [InformationNeed(self.cell, 1, class_uid=tbox.attributes[self.cell].domain)]
        index = NeedsIndex(tbox, dict.fromkeys(range(N_NODES), needs))
        policy = POLICIES["ack"]
        self.schedule = TdmaSchedule(N_NODES, 1.0, 1.0)
        self.codec = Codec(tbox, len(instances), N_NODES, policy, 1 << 15, 1e6, Widths(1.0))
        self.models = [WorldModel(tbox, node, instances, 1.0, n_origins=N_NODES) for node in range(N_NODES)]
        self.managers = [
            ExchangeManager(node, model, self.codec, self.schedule, policy, PAYLOAD_BITS, index)
            for node, model in enumerate(self.models)
        ]
        self.slot = 0

    def tell(self, n_items: int) -> None:
        """Vehicle 0 records cells."""
        now_s = self.schedule.start_s(self.slot)
        for number in range(n_items):
            change = self.models[0].record([(N_NODES, self.cell, float(number % 4000))], now_s)
            self.managers[0].offer([change])

    def pass_slot(self) -> float:
        """One slot, heard by all; returns CPU seconds of the managers alone."""
        sender, now_s = self.schedule.owner(self.slot), self.schedule.start_s(self.slot)
        self.slot += 1
        began_s = time.process_time()
        data = self.managers[sender].packet_to_send(now_s).data
        cpu_s = time.process_time() - began_s
        for node, manager in enumerate(self.managers):
            if node != sender:
                began_s = time.process_time()
                heard = manager.receive(data, now_s + 1.1)
                cpu_s += time.process_time() - began_s
                merge(self.models[node], heard.blocks, now_s + 1.1)
        return cpu_s


def opening_s(n_open: int) -> float:
    """CPU seconds in which a packet is made while so many items wait; nothing is acknowledged."""
    fleet = Small()
    fleet.tell(n_open)
    manager, frame_s = fleet.managers[0], fleet.schedule.frame_s
    began_s = time.process_time()
    for frame in range(SLOTS):
        manager.packet_to_send(frame * frame_s)
    return (time.process_time() - began_s) / SLOTS


def settled_s(n_settled: int) -> float:
    """CPU seconds of a slot in which one new item is told and heard, after so many have been settled."""
    fleet = Small()
    fleet.tell(n_settled)
    while any(manager.n_open for manager in fleet.managers):
        fleet.pass_slot()
    total_s, n_slots = 0.0, SLOTS * N_NODES
    for _ in range(n_slots):
        if fleet.slot % N_NODES == 0:
            fleet.tell(1)
        total_s += fleet.pass_slot()
    return total_s / n_slots


def vehicle_step_s(n_groups: int) -> float:
    """CPU seconds per vehicle and motion tick of groups side by side."""
    settings = f"fleet.size={GROUP}", "channel.per=0.2", f"scenario.duration_s={MISSION_S}"
    setup = setup_of("mapping-rendezvous", *settings)
    fleets = [assemble(setup, seed) for seed in range(n_groups)]
    began_s, n_steps = time.process_time(), 0
    with rare_collections():  # as a run has them
        while running := [fleet for fleet in fleets if fleet.running]:
            for fleet in running:
                fleet.step()
            n_steps += len(running)
    cpu_s = time.process_time() - began_s
    for fleet in fleets:
        fleet.close()
    return cpu_s / (n_steps * GROUP)


def _best(few: Sequence[float], many: Sequence[float]) -> tuple[float, float]:
    return 1e6 * min(few), 1e6 * min(many)


def rows() -> list[dict[str, Any]]:
    """Benchmark rows: the best of some repeats, the two of each row measured in turn."""
    found = []
    for what, measure, goal in (("slot opening", opening_s, "<= 2"), ("slot", settled_s, "<= 1.25")):
        kind = "open" if measure is opening_s else "settled items"
        measured = [(measure(FEW), measure(MANY)) for _ in range(REPEATS)]
        few, many = _best([one for one, _ in measured], [one for _, one in measured])
        found.append(row(f"{what}, {MANY} {kind}", many, "us CPU", f"{FEW} {kind}", few, goal=goal))
    alone = [vehicle_step_s(1) for _ in range(REPEATS)]
    few, many = _best(alone, [vehicle_step_s(GROUPS)])
    name = f"vehicle-step, {GROUP * GROUPS} vehicles in groups of {GROUP}"
    found.append(row(name, many, "us CPU", f"{GROUP} vehicles", few, goal="<= 1.5"))
    return found
