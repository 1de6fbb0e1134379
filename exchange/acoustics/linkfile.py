"""Files that say what links lose: what is common to reading a trace and a network."""

from __future__ import annotations

import hashlib
from pathlib import Path


class LinkFileError(ValueError):
    """A file of links that cannot be used; its text says where and why."""


class LinkFileGoneError(LinkFileError):
    """A file that is not there any more, or not the one that was used."""


def hash_of(file: str, kinds: str) -> str:
    """The sha256 of a file, in hexadecimal digits.

    Args:
        file: its path.
        kinds: which files are allowed, for the message.

    Raises:
        LinkFileGoneError: it cannot be read.
    """
    try:
        return hashlib.sha256(Path(file).read_bytes()).hexdigest()
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else str(error)
        where = "from the folder of the scenario; with an option or in a study from the current one"
        raise LinkFileGoneError(f"cannot be read: {why}; allowed: {kinds}, {where}") from None


def same_hash(file: str, sha256: str, kinds: str) -> str:
    """The sha256 of a file that has to be the one that was used; any is if ``sha256`` is empty.

    Raises:
        LinkFileGoneError: it cannot be read, or has another hash.
    """
    digest = hash_of(file, kinds)
    if sha256 and digest != sha256:
        raise LinkFileGoneError(f"is not the file that was used: its sha256 is {digest}, not {sha256}")
    return digest
