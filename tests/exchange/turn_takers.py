"""A small fleet on the air whose vehicles send by slot lists, each by its own, or at random times of a frame."""

import random
from collections.abc import Callable, Sequence

from exchange_lives import Sea

from exchange.policies import POLICIES
from exchange.schedule import TdmaSchedule
from exchange.wire.codec import Codec, Framing
from remoras.testing.policies import DURATION_S, N_BLOCKS, SLOT_S, TBOX, instances

Slots = tuple[tuple[int, ...], ...]


class Round(Sea):
    """A fleet whose frames pass whole; ``lists`` are of each node, all of one length, and none of them in ALOHA."""

    def __init__(self, n_nodes: int, policy: str, lists: Sequence[Slots] = (), seed: int = 0) -> None:
        self.is_aloha, self.lists = not lists, lists
        slots = lists[0] if lists else ()
        super().__init__(n_nodes, policy)
        self.schedule = TdmaSchedule(n_nodes, SLOT_S - 0.5, 0.5, slots, self.is_aloha)
        self.codec = Codec(
            TBOX, len(instances(n_nodes)), n_nodes, POLICIES[policy], N_BLOCKS, DURATION_S,
            framing=Framing(n_slots=len(slots), is_by_frame=True),
        )  # fmt: skip
        self.draws = random.Random(seed)
        self.frame = 0
        for node in range(n_nodes):
            self.restart(node, keeps=False)
        self.collided = self.unlisted = 0

    def restart(self, node: int, keeps: bool) -> None:
        usual = self.schedule
        if self.lists:
            self.schedule = TdmaSchedule(self.n_nodes, SLOT_S - 0.5, 0.5, self.lists[node])
        super().restart(node, keeps)
        self.schedule = usual

    def turns(self) -> list[tuple[float, int, int]]:
        """When which node sends in which slot of the frame that begins, in order."""
        found = []
        for node, manager in enumerate(self.managers):
            for slot in manager.turns.begin(self.frame, node not in self.dead):
                found.append((self.schedule.sends_s(slot, self.draws.random()), slot, node))
        return sorted(found)

    def pass_frame(
        self,
        lost: Callable[[int, int], bool] = lambda sender, receiver: False,
        is_fair: bool = False,
        midway: Callable[[], None] = lambda: None,
    ) -> None:
        """One frame: in each slot its speakers speak; who hears two at once hears neither, nor does who speaks.

        Args:
            lost: scripts the links.
            is_fair: of several speakers in a slot one is heard, any of them.
            midway: happens in the middle of the frame.
        """
        turns = self.turns()
        half_s = self.schedule.frame_start_s(self.frame) + self.schedule.frame_s / 2.0
        past, due = [one for one in turns if one[0] < half_s], [one for one in turns if one[0] >= half_s]
        for part in (past, due):
            for at_s in sorted({one[0] for one in part}):
                self._speak(at_s, [(slot, node) for when_s, slot, node in part if when_s == at_s], lost, is_fair)
            if part is past:
                midway()
        self.frame += 1
        self.slot = self.frame * self.schedule.n_slots

    def _speak(
        self, at_s: float, speakers: list[tuple[int, int]], lost: Callable[[int, int], bool], is_fair: bool
    ) -> None:
        there = [(s, n) for s, n in speakers if n not in self.dead and s in self.managers[n].turns.slots]
        sent = [(node, self.managers[node].packet_to_send(at_s)) for _, node in there]
        self.said += [packet for _, packet in sent]
        if is_fair and len(sent) > 1:
            sent = [self.draws.choice(sent)]
        for receiver in range(self.n_nodes):
            if receiver in self.dead or receiver in [node for node, _ in sent]:
                continue
            heard = [packet for node, packet in sent if not lost(node, receiver)]
            self.collided += len(heard) > 1
            if len(heard) == 1:
                self.unlisted += self.deliver(receiver, heard[0].data, at_s + 1.0).is_unlisted


def any_list(draws: random.Random, n_nodes: int, n_slots: int) -> Slots:
    """A valid list: several slots for some, shared ones and free ones; who has none finds a free one."""
    while True:
        slots = tuple(
            tuple(sorted(draws.sample(range(n_nodes), draws.choice([0, 1, 1, 1, 2])))) for _ in range(n_slots)
        )
        missing = set(range(n_nodes)) - {node for nodes in slots for node in nodes}
        if len(missing) <= sum(not nodes for nodes in slots):
            return slots
