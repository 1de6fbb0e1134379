"""Whose turn it is by the slot list that a vehicle has heard of, and how one that has no slot finds one.

A slot list says for each vehicle in which slots of a frame it sends, as a bit mask: bit p for slot p. It is one block
of facts, one for each vehicle, so it goes in whole; of two lists the newer block counts, as with any fact. A vehicle
looks at its list when a frame begins, and keeps to that for the frame.

A slot that no vehicle has is free. Who has none listens for a whole frame, and then takes the first free slot in which
it heard nobody. It gives that up if for `PATIENCE_FRAMES` frames it hears others and nobody says that it was heard: so
two find out who take one slot at once. Each then waits for a time of its own before it listens again.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

from exchange.packets import Packet
from exchange.schedule import TdmaSchedule
from worldmodel import WorldModel

SENDS_IN = "sendsInSlots"
"""Name of the attribute of vehicles; an ontology without it has no other slot list than that of the schedule."""
MAX_SLOTS = 32
"""Most slots of a listed frame."""
PATIENCE_FRAMES = 4
"""Frames without an acknowledgement after which a slot that was found is given up."""


def masks_of(slots: Sequence[Sequence[int]], n_nodes: int) -> tuple[int, ...]:
    """The slots of each node as bit masks, of the nodes of each slot.

    >>> masks_of([[0], [1], [0, 2]], 3)
    (5, 2, 4)
    """
    return tuple(sum(1 << place for place, nodes in enumerate(slots) if node in nodes) for node in range(n_nodes))


class Turns:
    """The turns of one vehicle.

    Args:
        me: own node index.
        schedule: with the list that was agreed.
        model: own world model, read only: the newest list.
    """

    def __init__(self, me: int, schedule: TdmaSchedule, model: WorldModel) -> None:
        self._me, self._schedule, self._model = me, schedule, model
        self._agreed = masks_of(schedule.slots, schedule.n_nodes)
        self.attribute = next((one.uid for one in model.tbox.attributes if one.name == SENDS_IN), None)
        """Uid of the attribute of slot lists; None where none is told."""
        self._masks = self._agreed
        self.frame = -1
        """The frame that was begun last."""
        self.slots: tuple[int, ...] = ()
        """Own slots of that frame."""
        self._listens_from: int | None = None
        self._found: int | None = None  # place that was taken
        self._heard = 0  # places in which others were heard in this frame
        self._is_answered = False
        self._n_unanswered = 0

    def begin(self, frame: int, is_there: bool) -> tuple[int, ...]:
        """A frame begins; return the own slots in it.

        Args:
            frame: its number.
            is_there: False while the vehicle is away, and so hears nobody.
        """
        first = frame * self._schedule.n_slots
        if self._schedule.is_aloha:
            self.slots = (first + self._me,)
        else:
            self._masks = self._newest()
            mask = self._masks[self._me] or self._find(frame, is_there)
            self.slots = tuple(first + place for place in range(self._schedule.n_slots) if mask >> place & 1)
        self.frame, self._heard, self._is_answered = frame, 0, False
        return self.slots

    def note(self, packet: Packet, slot: int) -> bool:
        """Note who was heard; True if by the list in use here the slot is that of others than its sender."""
        if self._schedule.is_aloha:
            return False
        place = slot % self._schedule.n_slots
        if self._schedule.frame_of(slot) == self.frame:
            self._heard |= 1 << place
            self._is_answered |= bool(packet.rows[packet.sender] >> self._me & 1)
        listed = self._masks[packet.sender]
        return not listed >> place & 1 and bool(listed or not self._free >> place & 1)

    @property
    def _free(self) -> int:
        """Places that no vehicle has by the list."""
        taken = 0
        for mask in self._masks:
            taken |= mask
        return ~taken & (1 << self._schedule.n_slots) - 1

    def _newest(self) -> tuple[int, ...]:
        """The newest list that has been heard of: each of its facts is the latest of its vehicle."""
        if self.attribute is None:
            return self._agreed
        told = [self._model.value(node, self.attribute) for node in range(self._schedule.n_nodes)]
        return tuple(
            agreed if mask is None else int(cast(float, mask)) for mask, agreed in zip(told, self._agreed, strict=True)
        )

    def _find(self, frame: int, is_there: bool) -> int:
        """The mask of the place that a vehicle without a slot has found; 0 while it listens."""
        if not is_there:
            self._found = self._listens_from = None
            return 0
        if self._found is not None and not self._free >> self._found & 1:
            self._found = self._listens_from = None
        if self._found is not None:
            self._n_unanswered = self._n_unanswered + 1 if self._heard and not self._is_answered else 0
            if self._n_unanswered >= PATIENCE_FRAMES:
                without = [node for node, mask in enumerate(self._masks) if not mask]
                self._found, self._listens_from = None, frame + without.index(self._me)
        elif self._listens_from is None:
            self._listens_from = frame
        elif frame > self._listens_from:
            silent = self._free & ~self._heard
            self._found = (silent & -silent).bit_length() - 1 if silent else None
            self._n_unanswered = 0
        return 0 if self._found is None else 1 << self._found
