"""Names of attributes on the wire: short ones for those that a fleet exchanges, however many the ontology has.

A vehicle may tell of any attribute, since a block goes whole; but nearly always it is one that somebody needs. So these
are numbered first. One number more, if there are others at all, says that the uid of another follows.
"""

from collections.abc import Callable, Collection

from exchange.errors import PeerFault
from exchange.wire.codes import width


class AttributeNames:
    """The bits that name each attribute.

    Args:
        n_attributes: uids 0 to n_attributes - 1 are named.
        exchanged: uids with a short name; None for all.

    >>> names = AttributeNames(40, exchanged=(3, 5, 8))
    >>> names.sizes[5], names.sizes[6]
    (2, 8)
    """

    def __init__(self, n_attributes: int, exchanged: Collection[int] | None = None) -> None:
        self.exchanged = tuple(sorted(range(n_attributes) if exchanged is None else exchanged))
        """Uids with a short name, in the order of these."""
        self.n_attributes = n_attributes
        self.has_others = len(self.exchanged) < n_attributes
        self.short_bits = width(len(self.exchanged) + self.has_others)
        self.other_bits = self.short_bits + width(n_attributes)
        short = {uid: name for name, uid in enumerate(self.exchanged)}
        escape = len(self.exchanged) << width(n_attributes)
        self.names = tuple(short.get(uid, escape | uid) for uid in range(n_attributes))
        """By uid, what is written."""
        self.sizes = tuple(self.short_bits if uid in short else self.other_bits for uid in range(n_attributes))
        """By uid, the bits of it."""

    def uid_of(self, name: int, take: Callable[[int], int]) -> int:
        """Return the uid that a name of ``short_bits`` stands for, or the bits behind it; ``take`` yields those.

        Raises:
            PeerFault: they name none, or by the longer way one that has a short name.
        """
        if name < len(self.exchanged):
            return self.exchanged[name]
        if not self.has_others or name > len(self.exchanged):
            raise PeerFault(f"attribute {name} is not in the TBox")
        uid = take(width(self.n_attributes))
        if uid >= self.n_attributes or uid in self.exchanged:
            raise PeerFault(f"attribute {uid} is not in the TBox, or has a short name")
        return uid
