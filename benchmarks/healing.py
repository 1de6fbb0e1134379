"""Simulate a healed partition and batches with real packets under several policies.

Prints two tables, means with 95 % intervals. One symbol counts as one transmission. The reference row is an oracle: the
sender knows the received sets of all nodes, needs no headers, and fills its packet with as many useful symbols over its
own set as fit.
"""

from __future__ import annotations

import argparse
import random
from collections.abc import Sequence
from statistics import fmean

from benchmarks.manager_fleet import ManagerFleet
from missions.statistics import NoInterval, mean_interval

N_NODES, PER = 6, 0.4
HALF = N_NODES // 2
PARTED = ((6, 64), (16, 32), (16, 64))
"""Items of a node, bytes of a packet."""
POLICIES = "ack", "mps-ack", "adaptive"
BATCHES = ((4, 12), (8, 6))
"""Nodes, items of each."""
LOSSES = 0.2, 0.4, 0.6, 0.8
MOST_SLOTS = 20_000


class Healing:
    """Two threes that have each settled all among themselves, and hear each other from now on."""

    def __init__(self, seed: int, policy: str = "adaptive", n_items: int = 16, payload_bytes: int = 32) -> None:
        dice, self.is_parted = random.Random(seed), True
        self.fleet = ManagerFleet(
            N_NODES, policy, payload_bytes,
            lost=lambda _, s, r: (self.is_parted and (s < HALF) != (r < HALF)) or dice.random() < PER,
        )  # fmt: skip
        self.uids = [self.fleet.maps(node, n_items * node + item) for node in range(N_NODES) for item in range(n_items)]
        self.fleet.pass_frames(40 + 8 * n_items)
        self.is_parted = False
        self.most_in_packet = 0

    @property
    def lacking(self) -> set[object]:
        """Items that somebody lacks."""
        return {uid for uid in self.uids if len(self.fleet.holders(uid)) < N_NODES}

    def heal(self) -> tuple[float, float]:
        """Sendings of an item until all hold all, copies of what somebody lacks and symbols; and frames until then."""
        lacking, n, began = self.lacking, 0, self.fleet.slot
        assert len(lacking) == len(self.uids)
        while lacking:
            sent = self.fleet.pass_slot()
            start_s = self.fleet.schedule.start_s(sent.slot)
            packet = self.fleet.codec.decode(sent.data, sent.slot // N_NODES, start_s).packet
            n_symbols = len(packet.account.symbols)
            n += len(lacking.intersection(sent.items)) + n_symbols
            self.most_in_packet = max(self.most_in_packet, len(sent.items) + n_symbols)
            lacking = self.lacking
        assert not self.fleet.false_beliefs
        return n / len(self.uids), (self.fleet.slot - began) / N_NODES


class Span:
    """What symbols over items say, over the field of two: a basis by highest bit."""

    def __init__(self, items: int) -> None:
        self.basis = {bit: 1 << bit for bit in range(items.bit_length()) if items >> bit & 1}

    def add(self, vector: int) -> None:
        """Learn a symbol; nothing if it is known."""
        while vector and (top := vector.bit_length() - 1) in self.basis:
            vector ^= self.basis[top]
        if vector:
            self.basis[top] = vector

    def lacks(self, other: Span) -> int:
        """How many symbols of the other would be news."""
        union = Span(0)
        union.basis = dict(self.basis)
        for vector in other.basis.values():
            union.add(vector)
        return len(union.basis) - len(self.basis)


def heal_knowing_all(seed: int, n_items: int, in_packet: int) -> tuple[float, float]:
    """The same as `Healing.heal` for who knows all, with so many symbols in a packet at most."""
    dice, n_all, slot, n = random.Random(seed), N_NODES * n_items, 0, 0
    side = (1 << HALF * n_items) - 1
    spans = [Span(side << HALF * n_items * (node >= HALF)) for node in range(N_NODES)]
    while any(len(span.basis) < n_all for span in spans):
        sender, slot = slot % N_NODES, slot + 1
        heard = [node for node in range(N_NODES) if node != sender and dice.random() >= PER]
        news = max(spans[node].lacks(spans[sender]) for node in range(N_NODES) if node != sender)
        for _ in range(min(in_packet, news)):
            chosen = [vector for vector in spans[sender].basis.values() if dice.random() < 0.5]
            said = 0
            for vector in chosen:
                said ^= vector
            n += 1
            for node in heard:
                spans[node].add(said)
    return n / n_all, slot / N_NODES


def item_slots(seed: int, policy: str, n_nodes: int, n_items: int, per: float, payload_bytes: int = 32) -> float:
    """Mean slots from the start until an item of a batch is with all."""
    dice = random.Random(seed)
    fleet = ManagerFleet(n_nodes, policy, payload_bytes, lost=lambda *_: dice.random() < per)
    open_ = {fleet.maps(node, n_items * node + item) for node in range(n_nodes) for item in range(n_items)}
    slots: list[int] = []
    while open_ and fleet.slot < MOST_SLOTS:
        fleet.pass_slot()
        done = {uid for uid in open_ if len(fleet.holders(uid)) == n_nodes}
        slots += [fleet.slot] * len(done)
        open_ -= done
    assert not open_, "an item is not with all"
    return fmean(slots)


def interval(values: Sequence[float]) -> str:
    """Mean and its 95 % interval, or why there is none."""
    found = mean_interval(values)
    said = found.value if isinstance(found, NoInterval) else f"{found[0]:.2f} to {found[1]:.2f}"
    return f"{fmean(values):.2f} ({said})"


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.healing", description=__doc__)
    parser.add_argument("--trials", type=int, default=20)
    trials = range(parser.parse_args().trials)
    if not trials:
        parser.error(f"--trials is {trials.stop}: allowed is 1 or more")
    print("healed partition: items of a node, bytes of a packet, policy: sendings of an item; frames")
    for n_items, payload_bytes in PARTED:
        in_packet = 0
        for policy in POLICIES:
            fleets = [Healing(seed, policy, n_items, payload_bytes) for seed in trials]
            healed = [fleet.heal() for fleet in fleets]
            in_packet = max(fleet.most_in_packet for fleet in fleets)
            _print(f"{n_items} {payload_bytes} {policy}", healed)
        _print(f"{n_items} {payload_bytes} who knows all", [heal_knowing_all(k, n_items, in_packet) for k in trials])
    print("batches: nodes, items of each, loss: mean slots until an item is with all, adaptive over holdings-repeat")
    for n_nodes, n_items in BATCHES:
        for per in LOSSES:
            by_policy = [
                [item_slots(seed, policy, n_nodes, n_items, per) for seed in trials]
                for policy in ("adaptive", "holdings-repeat")
            ]
            print(
                f"{n_nodes} {n_items} {per}: {interval([a / b for a, b in zip(*by_policy, strict=True)])}", flush=True
            )


def _print(who: str, healed: list[tuple[float, float]]) -> None:
    sendings, frames = zip(*healed, strict=True)
    print(f"{who}: {interval(sendings)}; {fmean(frames):.1f}", flush=True)


if __name__ == "__main__":
    main()
