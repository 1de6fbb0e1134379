"""What protects a packet on its way: a checksum against damage, a key against strangers. Both are optional.

A modem checks what it receives, and channels here lose packets and damage none. So there is no checksum unless it is
asked for: set one for a link that passes on what it could not check. It covers the number of the frame too, which the
packet tells in two bits only. All checksums here find every burst that is no longer than they are.

A key encrypts what stands behind the head, by AES-CCM (RFC 3610) with a short tag, which covers the head and the slot
too. The head stays in clear, since it names the slot. The key of the fleet itself encrypts nothing. As in RFC 8613
(OSCORE, section 3.2), each sender has a key and an initialisation vector of its own, which follow by HKDF (RFC 5869)
from the key of the fleet, a salt and its node. The nonce is slot, sender and epoch, crossed with that vector.

No vehicle sends twice in one slot of one mission, so no nonce comes twice under one salt. A salt is drawn by the
operating system for each run and for each process, so none comes twice under one key, whatever else is the same. The
vehicles of a run share a salt. Those of several processes tell each other theirs, see ``exchange.wire.definitions``.
Nothing that a run records depends on the bytes of a packet, so the same scenario and seed still give the same tables.
"""

from __future__ import annotations

import os
import secrets
import stat
import zlib
from binascii import crc_hqx
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, Protocol

from exchange.errors import ConfigurationError, PeerFault

