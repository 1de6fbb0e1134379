"""How commands are listed, and how their values are taken: by what they are for, with examples, without loading much.

A command is loaded when it is asked for, and made then: who asks for one does not wait for the others.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from enum import Enum
from importlib import import_module
from pathlib import Path
from typing import Any

from typer.core import TyperCommand, TyperGroup

from missions.errors import LONGEST_VALUE, cut

GROUPS = {
    "Run": {"list": "files", "explain": "files", "validate": "files", "run": "runs", "doctor": "files"},
    "See": {
        "plot": "results", "replay": "results", "live": "runs", "export": "exports", "query": "results",
        "verify": "results",
    },
    "Compare": {
        "sweep": "sweeps", "compare": "sweeps", "benchmark": "benchmark", "exchange-study": "exchange",
    },
    "Extend": {"new": "new", "check": "benchmark"},
    "Vehicles at sea": {"sea": "exchange", "node": "nodes", "swarm": "nodes"},
}  # fmt: skip
"""Commands by what they are for, each with its module below ``remoras.cli``."""
HOMES = {name: module for commands in GROUPS.values() for name, module in commands.items()}
MAKERS: dict[str, Callable[[], TyperCommand]] = {}
"""What makes a command, of those whose modules are loaded; ``remoras.cli.app.command`` declares them."""
PYTHON_TYPE = re.compile(r" <(str|path|int|float|list\[str\])>")


class PlainCommand(TyperCommand):
    """A command whose plain values, texts and paths and whole numbers, are taken as they are.

    Typer checks every value by a library that takes longer to load than most commands do; it is asked only about the
    values that are not plain.
    """

    def get_params(self, ctx: Any) -> list[Any]:
        """Parameters, those of plain types with a taker of their own."""
        return [taking_plain(parameter) for parameter in super().get_params(ctx)]

    def get_help(self, ctx: Any) -> str:
        """The help text, without names of Python's types and without braces around what is needed."""
        text = PYTHON_TYPE.sub(lambda found: " " * len(found[0]), super().get_help(ctx))
        usage, _, rest = text.partition("\n")
        return "\n".join([usage.replace("{", "").replace("}", ""), rest])

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """The example, as one types it."""
        if self.epilog:
            _write_lines(formatter, "Example", [self.epilog])


class Commands(Mapping[str, TyperCommand]):
    """All commands by name; each is loaded and made when it is asked for."""

    def __init__(self) -> None:
        self._made: dict[str, TyperCommand] = {}

    def __getitem__(self, name: str) -> TyperCommand:
        if name not in self._made:
            import_module(f"remoras.cli.{HOMES[name]}")
            self._made[name] = MAKERS[name]()
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(HOMES)

    def __len__(self) -> int:
        return len(HOMES)


class OrderedGroup(TyperGroup):
    """The commands by what they are for."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**{**settings, "commands": {}})
        self.commands: Any = Commands()

    def get_params(self, ctx: Any) -> list[Any]:
        """Parameters, those of plain types with a taker of their own."""
        return [taking_plain(parameter) for parameter in super().get_params(ctx)]

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of the commands as ``--help`` shows them."""
        return list(HOMES)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """The commands with their summaries, a section for each group."""
        limit = formatter.width - 6 - max(map(len, HOMES))
        for heading, names in GROUPS.items():
            with formatter.section(heading):
                formatter.write_dl([(name, self.commands[name].get_short_help_str(limit)) for name in names])

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """An example of every command, as one types it."""
        commands = [self.get_command(ctx, name) for name in self.list_commands(ctx)]
        _write_lines(
            formatter, "Examples", [command.epilog for command in commands if command is not None and command.epilog]
        )


def _write_lines(formatter: Any, heading: str, lines: list[str]) -> None:
    """Write lines that are not to be wrapped: they are copied."""
    with formatter.section(heading):
        for line in lines:
            formatter.write(f"{'':{formatter.current_indent}}{line}\n")


class _Plain:
    """Takes plain values of a parameter, and asks Typer about the others.

    Args:
        parameter: of a command.
        kind: type of its value.
    """

    def __init__(self, parameter: Any, kind: Any) -> None:
        self._parameter = parameter
        self._take = TAKEN[kind] if kind in TAKEN else _a_member_of(kind)

    def coerce(self, value: Any, param: Any, ctx: Any) -> Any:
        """The value of the type that the command declares."""
        several = param.multiple or param.nargs == -1
        if value is None:
            return () if several else None
        taken = self._take(value)
        low, high = getattr(param, "min", None), getattr(param, "max", None)
        is_out = isinstance(taken, int | float) and (
            (low is not None and taken < low) or (high is not None and taken > high)
        )
        if taken is not None and not is_out:
            return taken
        self._parameter._runtime_param = None
        try:
            return self._parameter.get_runtime_param().coerce(value, param=param, ctx=ctx)
        except Exception as error:  # typer has no name for what is raised where a value cannot be taken
            if isinstance(getattr(error, "message", None), str):
                error.message = f"{cut(str(value), LONGEST_VALUE)!r}: {error.message}"  # type: ignore[attr-defined]
            raise


def taking_plain(parameter: Any) -> Any:
    """The parameter, which takes plain values by itself; under a version of Typer that works otherwise, as it is."""
    kind = getattr(getattr(parameter, "type_descriptor", None), "annotation", None)
    is_plain = kind in TAKEN or (isinstance(kind, type) and issubclass(kind, Enum))
    if is_plain and hasattr(parameter, "get_runtime_param") and getattr(parameter, "_runtime_param", 0) is None:
        parameter._runtime_param = _Plain(parameter, kind)
    return parameter


def _whole_number(value: Any) -> int | None:
    if isinstance(value, str):
        return int(value) if re.fullmatch(r"[0-9]{1,18}", value) else None
    return value if isinstance(value, int) else None


def _number(value: Any) -> float | None:
    if isinstance(value, str):
        return float(value) if re.fullmatch(r"[0-9]{1,9}(\.[0-9]{1,9})?", value) else None
    return float(value) if isinstance(value, int | float) else None


def _texts(value: Any) -> list[str] | None:
    return list(value) if isinstance(value, list | tuple) and all(isinstance(item, str) for item in value) else None


def _a_member_of(kind: type[Enum]) -> Callable[[Any], Enum | None]:
    return lambda value: next((member for member in kind if value in (member, member.value)), None)


TAKEN: dict[Any, Callable[[Any], Any]] = {
    str: lambda value: value if isinstance(value, str) else None,
    Path: lambda value: Path(value) if isinstance(value, str | Path) else None,
    bool: lambda value: value if isinstance(value, bool) else None,
    int: _whole_number,
    float: _number,
    list[str]: _texts,
}
"""How a plain value of each type is taken; None for a value that is not plain."""
