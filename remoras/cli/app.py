"""Application of the commands, with their shared errors, JSON output and names."""

from __future__ import annotations

import functools
import inspect
import json
import os
import re
import signal
import sys
from collections.abc import Callable, Container, Iterable, Sequence
from contextlib import nullcontext
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, NoReturn, ParamSpec, cast

import typer
from typer.core import TyperCommand, TyperGroup

from missions.errors import LONGEST_VALUE, cut
from remoras.plugins import NO_PLUGINS, docstring, look_in, switched_on
from remoras.process import SAID, Terminated

GROUPS = {
    "Run": {"list": "files", "explain": "files", "validate": "files", "run": "runs", "doctor": "files"},
    "See": {
        "plot": "results", "why": "results", "replay": "results", "live": "runs", "export": "results",
        "query": "results", "verify": "results", "report": "report",
    },
    "Compare": {
        "sweep": "sweeps", "compare": "sweeps", "race": "race", "benchmark": "benchmark", "exchange-study": "exchange",
        "reproduce": "reproduce",
    },
    "Extend": {"new": "new", "check": "benchmark"},
    "Vehicles at sea": {"sea": "serving", "node": "nodes", "swarm": "nodes"},
}  # fmt: skip
"""Commands by purpose, each with its module below ``remoras.cli``."""
HOMES = {name: module for commands in GROUPS.values() for name, module in commands.items()}
MAKERS: dict[str, Callable[[], TyperCommand]] = {}
"""Factories of the commands in loaded modules, registered by ``command``."""
HEADING = re.compile(r"\n\n(?:Args|Options):\n")
ENTRY = re.compile(r"^ {4}(\w+)(?: \((.+?)\))?: (.*(?:\n {8}.*)*)", re.MULTILINE)
"""Parameter in the docstring of a command: name, metavar and text."""
PYTHON_TYPE = re.compile(r" <(str|path|int|float|list\[str\])>")


class PlainCommand(TyperCommand):
    """Command with simplified help."""

    def get_help(self, ctx: Any) -> str:
        """Return the help text without Python type names and braces around required arguments."""
        # Spaces of equal width keep the columns.
        text = PYTHON_TYPE.sub(lambda match: " " * len(match[0]), super().get_help(ctx))
        usage, _, rest = text.partition("\n")
        return "\n".join([usage.replace("{", "").replace("}", ""), rest])

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Write the example unwrapped."""
        if self.epilog:
            _write_lines(formatter, "Example", [self.epilog])


class OrderedGroup(TyperGroup):
    """Command group in order of purpose; each command is loaded and built on demand."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**{**settings, "commands": {}})
        self.commands: Any = dict.fromkeys(HOMES)

    def list_commands(self, ctx: Any) -> list[str]:
        """Return command names in help order."""
        return list(HOMES)

    def get_command(self, ctx: Any, cmd_name: str) -> TyperCommand | None:
        """Return a command, built at its first use; None for an unknown name."""
        if cmd_name in HOMES and self.commands[cmd_name] is None:
            import_module(f"remoras.cli.{HOMES[cmd_name]}")
            self.commands[cmd_name] = MAKERS[cmd_name]()
        return cast(TyperCommand | None, self.commands.get(cmd_name))

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write one section per group, with summaries."""
        limit = formatter.width - 6 - max(map(len, HOMES))
        for heading, names in GROUPS.items():
            with formatter.section(heading):
                commands = [(name, self.get_command(ctx, name)) for name in names]
                formatter.write_dl([(name, made.get_short_help_str(limit)) for name, made in commands if made])

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Write the example of every command unwrapped."""
        commands = [self.get_command(ctx, name) for name in HOMES]
        _write_lines(formatter, "Examples", [command.epilog for command in commands if command and command.epilog])


def _write_lines(formatter: Any, heading: str, lines: list[str]) -> None:
    """Write lines without wrapping, since users copy them."""
    with formatter.section(heading):
        for line in lines:
            formatter.write(f"{'':{formatter.current_indent}}{line}\n")


OK, FAILED, USAGE = 0, 1, 2
USERS_FAULTS = (
    ("exchange.errors", "ExchangeError"),
    ("missions.errors", "MissionsError"),
    ("remoras.errors", "RemorasError"),
    ("visualisation.output", "VisualisationError"),
    ("worldmodel.errors", "WorldModelError"),
)
"""Module and base class of each package's errors."""
LONGEST_WORD = 300
"""Maximum length of a word in messages: enough for a path."""
LONG_WORD = re.compile(rf"\S{{{LONGEST_WORD + 1},}}")