TAG_BYTES = 4
"""Of the seal: one forgery in 2**32 passes. A modem does not carry so many packets in a year."""
CRC8_POLYNOMIAL = 0x2F
CRC_BITS = (0, 8, 16, 32)
"""Sizes of a checksum."""
KEY_SIZES = (16, 24, 32)
"""Bytes of a key."""
NONCE_BYTES = 13
SALT_BYTES = 8
"""Of a salt: of a million runs or processes under one key two share theirs with a probability of 3e-8."""
MOST_DIGITS = 4 * max(KEY_SIZES)
"""What is read of a file at most."""
OPEN_TO_OTHERS = 0o077
"""Bits of a mode by which others than its owner may use a file."""
DAMAGED = "checksum differs: the packet was damaged on its way"
UNOPENED = "the packet cannot be opened: another key, mission or slot, or damage on its way"


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
        size_bits: 8, 16 or 32.
        fault: what a packet with another is said to be. Of encrypted bytes chance says whether the checksum or the tag
            finds the damage, so both say the same.

    Raises:
        ConfigurationError: another size.
    """

    def __init__(self, size_bits: int, fault: str = DAMAGED) -> None:
        if size_bits not in CRC_BITS:
            raise ConfigurationError(f"a checksum of {size_bits} bits; allowed: {', '.join(map(str, CRC_BITS))}")
        self.size_bits = size_bits
        self._fault = fault
        self._n_bytes = size_bits // 8
        self._crc = _CRCS.get(size_bits, zlib.crc32)

    def added(self, data: bytes, frame: int) -> bytes:
        """A packet with its checksum behind it."""
        return data + self._of(data, frame)

    def stripped(self, data: bytes, frame: int) -> bytes:
        """A packet without its checksum; raises PeerFault if that is wrong."""
        told, crc = data[: -self._n_bytes], data[-self._n_bytes :]
        if self._of(told, frame) != crc:
            raise PeerFault(self._fault)
        return told

    def _of(self, data: bytes, frame: int) -> bytes:
        return self._crc(frame.to_bytes(8, "big") + data).to_bytes(self._n_bytes, "big")


class _Aead(Protocol):
    """Authenticated encryption with associated data."""

    def encrypt(self, nonce: bytes, data: bytes, associated_data: bytes | None) -> bytes: ...
    def decrypt(self, nonce: bytes, data: bytes, associated_data: bytes | None) -> bytes: ...


class _Sender(NamedTuple):
    """What the packets of one sender are encrypted by."""

    cipher: _Aead
    vector: bytes


def fresh_salt() -> bytes:
    """A salt of the operating system that nobody has used: never a draw of the seed, which comes again."""
    return secrets.token_bytes(SALT_BYTES)


def derived(key: bytes, salt: bytes, about: bytes, size: int) -> bytes:
    """Bytes that follow from a key, by HKDF with SHA-256 (RFC 5869).

    >>> derived(bytes([0x0B] * 22), bytes(range(13)), bytes(range(0xF0, 0xFA)), 42)[:8].hex()  # its test case 1
    '3cb25f25faacd57a'

    Args:
        key: that it follows from; salt: with what.
        about: what they are for.
        size: how many (bytes).
    """
    from cryptography.hazmat.primitives.hashes import SHA256
    from cryptography.hazmat.primitives.kdf.hkdf import HKDF

    return HKDF(SHA256(), size, salt, about).derive(key)


class Seal:
    """Encrypts what stands behind the head of a packet.

    Args:
        key: shared by the fleet, of 16, 24 or 32 bytes.
        salt_of: the salt of each sender; None for one that is not known yet. Without it all share a fresh one.

    Raises:
        ConfigurationError: the key has another size, or the library that encrypts is not installed.
    """

    size_bits = 8 * TAG_BYTES

    def __init__(self, key: bytes, salt_of: Callable[[int], bytes | None] | None = None) -> None:
        if len(key) not in KEY_SIZES:
            raise ConfigurationError(f"a key of {len(key)} bytes; allowed: {', '.join(map(str, KEY_SIZES))}")
        try:
            from cryptography.hazmat.primitives.ciphers.aead import AESCCM
        except ImportError:
            raise ConfigurationError(
                'a key needs the package cryptography: pip install "remoras-sim[crypto]"'
            ) from None
        self._key = key
        self._make: Callable[[bytes, int], _Aead] = AESCCM
        common = fresh_salt()
        self._salt_of = salt_of or (lambda sender: common)
        self._senders: dict[int, tuple[bytes, _Sender]] = {}  # by node, each with the salt that it follows from

    def renewed(self, salt_of: Callable[[int], bytes | None] | None = None) -> Seal:
        """A seal of the same key with other salts: by default a fresh one."""
        return Seal(self._key, salt_of)

    def sealed(self, sender: int, head: bytes, body: bytes, nonce: bytes) -> bytes:
        """The body under the key of a sender, with its tag; ``head`` and ``nonce`` are covered by that."""
        own = self._of(sender)
        return own.cipher.encrypt(_crossed(nonce, own.vector), body, head)

    def opened(self, sender: int, head: bytes, sealed: bytes, nonce: bytes) -> bytes:
        """The body again; raises PeerFault if key, salt, head or nonce is another, or a bit was changed."""
        from cryptography.exceptions import InvalidTag

        own = self._of(sender)
        try:
            return own.cipher.decrypt(_crossed(nonce, own.vector), sealed, head)
        except (InvalidTag, ValueError):
            raise PeerFault(UNOPENED) from None

    def _of(self, sender: int) -> _Sender:
        salt = self._salt_of(sender)
        if salt is None:
            raise PeerFault(f"the packet cannot be opened: node {sender} has not introduced itself")
        known = self._senders.get(sender)
        if known is None or known[0] != salt:
            size = len(self._key)
            bits = derived(self._key, salt, b"remoras packets of " + bytes((sender,)), size + NONCE_BYTES)
            known = self._senders[sender] = salt, _Sender(self._make(bits[:size], TAG_BYTES), bits[size:])
        return known[1]


def _crossed(block: bytes, other: bytes) -> bytes:
    return bytes(a ^ b for a, b in zip(block, other, strict=True))


def nonce_of(sender: int, epoch: int, frame: int, slot_start_s: float, definition: bytes) -> bytes:
    """The number used once under a salt: by whom, in which of its lives and in which slot a packet is sent."""
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
        ConfigurationError: it cannot be read, holds no such key, or is open to others than its owner, on systems whose
            files have such modes. What it holds is never told.
    """
    try:
        with path.open(encoding="ascii") as file:
            mode = stat.S_IMODE(os.fstat(file.fileno()).st_mode)
            if os.name == "posix" and mode & OPEN_TO_OTHERS:
                raise ConfigurationError(f"is open to others (mode {mode:03o}): chmod 600 {path}")
            key = bytes.fromhex(file.read(MOST_DIGITS).strip())
    except OSError as error:
        raise ConfigurationError(f"cannot be read: {error.strerror}") from None
    except ValueError:
        raise ConfigurationError("it must hold hexadecimal digits alone: openssl rand -hex 16 makes some") from None
    if len(key) not in KEY_SIZES:
        allowed = ", ".join(str(2 * size) for size in KEY_SIZES)
        raise ConfigurationError(f"it holds {2 * len(key)} hexadecimal digits; allowed: {allowed}")
    return key
