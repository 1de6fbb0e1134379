"""What protects a packet on its way: a checksum against damage, a key against strangers. Both are optional.

A modem checks what it receives, and channels here lose packets and damage none. So there is no checksum unless it is
asked for: set one for a link that passes on what it could not check. It covers the number of the frame too, which the
packet tells in two bits only. All checksums here find every burst that is no longer than they are.

A key encrypts what stands behind the head, by AES-CCM with a short tag, which covers the head and the slot too. The
head stays in clear, since it names the slot. The nonce is slot, sender and epoch: no vehicle sends twice in one slot of
one life, so none is used twice, as long as a key is used in one mission.
"""

from __future__ import annotations

import zlib
from binascii import crc_hqx
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from exchange.errors import ConfigurationError, PeerFault

TAG_BYTES = 4
"""Of the seal: one forgery in 2**32 passes. A modem does not carry so many packets in a year."""
CRC8_POLYNOMIAL = 0x2F
CRC_BITS = (0, 8, 16, 32)
"""Sizes of a checksum."""
KEY_SIZES = (16, 24, 32)
"""Bytes of a key."""
NONCE_BYTES = 13


def _crc8_table() -> tuple[int, ...]:
    table = []
    for byte in range(256):
        for _ in range(8):
            byte = byte << 1 ^ (CRC8_POLYNOMIAL if byte & 0x80 else 0)  # noqa: PLW2901
            byte &= 0xFF  # noqa: PLW2901
        table.append(byte)
    return tuple(table)


_CRC8 = _crc8_table()


def crc8(data: bytes) -> int:
    """The checksum of 8 bits of AUTOSAR, but without its final inversion.

    >>> hex(crc8(b"123456789") ^ 0xFF)
    '0xdf'
    """
    crc = 0xFF
    for byte in data:
        crc = _CRC8[crc ^ byte]
    return crc


def crc16(data: bytes) -> int:
    """The checksum of 16 bits of CCITT, begun with ones.

    >>> hex(crc16(b"123456789"))
    '0x29b1'
    """
    return crc_hqx(data, 0xFFFF)


_CRCS: dict[int, Callable[[bytes], int]] = {8: crc8, 16: crc16}


class Checksum:
    """The checksum behind a packet.

    Args:
        size_bits: 0 for none, 8, 16 or 32.

    Raises:
        ConfigurationError: another size.
    """

    def __init__(self, size_bits: int) -> None:
        if size_bits not in CRC_BITS:
            raise ConfigurationError(f"a checksum of {size_bits} bits; allowed: {', '.join(map(str, CRC_BITS))}")
        self.size_bits = size_bits
        self._n_bytes = size_bits // 8
        self._crc = _CRCS.get(size_bits, zlib.crc32)

    def added(self, data: bytes, frame: int) -> bytes:
        """A packet with its checksum behind it."""
        return data + self._of(data, frame) if self._n_bytes else data

    def stripped(self, data: bytes, frame: int) -> bytes:
        """A packet without its checksum; raises PeerFault if that is wrong."""
        if not self._n_bytes:
            return data
        told, crc = data[: -self._n_bytes], data[-self._n_bytes :]
        if self._of(told, frame) != crc:
            raise PeerFault("checksum differs: the packet was damaged on its way")
        return told

    def _of(self, data: bytes, frame: int) -> bytes:
        return self._crc(frame.to_bytes(8, "big") + data).to_bytes(self._n_bytes, "big")


class _Aead(Protocol):
    """Authenticated encryption with associated data."""

    def encrypt(self, nonce: bytes, data: bytes, associated_data: bytes | None) -> bytes: ...
    def decrypt(self, nonce: bytes, data: bytes, associated_data: bytes | None) -> bytes: ...


class Seal:
    """Encrypts what stands behind the head of a packet.

    Args:
        key: shared by the fleet, of 16, 24 or 32 bytes.

    Raises:
        ConfigurationError: the key has another size, or the library that encrypts is not installed.
    """

    size_bits = 8 * TAG_BYTES

    def __init__(self, key: bytes) -> None:
        if len(key) not in KEY_SIZES:
            raise ConfigurationError(f"a key of {len(key)} bytes; allowed: {', '.join(map(str, KEY_SIZES))}")
        try:
            from cryptography.hazmat.primitives.ciphers.aead import AESCCM
        except ImportError:
            raise ConfigurationError(
                'a key needs the package cryptography: pip install "remoras-sim[crypto]"'
            ) from None
        self._cipher: _Aead = AESCCM(key, tag_length=TAG_BYTES)

    def sealed(self, head: bytes, body: bytes, nonce: bytes) -> bytes:
        """The body under the key, with its tag; ``head`` and ``nonce`` are covered by that."""
        return self._cipher.encrypt(nonce, body, head)

    def opened(self, head: bytes, sealed: bytes, nonce: bytes) -> bytes:
        """The body again; raises PeerFault if key, head or nonce is another, or a bit was changed."""
        from cryptography.exceptions import InvalidTag

        try:
            return self._cipher.decrypt(nonce, sealed, head)
        except (InvalidTag, ValueError):
            raise PeerFault("the packet cannot be opened: another key, another slot, or damage on its way") from None


def nonce_of(sender: int, epoch: int, frame: int, slot_start_s: float, definition: bytes) -> bytes:
    """The number used once: by whom, in which of its lives and in which slot of the mission a packet is sent."""
    start = round(1000.0 * slot_start_s) & 0xFFFFFFFFFF
    return (
        (frame & 0xFFFFFFFF).to_bytes(4, "big")
        + start.to_bytes(5, "big")
        + bytes((sender, epoch))
        + definition[: NONCE_BYTES - 11]
    )


def key_in(path: Path) -> bytes:
    """The key in a file: 32, 48 or 64 hexadecimal digits.

    Raises:
        ConfigurationError: it cannot be read, or holds no such key. What it holds is never told.
    """
    try:
        key = bytes.fromhex(path.read_text(encoding="ascii").strip())
    except OSError as error:
        raise ConfigurationError(f"cannot be read: {error.strerror}") from None
    except ValueError:
        raise ConfigurationError("it must hold hexadecimal digits alone: openssl rand -hex 16 makes some") from None
    if len(key) not in KEY_SIZES:
        allowed = ", ".join(str(2 * size) for size in KEY_SIZES)
        raise ConfigurationError(f"it holds {2 * len(key)} hexadecimal digits; allowed: {allowed}")
    return key
