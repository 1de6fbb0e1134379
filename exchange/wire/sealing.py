"""Optional protection of packets: checksum against damage, encryption under a fleet key.

Modems check packets, and simulated channels lose packets but damage none. Configure a checksum for links that deliver
damaged packets. It covers the whole frame number, of which a packet carries two bits, and detects every burst up to its
own length.

AES-CCM (RFC 3610) encrypts all behind the head; its short tag also covers head and slot. The head stays in clear, since
it names the slot. As in RFC 8613 (OSCORE, section 3.2), each sender has its own key and initialisation vector, derived
by HKDF (RFC 5869) from fleet key, salt and node. The nonce is slot, sender and epoch, XORed with that vector.

No vehicle sends twice in one slot of one mission, so a nonce is unique under a salt. The operating system draws a fresh
salt for each run or process, so salts are unique under a key. Vehicles of one run share a salt; processes exchange
theirs (``exchange.wire.definitions``). Recorded tables do not depend on packet bytes and stay reproducible.
"""

from __future__ import annotations

import os
import secrets
import stat
import zlib
from binascii import crc_hqx
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from exchange.errors import ConfigurationError, PeerFault

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.ciphers.aead import AESCCM

TAG_BYTES = 4
"""Tag of the seal: one forgery in 2**32 passes, more packets than a modem carries in a year."""
CRC8_POLYNOMIAL = 0x2F
CRC_BITS = (0, 8, 16, 32)
"""Sizes of a checksum."""
KEY_SIZES = (16, 24, 32)
"""Bytes of a key."""
# RFC 3610: 15 bytes less the 2 of CCM's length field.
NONCE_BYTES = 13
SALT_BYTES = 8
"""Two of a million runs under one key share a salt with probability 3e-8."""
MOST_DIGITS = 4 * max(KEY_SIZES)
"""Characters read of a key file at most."""
OPEN_TO_OTHERS = 0o077
"""Mode bits that let users other than the owner access a file."""
DAMAGED = "checksum differs: the packet was damaged on its way"
UNOPENED = "the packet cannot be opened: another key, mission or slot, or damage on its way"


def crc8(data: bytes) -> int:
    """AUTOSAR CRC-8 without the final inversion.

    >>> hex(crc8(b"123456789") ^ 0xFF)
    '0xdf'
    """
    crc = 0xFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ (CRC8_POLYNOMIAL if crc & 0x80 else 0)) & 0xFF
    return crc


def crc16(data: bytes) -> int:
    """CRC-16-CCITT with initial value 0xFFFF.

    >>> hex(crc16(b"123456789"))
    '0x29b1'
    """
    return crc_hqx(data, 0xFFFF)


_CRCS: dict[int, Callable[[bytes], int]] = {8: crc8, 16: crc16}


class Checksum:
    """Checksum of 8, 16 or 32 bits behind a packet, with its error text; other sizes raise ConfigurationError."""

    def __init__(self, size_bits: int, fault: str = DAMAGED) -> None:
        if size_bits not in CRC_BITS:
            raise ConfigurationError(f"a checksum of {size_bits} bits; allowed: {', '.join(map(str, CRC_BITS))}")
        self.size_bits = size_bits
        self._fault = fault
        self._n_bytes = size_bits // 8
        self._crc = _CRCS.get(size_bits, zlib.crc32)

    def added(self, data: bytes, frame: int) -> bytes:
        """Append the checksum."""
        return data + self._of(data, frame)

    def stripped(self, data: bytes, frame: int) -> bytes:
        """Remove the checksum; raise PeerFault if it is wrong."""
        body, crc = data[: -self._n_bytes], data[-self._n_bytes :]
        if self._of(body, frame) != crc:
            # Under encryption either checksum or tag may detect damage first, so both use one text.
            raise PeerFault(self._fault)
        return body

    def _of(self, data: bytes, frame: int) -> bytes:
        return self._crc(frame.to_bytes(8, "big") + data).to_bytes(self._n_bytes, "big")


