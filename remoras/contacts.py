"""What a radio writes of its peers: who is away, who began anew, who shares a name, and what the links lose."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from exchange.manager import ExchangeManager
from exchange.packets import Met, Reception, Transmission
from exchange.peering.peers import PeerLinks
from remoras.recorder import Recorder

LINK_FRAMES = 8
"""TDMA frames from one row of a link to the next."""
EVENTS = {Met.BACK: "heard again", Met.NEW_LIFE: "begins anew"}
SLOT_CONFLICT = "slot conflict"


class Links(Mapping[str, PeerLinks]):
    """What the links from and to each peer lose, by its name, as it is known when it is asked.

    Args:
        names: of all vehicles, in the order of the nodes.
        me: own node.
        manager: of the vehicle.
    """

    def __init__(self, names: Sequence[str], me: int, manager: ExchangeManager) -> None:
        self._nodes = {name: node for node, name in enumerate(names) if node != me}
        self._manager = manager

    def __getitem__(self, name: str) -> PeerLinks:
        return self._manager.links(self._nodes[name])

    def __iter__(self) -> Iterator[str]:
        return iter(self._nodes)

    def __len__(self) -> int:
        return len(self._nodes)


class Contacts:
    """Rows of one vehicle about its peers.

    Args:
        names: of all vehicles, in the order of the nodes.
        me: own node.
        manager: of the vehicle.

    Attributes:
        links: what the links from and to each peer lose, by its name.
        period, due_from: in slots that are, modulo the one, not below the other, ``sent`` writes how the links are.
    """

    def __init__(self, names: Sequence[str], me: int, manager: ExchangeManager) -> None:
        self.period = LINK_FRAMES * len(names)
        self.due_from = self.period - len(names)
        self._names = names
        self._me = me
        self.links = Links(names, me, manager)

    def sent(self, sent: Transmission, now_s: float, recorder: Recorder) -> None:
        """Write what was noticed of peers, and now and then how the links are."""
        me = self._names[self._me]
        for node, event in sent.noticed:
            recorder.peers.append((now_s, me, self._names[node], event))
        if sent.slot % self.period >= self.due_from:
            for name, links in self.links.items():
                for direction, link in links._asdict().items():
                    if link.n:
                        recorder.links.append((now_s, me, name, direction, link.p_loss, link.n))

    def heard(self, reception: Reception, now_s: float, recorder: Recorder) -> None:
        """Write what a packet shows of its sender."""
        me, rows = self._names[self._me], recorder.peers
        if reception.met in EVENTS:
            rows.append((now_s, me, self._names[reception.sender], EVENTS[reception.met]))
        if reception.conflict is not None:
            rows.append((now_s, me, self._names[reception.conflict], SLOT_CONFLICT))
            recorder.faults.append((now_s, me, SLOT_CONFLICT, f"another speaks as {self._names[reception.conflict]}"))
