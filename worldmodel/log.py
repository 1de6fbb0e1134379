"""The numbered blocks of one origin and epoch: where the sequence is the index.

A log knows which sequences have arrived and holds those blocks that are in the store. A block that waits, was refused
or was pruned has arrived but is not held.
"""

from collections.abc import Iterator

from worldmodel.facts import Block


class BlockLog:
    """Blocks by sequence: a list of those without a gap before them, and the others behind it."""

    __slots__ = ("ahead", "blocks", "mask")

    def __init__(self) -> None:
        self.blocks: list[Block | None] = []
        """The sequences 0, 1, ... up to the first gap; None stands for one that has arrived and is not held."""
        self.ahead: dict[int, Block | None] = {}
        """The same for what is behind the first gap, by sequence."""
        self.mask = 0
        """Bit k is set if the sequence ``len(blocks) + k`` has arrived."""

    @property
    def digest(self) -> tuple[int, int]:
        """(highest contiguous sequence or -1, mask of those above); bit k stands for that sequence + 1 + k."""
        return len(self.blocks) - 1, self.mask

    def __iter__(self) -> Iterator[Block]:
        """The blocks that are held, by sequence."""
        for block in self.blocks:
            if block is not None:
                yield block
        for sequence in sorted(self.ahead):
            if (ahead := self.ahead[sequence]) is not None:
                yield ahead

    def has(self, sequence: int) -> bool:
        """True if the sequence has arrived."""
        return 0 <= sequence < len(self.blocks) or sequence in self.ahead

    def get(self, sequence: int) -> Block | None:
        """Return the block if it is held."""
        return self.blocks[sequence] if 0 <= sequence < len(self.blocks) else self.ahead.get(sequence)

    def put(self, sequence: int, block: Block | None) -> None:
        """Note that the sequence has arrived, and hold its block from now on, or none."""
        blocks = self.blocks
        if sequence == len(blocks):
            blocks.append(block)
            if self.ahead:
                self._close_gap()
        elif sequence < len(blocks):
            blocks[sequence] = block
        else:
            self.ahead[sequence] = block
            self.mask |= 1 << (sequence - len(blocks))

    def _close_gap(self) -> None:
        n_before = len(self.blocks) - 1
        while len(self.blocks) in self.ahead:
            self.blocks.append(self.ahead.pop(len(self.blocks)))
        self.mask >>= len(self.blocks) - n_before

    def forget(self, sequence: int) -> None:
        """Be as if the sequence, which has arrived, had not."""
        if sequence >= len(self.blocks):
            del self.ahead[sequence]
            self.mask ^= 1 << (sequence - len(self.blocks))
            return
        behind = self.blocks[sequence + 1 :]
        del self.blocks[sequence:]
        self.ahead.update(enumerate(behind, start=sequence + 1))
        self.mask = (self.mask << len(behind) | (1 << len(behind)) - 1) << 1 if behind or self.mask else 0
