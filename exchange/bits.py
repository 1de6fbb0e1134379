"""The bits of a packet, read field by field."""

from exchange.errors import PeerFault


class Reader:
    """Takes fields off a big integer from the most significant end.

    Attributes:
        left: bits that have not been read.
    """

    __slots__ = ("bits", "left")

    def __init__(self, data: bytes) -> None:
        self.bits = int.from_bytes(data, "big")
        self.left = 8 * len(data)

    def take(self, size_bits: int) -> int:
        """The next bits as a number; raises PeerFault if there are not so many."""
        self.left = left = self.left - size_bits
        if left < 0:
            raise PeerFault("packet ends inside a field")
        return self.bits >> left & (1 << size_bits) - 1

    def bit(self) -> int:
        """The next bit; raises PeerFault if there is none."""
        self.left = left = self.left - 1
        if left < 0:
            raise PeerFault("packet ends inside a field")
        return self.bits >> left & 1

    def padding_is_clean(self) -> bool:
        """True if what is left is less than a byte, and zero."""
        return self.left < 8 and self.take(self.left) == 0
