"""Texts: strings of a bounded size, without control characters, and the bytes that stand for one on the wire."""

from __future__ import annotations

from collections.abc import Sequence

LONGEST_BYTES = 255
"""No attribute may allow longer texts: a packet has room for little."""
_CONTROLS = frozenset(map(chr, (*range(0x20), *range(0x7F, 0xA0), 0xFFFE, 0xFFFF)))
"""What XML cannot hold, and what would end a line."""


def most_bytes_of(stated: Sequence[object]) -> int:
    """Return the size that an ontology allows the texts of an attribute.

    Args:
        stated: the values of ``rm:maxBytes``.

    Raises:
        ValueError: they are not one such number.
    """
    if len(stated) != 1 or type(stated[0]) is not int or not 1 <= stated[0] <= LONGEST_BYTES:
        raise ValueError(f"rm:maxBytes is {' and '.join(map(repr, stated)) or 'missing'}")
    return stated[0]


def bytes_of(text: object, most_bytes: int) -> bytes:
    """Return a text in UTF-8.

    Raises:
        TypeError: it is no string.
        ValueError: it is too long, has control characters, or half of a surrogate pair.

    >>> bytes_of("Täufer", 8)
    b'T\\xc3\\xa4ufer'
    >>> bytes_of("Täufer", 6)
    Traceback (most recent call last):
    ValueError: 'Täufer' takes 7 bytes of UTF-8; allowed: at most 6
    """
    if not isinstance(text, str):
        raise TypeError(f"{text!r} is not a string")
    if not _CONTROLS.isdisjoint(text):
        raise ValueError(f"{text!r} has control characters; allowed: none")
    data = text.encode()  # UnicodeEncodeError is a ValueError
    if len(data) > most_bytes:
        raise ValueError(f"{text!r} takes {len(data)} bytes of UTF-8; allowed: at most {most_bytes}")
    return data


def decoded_text(data: bytes, most_bytes: int) -> str:
    """Return the text that stands in some bytes; raises ValueError if none does.

    >>> decoded_text(b"T\\xc3\\xa4ufer", 8)
    'Täufer'
    """
    text = data.decode()
    bytes_of(text, most_bytes)
    return text
