"""What a packet carries beside fragments, as bits: influence signals, and summaries of what the sender holds."""

from __future__ import annotations

from exchange import codes
from exchange.bits import Reader
from exchange.codes import Bits
from exchange.errors import ConfigurationError
from exchange.fragmentcodec import EPOCH_BITS, FragmentCodec, refuse_epoch
from exchange.packets import InfluenceSignal
from exchange.sizes import FieldSize
from exchange.summaries import MASK_BITS, Summary

SIGNAL_VALUE_BITS = 8
SIGNAL_BITS, SUMMARY_BITS = (0b1100, 4), (0b1101, 4)


class SideCodec:
    """Encodes and decodes influence signals and summaries.

    Args:
        fragments: has the widths of instances, nodes and sequences.
    """

    def __init__(self, fragments: FragmentCodec) -> None:
        self._fragments = fragments
        self._role_bits = fragments.facts.subject_bits
        self.signal_bits = SIGNAL_BITS[1] + self._role_bits + SIGNAL_VALUE_BITS
        """Bits of one influence signal."""

    def listing(self) -> tuple[FieldSize, ...]:
        """Fields of a signal and of a summary in the order of the wire."""
        return (
            FieldSize("signal", "signal", SIGNAL_BITS[1], "one comes"),
            FieldSize("signal", "role", self._role_bits, "its instance"),
            FieldSize("signal", "value", SIGNAL_VALUE_BITS, "-128 to 127"),
            FieldSize("summary", "summary", SUMMARY_BITS[1], "one comes"),
            FieldSize("summary", "origin", self._fragments.node_bits, "whose items"),
            FieldSize("summary", "origin's epoch", EPOCH_BITS),
            FieldSize("summary", "highest", self._fragments.sequence_bits, "all up to it are held; more bits beyond"),
            FieldSize("summary", "mask", MASK_BITS, "which of those behind the first gap are held"),
        )

    def encode_signal(self, signal: InfluenceSignal) -> Bits:
        """``(bits, size_bits)`` of a signal; raises ConfigurationError if it is no signed byte."""
        if not -128 <= signal.value <= 127:
            raise ConfigurationError(f"influence signal {signal.value}: a signed byte holds -128 to 127")
        bits = (SIGNAL_BITS[0] << self._role_bits | signal.role) << SIGNAL_VALUE_BITS | signal.value & 0xFF
        return bits, self.signal_bits

    def encode_summary(self, summary: Summary) -> Bits:
        """``(bits, size_bits)`` of a summary; raises ConfigurationError if its epoch has no name."""
        refuse_epoch(summary.epoch)
        highest, highest_bits = codes.natural(summary.highest + 1, self._fragments.sequence_bits)
        bits = (SUMMARY_BITS[0] << self._fragments.node_bits | summary.origin) << EPOCH_BITS | summary.epoch
        size_bits = SUMMARY_BITS[1] + self._fragments.node_bits + EPOCH_BITS + highest_bits + MASK_BITS
        return (bits << highest_bits | highest) << MASK_BITS | summary.mask, size_bits

    def read_signal(self, reader: Reader) -> InfluenceSignal:
        """The signal that comes next, behind its prefix."""
        role = reader.take(self._role_bits)
        value = reader.take(SIGNAL_VALUE_BITS)
        return InfluenceSignal(role, value - 256 if value > 127 else value)

    def read_summary(self, reader: Reader) -> Summary:
        """The summary that comes next, behind its prefix; raises PeerFault if its origin is no node."""
        origin, epoch = self._fragments.read_life(reader)
        highest = codes.read_natural(reader.take, self._fragments.sequence_bits) - 1
        return Summary(origin, epoch, highest, reader.take(MASK_BITS))
