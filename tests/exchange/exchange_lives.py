"""A small fleet on the air whose vehicles die and begin anew; an independent record says who believes what is false."""

from collections.abc import Callable
from itertools import permutations

from benchmarks.manager_fleet import TBOX, ManagerFleet, instances, needs
from exchange.manager import ExchangeManager
from exchange.packets import ItemUid, Reception
from exchange.policies import POLICIES
from worldmodel import Value, WorldModel, merge

Lost = Callable[[int, int], bool]


class Sea(ManagerFleet):
    """A fleet whose vehicles may begin anew; ``heard_epoch[p][r]`` is the newest epoch that p can have heard r's of."""

    def __init__(self, n_nodes: int, policy: str, payload_bytes: int = 64, carrier_evidence: bool = True) -> None:
        super().__init__(n_nodes, policy, payload_bytes, carrier_evidence)
        self.policy = POLICIES[policy]
        self.dead: set[int] = set()
        self.known = [[0] * n_nodes for _ in range(n_nodes)]
        self.told: list[ItemUid] = []

    def restart(self, node: int, keeps: bool) -> None:
        """Begin anew in the next epoch, with an empty world model or with what was in the one before."""
        old = self.models[node]
        model = WorldModel(
            TBOX, node, instances(self.n_nodes), n_origins=self.n_nodes, run_time_instances_per_origin=0,
            epoch=old.epoch + 1,
        )  # fmt: skip
        self.models[node] = model
        if keeps:
            merge(model, [*old.blocks(), *old.private_blocks(), *old.statuses()])
        self.managers[node] = ExchangeManager(
            node, model, self.codec, self.schedule, self.policy, 8 * self.payload_bytes, needs(range(self.n_nodes))
        )
        if keeps:
            self.managers[node].resume(self.now_s)
        self.known[node] = [0] * self.n_nodes
        self.known[node][node] = model.epoch

    def pass_slot(self, lost: Lost = lambda sender, receiver: False):
        now_s = self.now_s
        sender = self.schedule.owner(self.slot)
        if sender not in self.dead:
            sent = self.managers[sender].packet_to_send(now_s)
            self.said.append(sent)
            for receiver in range(self.n_nodes):
                if receiver != sender and receiver not in self.dead and not lost(sender, receiver):
                    self.deliver(receiver, sent.data, now_s + 1.0)
        self.slot += 1

    def deliver(self, receiver: int, data: bytes, now_s: float) -> Reception:
        reception = self.managers[receiver].receive(data, now_s)
        merge(self.models[receiver], reception.blocks, now_s)
        if reception.fault is None:
            self.known[receiver][reception.sender] = self.models[reception.sender].epoch
        return reception

    def pass_frames(self, n: int):
        for _ in range(n * self.n_nodes):
            self.pass_slot()

    def n_faults(self) -> int:
        return sum(manager.n_faults for manager in self.managers)

    def digests(self) -> list[str]:
        return [str(sorted(model.digest().items())) for node, model in enumerate(self.models) if node not in self.dead]

    def observe(self, node: int, *facts: tuple[int, int, Value]) -> tuple[ItemUid, ...]:
        told = super().observe(node, *facts)
        self.told += told
        return told

    def has(self, node: int, uid: ItemUid) -> bool:
        """True if its world model has the block, or its manager the part of a block that is not whole yet."""
        guid = uid.origin, uid.epoch, uid.sequence
        manager = self.managers[node]
        return self.models[node].has_arrived(guid) or (guid in manager.half_blocks() and manager.holds(uid))

    def wrong(self) -> list[tuple[int, int, ItemUid]]:
        """Who believes of whom that it holds what it lacks, though it has heard of that one's last beginning."""
        alive = set(range(self.n_nodes)) - self.dead
        links = [(me, peer) for me, peer in permutations(alive, 2) if self.known[me][peer] == self.models[peer].epoch]
        return [
            (me, peer, uid)
            for me, peer in links
            for uid in self.told
            if self.managers[me].believes(peer, uid) and not self.has(peer, uid)
        ]
