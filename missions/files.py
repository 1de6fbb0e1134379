"""Files that a user names, a scenario or a study, by a shipped name or by a path; and their values as text.

Nothing heavy is loaded here, so that a name that is mistyped is told at once.
"""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from missions.errors import LONGEST_VALUE, ConfigurationError, ConfigurationFault, cut

BYTE_ORDER_MARKS = {b"\xff\xfe": "UTF-16", b"\xfe\xff": "UTF-16"}
"""First bytes of files that some editors write."""
SCENARIO, STUDY = "scenario", "study"
COMMANDS = {SCENARIO: "remoras run {file}", STUDY: "remoras sweep {file} --out DIR"}
"""What makes the run, or the runs, of a file of each kind."""
MISSIONS = Path(__file__).parent


def shipped() -> dict[str, Path]:
    """Scenario files that come with the package, by name: ``mapping/rendezvous.toml`` is ``mapping-rendezvous``."""
    return {f"{path.parent.name}-{path.stem}": path for path in sorted(MISSIONS.glob("*/*.toml"))}


def shipped_studies() -> dict[str, Path]:
    """Study files that come with the package, by name."""
    return {path.stem: path for path in sorted(MISSIONS.glob("*/studies/*.toml"))}


def is_study(name_or_path: str) -> bool:
    """True for the name of a shipped study, and for a TOML file with a table ``[study]``."""
    if name_or_path in shipped_studies():
        return True
    try:
        return STUDY in tomllib.loads(Path(name_or_path).read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError):  # no such file, not text, not TOML
        return False


def file_of(kind: str, name_or_path: str, known: Mapping[str, Path]) -> Path:
    """The file of a shipped name or of a path.

    Args:
        kind: what it should be, "scenario" or "study".
        name_or_path: as the user gave it.
        known: shipped files of that kind by name.

    Raises:
        ConfigurationError: there is no such file, or the name is one of the other kind.
    """
    other = STUDY if kind == SCENARIO else SCENARIO
    path = Path(name_or_path) if name_or_path.endswith(".toml") else known.get(name_or_path, Path(name_or_path))
    if is_file(path):
        return path
    if name_or_path in (shipped() if other == SCENARIO else shipped_studies()):
        raise of_other_kind(name_or_path, other)
    raise ConfigurationError(name_or_path, [ConfigurationFault(kind, name_or_path, file_or_name(name_or_path, known))])


def check_named(name_or_path: str) -> None:
    """Raise ConfigurationError unless there is such a file, or a shipped scenario or study of that name."""
    known = [*shipped(), *shipped_studies()]
    if name_or_path not in known and not is_file(Path(name_or_path)):
        fault = ConfigurationFault("scenario or study", name_or_path, file_or_name(name_or_path, known))
        raise ConfigurationError(name_or_path, [fault])


def of_other_kind(file: str, found: str, line: int | None = None) -> ConfigurationError:
    """The error for a file of another kind than the one that was asked for.

    Args:
        file: as the user gave it.
        found: the kind that it is of.
        line: of the table that says so.
    """
    allowed = f"this is a {found}; start it with: {COMMANDS[found].format(file=file)}"
    return ConfigurationError(file, [ConfigurationFault(f"[{found}]", "", allowed, line)])


def file_or_name(given: str, known: Iterable[str]) -> str:
    """What is allowed where a file or a shipped name has to be given.

    >>> file_or_name("a", [])
    'a TOML file'
    """
    from worldmodel import suggestion  # loaded when a name is mistyped, which is seldom

    names = list(known)
    return "a TOML file" + (f" or one of {', '.join(names)}" if names else "") + suggestion(given, names)


def is_file(path: Path) -> bool:
    """True if there is such a file; False too for a name that no file can have."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def text_of(path: Path) -> str:
    """Text of a UTF-8 file, with or without a byte order mark.

    Raises:
        ConfigurationError: it cannot be read, or has another encoding.
    """
    try:
        content = path.read_bytes()
        if other := _other_encoding(content):
            raise ConfigurationError(
                str(path), [ConfigurationFault("file", "", f"cannot be read: it is {other}; save it as UTF-8")]
            )
        return content.decode("utf-8-sig").replace("\r\n", "\n")
    except OSError as error:
        why, line = f"cannot be read: {error}", None
    except UnicodeDecodeError as error:
        why = f"cannot be read: byte {error.object[error.start]:#04x} is not UTF-8; save the file as UTF-8"
        line = content.count(b"\n", 0, error.start) + 1
    raise ConfigurationError(str(path), [ConfigurationFault("file", "", why, line)])


def _other_encoding(content: bytes) -> str:
    """Name of an encoding that the file seems to have instead of UTF-8; empty if it seems to have none."""
    if mark := BYTE_ORDER_MARKS.get(content[:2]):
        return mark
    return "UTF-16 or no text" if b"\0" in content[:1000] else ""


@contextmanager
def drafted(path: Path) -> Iterator[Path]:
    """A path to write a file to, which then takes the place of ``path``; after an error, which names it, it is gone."""
    draft = path.with_name(f".{path.name}.draft")
    try:
        yield draft
        draft.replace(path)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None
    finally:
        with suppress(OSError):
            draft.unlink(missing_ok=True)


def toml_value(value: Any) -> str:
    """A value on one line of TOML.

    >>> toml_value([0.5, True, {"name": "a b"}, float("inf")])
    '[0.5, true, {"name" = "a b"}, inf]'
    """
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(key)} = {toml_value(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if value is None or isinstance(value, bool | int | float | str):
        return json.dumps(value, ensure_ascii=False)
    return str(value)  # dates and times


def shown(value: Any) -> str:
    """A value as a message shows it, cut if it is long."""
    return cut(toml_value(value), LONGEST_VALUE)