LOOK: dict[str, Any] = {"pretty_exceptions_enable": False, "rich_markup_mode": None}
app = typer.Typer(
    cls=OrderedGroup,
    help="Fleets of autonomous marine vehicles: organisation and knowledge over a lossy acoustic channel.",
    no_args_is_help=True,
    **LOOK,
)
Parameters = ParamSpec("Parameters")


class CommandFault(Exception):
    """Failure of a command, with message and exit code."""

    def __init__(self, message: str, code: int = USAGE) -> None:
        super().__init__(message)
        self.code = code


def note(text: str) -> None:
    """Print a note on standard error."""
    print(f"remoras: {text}", file=sys.stderr)


def _report_end(error: BaseException | None) -> int:
    number = signal.SIGTERM if isinstance(error, Terminated) else signal.SIGINT
    note(SAID[number])
    return 128 + number


def fail(message: str, code: int = USAGE) -> NoReturn:
    """End the command with a message on standard error; ``--json`` adds a JSON value."""
    raise CommandFault(message, code)


def as_typed(path: Path) -> str:
    """Quote a path for a shell."""
    import shlex

    return shlex.quote(str(path))


def _report(error: Exception, as_json: bool) -> None:
    message = shortened(str(error))
    if isinstance(error, OSError) and error.filename is not None:
        message = shortened(f"{error.filename}: {error.strerror}")
    note(message)
    if as_json:
        listed = [
            {
                "key": shortened(fault.key),
                "given": cut(fault.given, LONGEST_VALUE),
                "allowed": shortened(fault.allowed),
                "line": fault.line,
                **({} if fault.file is None else {"file": fault.file}),
            }
            for fault in getattr(error, "faults", ())
            if hasattr(fault, "allowed")
        ]
        show_json({"error": message, "faults": listed})


def shortened(message: str) -> str:
    """Shorten very long words of a message."""
    return LONG_WORD.sub(lambda match: cut(match[0], LONGEST_WORD), message)


NoPlugins = Annotated[
    bool, typer.Option("--no-plugins", help="Load shipped code only: refuse plug-ins that files or options name.")
]


def described(function: Callable[..., None]) -> tuple[str, list[inspect.Parameter]]:
    """Return text and parameters of a command by its docstring: below Args and Options, lines ``name (METAVAR): text``.

    Flags have no negation. An annotation may state more of a parameter, such as a limit.
    """
    doc = docstring(function)
    parameters = dict(inspect.signature(function, eval_str=True).parameters)
    for heading, make in (("Args", typer.Argument), ("Options", typer.Option)):
        for name, metavar, words in ENTRY.findall(doc.partition(f"\n\n{heading}:\n")[2].partition("\n\n")[0]):
            kind = parameters[name].annotation
            if not hasattr(kind, "__metadata__"):
                kind = Annotated[kind, make(*([f"--{name.replace('_', '-')}"] if kind is bool else []))]
            (info,) = kind.__metadata__
            info.metavar, info.help = metavar or None, re.sub(r"\n +", " ", words)
            parameters[name] = parameters[name].replace(annotation=kind)
    return HEADING.split(doc)[0], list(parameters.values())


def command(
    name: str, example: str = "", names_code: bool = True
) -> Callable[[Callable[Parameters, None]], Callable[Parameters, None]]:
    """Register a command that reports user errors; ``names_code`` adds ``--no-plugins``."""
    # Interruption exits with 130, termination with 143.

    def register(function: Callable[Parameters, None]) -> Callable[Parameters, None]:
        @functools.wraps(function)
        def reported(*args: Any, no_plugins: bool = False, **kwargs: Any) -> None:
            as_json = bool(kwargs.get("as_json"))
            try:
                with switched_on(NO_PLUGINS) if no_plugins else nullcontext():
                    function(*args, **kwargs)
            except KeyboardInterrupt as error:
                raise typer.Exit(_report_end(error)) from None
            except BrokenPipeError:
                # Python would report the broken pipe once more at its exit.
                sys.stderr.close()
                raise typer.Exit(OK) from None
            except CommandFault as error:
                _report(error, as_json)
                raise typer.Exit(error.code) from None
            except Exception as error:
                # A defect of the program shows its traceback.
                if not isinstance(error, OSError) and not _is_users_fault(error):
                    raise
                _report(error, as_json)
                raise typer.Exit(USAGE) from None

        def made() -> TyperCommand:
            text, parameters = described(function)
            if names_code:
                kind = inspect.Parameter.KEYWORD_ONLY
                parameters.append(inspect.Parameter("no_plugins", kind, default=False, annotation=NoPlugins))
            # Typer reads the options from these.
            reported.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
            reported.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
            alone, summary = typer.Typer(add_completion=False, **LOOK), " ".join(text.partition("\n\n")[0].split())
            alone.command(name, cls=PlainCommand, help=text, epilog=example or None, short_help=summary)(reported)
            return cast(TyperCommand, typer.main.get_command(alone))

        MAKERS[name] = made
        return function

    return register


