"""How commands are listed: by what they are for, with examples, without loading much.

A command is loaded when it is asked for, and made then: who asks for one does not wait for the others.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from typing import Any

from typer.core import TyperCommand, TyperGroup

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
    """A command whose help is in plain words."""

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
