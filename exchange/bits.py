"""The bits of a packet, read field by field."""

from exchange.errors import PeerFault


class Reader:
    """Takes fields off a big integer from the most significant end."""

    __slots__ = ("_bits", "_left")

    def __init__(self, data: bytes) -> None:
        self._bits = int.from_bytes(data, "big")
        self._left = 8 * len(data)

    def take(self, size_bits: int) -> int:
        """The next bits as a number; raises PeerFault if there are not so many."""
        self._left -= size_bits
        if self._left < 0:
            raise PeerFault("packet ends inside a field")
        return (self._bits >> self._left) & ((1 << size_bits) - 1)

    def padding_is_clean(self) -> bool:
        """True if what is left is less than a byte, and zero."""
        return self._left < 8 and self.take(self._left) == 0
