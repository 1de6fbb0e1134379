"""What is made once is kept from one process to the next: files in the user's folder for caches.

A file is named by a digest of all that it was made of, code among it, so it is never that of another version. It begins
with a digest of what follows: one that was cut short or changed is none. Where nothing can be written, nothing is kept.
"""

import hashlib
import os
from collections.abc import Iterable
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

MOST_FILES = 64
"""Files of one kind that are kept: of more the oldest go."""
_DIGEST_BYTES = 32


def files_digest(paths: Iterable[Path]) -> bytes:
    """Return a digest of the names and contents of files, in the order of their paths; raises OSError."""
    digest = hashlib.sha256()
    for path in sorted(paths):
        digest.update(path.name.encode() + hashlib.sha256(path.read_bytes()).digest())
    return digest.digest()


def package_mark(name: str) -> bytes:
    """Return where a package of others lies, and since when; nothing if it is not there; raises OSError."""
    found = find_spec(name)
    if found is None or found.origin is None:
        return b""
    return f"{found.origin} {Path(found.origin).stat().st_mtime_ns}".encode()


def read_kept(kind: str, digest: bytes) -> bytes | None:
    """Return what was kept; None if it was not, or is not whole."""
    with suppress(OSError, RuntimeError):
        content = _file(kind, digest).read_bytes()
        if hashlib.sha256(content[_DIGEST_BYTES:]).digest() == content[:_DIGEST_BYTES]:
            return content[_DIGEST_BYTES:]
    return None


def keep_file(kind: str, digest: bytes, content: bytes) -> None:
    """Keep something for the next process, if it can be written.

    Args:
        kind: folder that it lies in.
        digest: of all that it was made of.
        content: to be kept.
    """
    import tempfile  # loaded when something is written, which is seldom

    with suppress(OSError, RuntimeError):
        file = _file(kind, digest)
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=file.parent, suffix=".draft", delete=False) as draft:
            draft.write(hashlib.sha256(content).digest() + content)
        Path(draft.name).replace(file)
        files = sorted(file.parent.iterdir(), key=lambda each: each.stat().st_mtime)
        for old in files[:-MOST_FILES]:
            old.unlink(missing_ok=True)


def _file(kind: str, digest: bytes) -> Path:
    base = os.environ.get("XDG_CACHE_HOME")
    folder = Path(base) if base else Path.home() / ".cache"
    return folder / "remoras" / kind / digest.hex()[:32]