def _is_users_fault(error: Exception) -> bool:
    # A module that is not loaded has raised nothing, and loading it takes time.
    loaded = [(sys.modules[module], name) for module, name in USERS_FAULTS if module in sys.modules]
    return isinstance(error, tuple(getattr(module, name) for module, name in loaded))


def show_json(value: Any) -> None:
    """Print a JSON value on standard output."""
    # NaN is no JSON; strict readers refuse it.
    print(json.dumps(value, indent=2, allow_nan=False))


def show(value: Any, as_json: bool, lines: Iterable[str]) -> None:
    """Print a JSON value if requested, else lines of text."""
    if as_json:
        show_json(value)
    else:
        print("\n".join(lines))


def show_files(paths: Iterable[Path], as_json: bool) -> None:
    """Print the names of written files, on standard error beside a JSON value."""
    print(*paths, sep="\n", file=sys.stderr if as_json else sys.stdout)


def aligned(rows: Sequence[Sequence[str]], right: Container[int] = ()) -> list[str]:
    """Return the lines of a text table; ``right`` holds right-aligned columns."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            text.rjust(width) if number in right else text.ljust(width)
            for number, (text, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]


Format = Literal["png", "svg", "pdf"]


def figure_format(file_format: Format | None, out: Path | None) -> str:
    """Return the file format of figures; fail for one without a folder for figures."""
    if file_format is not None and out is None:
        fail(f"--format {file_format}: applies to figures, which need --out DIR; add it")
    return file_format or "png"


Jobs = Annotated[int, typer.Option(min=1, max=1024, metavar="N", help="Processes on this machine.")]
N_JOBS = os.cpu_count() or 1
FigureFormat = Annotated[
    Format | None, typer.Option("--format", metavar="png|svg|pdf", help="File format of figures.  [default: png]")
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON value and nothing else.")]


def _show_version(wanted: bool) -> None:
    if wanted:
        from remoras.version import __version__

        print(f"remoras {__version__}")
        raise typer.Exit(OK)


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


def main() -> None:
    """Run the ``remoras`` command; plug-ins may lie in the current folder."""
    if not os.environ.get(NO_PLUGINS) and "--no-plugins" not in sys.argv:
        look_in([str(Path.cwd())])
    try:
        code = app(prog_name="remoras", standalone_mode=False)
    except KeyboardInterrupt as error:
        code = _report_end(error)
    except typer.Abort as error:  # the parser's form of an interruption
        code = _report_end(error.__cause__)
    except Exception as error:  # usage error: typer exports no class for it
        if not hasattr(error, "format_message"):
            raise
        code = _report_usage(error)
    sys.exit(code)


def _report_usage(error: Any) -> int:
    options, context = getattr(getattr(error, "param", None), "opts", ()), getattr(error, "ctx", None)
    # The parser says which option it refuses, not always which value.
    typed = next((f"{cut(value, LONGEST_VALUE)!r}" for option, value in pairwise(sys.argv) if option in options), "")
    refused = shortened(error.format_message()).replace("Value error, ", "")  # the library's name of its own error
    refused = refused.replace("\n\t", " ")  # choices, each on its own line
    if typed and typed not in refused:
        refused = refused.replace("': ", f"': {typed}: ", 1)
    if "\n" in refused:  # the help of a group without a command
        message = refused
        print(message, file=sys.stderr)
    else:
        mark = "" if refused.endswith("?") else ";"
        message = refused.rstrip(".") + (f"{mark} see: {context.command_path} --help" if context is not None else "")
        note(message)
    if "--json" in sys.argv:
        show_json({"error": message, "faults": []})
    return int(error.exit_code)