def fresh_salt() -> bytes:
    """Draw a salt from the operating system, never from the reproducible seed of a run."""
    return secrets.token_bytes(SALT_BYTES)


def derived(key: bytes, salt: bytes, about: bytes, size: int) -> bytes:
    """Derive ``size`` bytes by HKDF with SHA-256 (RFC 5869); ``about`` is the info field.

    >>> derived(bytes([0x0B] * 22), bytes(range(13)), bytes(range(0xF0, 0xFA)), 42)[:8].hex()  # its test case 1
    '3cb25f25faacd57a'
    """
    from cryptography.hazmat.primitives.hashes import SHA256
    from cryptography.hazmat.primitives.kdf.hkdf import HKDF

    return HKDF(SHA256(), size, salt, about).derive(key)


class Seal:
    """Encryption of all behind the head of a packet.

    ``key`` is the fleet's, of 16, 24 or 32 bytes; ``salt_of`` returns the salt of each sender, None if unknown; by
    default one fresh salt for all. Raises ConfigurationError for another key size, or no encryption library.
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
        self._key, self._cipher = key, AESCCM
        common = fresh_salt()
        self._salt_of = salt_of or (lambda sender: common)
        self._senders: dict[tuple[int, bytes], tuple[AESCCM, bytes]] = {}  # by node and salt: cipher and vector

    def renewed(self, salt_of: Callable[[int], bytes | None] | None = None) -> Seal:
        """Return a seal with the same key and other salts, by default a fresh one."""
        return Seal(self._key, salt_of)

    def sealed(self, sender: int, head: bytes, body: bytes, nonce: bytes) -> bytes:
        """Encrypt and tag ``body`` for a sender; the tag covers ``head`` and ``nonce``."""
        cipher, vector = self._of(sender)
        return cipher.encrypt(_crossed(nonce, vector), body, head)

    def opened(self, sender: int, head: bytes, sealed: bytes, nonce: bytes) -> bytes:
        """Decrypt a body; raise PeerFault if key, salt, head, nonce or any bit differs."""
        from cryptography.exceptions import InvalidTag

        cipher, vector = self._of(sender)
        try:
            return cipher.decrypt(_crossed(nonce, vector), sealed, head)
        except (InvalidTag, ValueError):
            raise PeerFault(UNOPENED) from None

    def _of(self, sender: int) -> tuple[AESCCM, bytes]:
        """Return cipher and initialisation vector of a sender."""
        salt = self._salt_of(sender)
        if salt is None:
            raise PeerFault(f"the packet cannot be opened: the salt of node {sender} is not known yet")
        if (sender, salt) not in self._senders:
            size = len(self._key)
            bits = derived(self._key, salt, b"remoras packets of " + bytes((sender,)), size + NONCE_BYTES)
            self._senders[sender, salt] = self._cipher(bits[:size], TAG_BYTES), bits[size:]
        return self._senders[sender, salt]


def _crossed(block: bytes, other: bytes) -> bytes:
    return bytes(a ^ b for a, b in zip(block, other, strict=True))


def nonce_of(sender: int, epoch: int, frame: int, slot_start_s: float, definition: bytes) -> bytes:
    """Return the nonce of a packet from sender, epoch, slot and definition."""
    start = round(1000.0 * slot_start_s) & 0xFFFFFFFFFF
    return (
        (frame & 0xFFFFFFFF).to_bytes(4, "big")
        + start.to_bytes(5, "big")
        + bytes((sender, epoch))
        + definition[: NONCE_BYTES - 11]
    )


def key_in(path: Path) -> bytes:
    """Read a key file of 32, 48 or 64 hexadecimal digits.

    Raises ConfigurationError if unreadable, invalid or, on POSIX, accessible to others; the content is never shown.
    """
    try:
        with path.open(encoding="ascii") as file:
            # Of the opened file, so that its path cannot be exchanged between check and reading.
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
