"""The application that the commands belong to, and what they share: errors, JSON, names."""

from __future__ import annotations

import functools
import json
import sys
from collections.abc import Callable, Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, NoReturn, ParamSpec

import typer

OK, FAILED, USAGE, INTERRUPTED = 0, 1, 2, 130

app = typer.Typer(
    help="Fleets of autonomous marine vehicles: organisation and knowledge over a lossy acoustic channel.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
Parameters = ParamSpec("Parameters")


class CommandFault(Exception):
    """A command cannot go on.

    Args:
        message: for the user.
        code: to exit with.
    """

    def __init__(self, message: str, code: int = USAGE) -> None:
        super().__init__(message)
        self.code = code


def fail(message: str, code: int = USAGE) -> NoReturn:
    """End the command with one clear message on the standard error; with --json there is one JSON value of it, too."""
    raise CommandFault(message, code)


def _report(error: Exception, as_json: bool) -> None:
    """Tell a fault: a message for people, and one JSON value where that was asked for."""
    print(f"remoras: {error}", file=sys.stderr)
    if as_json:
        faults = getattr(error, "faults", ())
        listed = [{"key": f.key, "given": f.given, "allowed": f.allowed, "line": f.line} for f in faults]
        show_json({"error": str(error), "faults": listed})


def one_of(what: str, name: str, known: Sequence[str]) -> None:
    """Fail unless ``name`` is one of ``known``."""
    if name not in known:
        from worldmodel import suggestion

        fail(f"{what} {name!r}: allowed are {', '.join(known)}{suggestion(name, known)}")


def command(name: str) -> Callable[[Callable[Parameters, None]], Callable[Parameters, None]]:
    """A command whose user errors become one message and whose interruption exits with 130."""

    def register(function: Callable[Parameters, None]) -> Callable[Parameters, None]:
        @functools.wraps(function)
        def reported(*args: Parameters.args, **kwargs: Parameters.kwargs) -> None:
            as_json = bool(kwargs.get("as_json"))
            try:
                function(*args, **kwargs)
            except KeyboardInterrupt:
                print("remoras: interrupted", file=sys.stderr)
                raise typer.Exit(INTERRUPTED) from None
            except BrokenPipeError:
                sys.stderr.close()
                raise typer.Exit(OK) from None
            except CommandFault as error:
                _report(error, as_json)
                raise typer.Exit(error.code) from None
            except Exception as error:
                if not isinstance(error, OSError) and not _is_users_fault(error):
                    raise
                _report(error, as_json)
                raise typer.Exit(USAGE) from None

        app.command(name)(reported)
        return function

    return register


def _is_users_fault(error: Exception) -> bool:
    from exchange.errors import ExchangeError
    from missions.errors import MissionsError
    from remoras.errors import RemorasError
    from visualisation.errors import VisualisationError
    from worldmodel import WorldModelError

    return isinstance(error, ExchangeError | MissionsError | RemorasError | VisualisationError | WorldModelError)


def show_json(value: Any) -> None:
    """Print one JSON value on the standard output."""
    print(json.dumps(value, indent=2, allow_nan=False))


class Format(StrEnum):
    """Formats of figures."""

    PNG = "png"
    SVG = "svg"
    PDF = "pdf"
    GIF = "gif"


Json = Annotated[bool, typer.Option("--json", help="Print one JSON value and nothing else.")]


def _show_version(wanted: bool) -> None:
    if wanted:
        from importlib import metadata

        print(f"remoras {metadata.version('remoras')}")
        raise typer.Exit(OK)


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


def main() -> None:
    """Entry point of the ``remoras`` command; ``module:object`` is looked for in the current folder too."""
    sys.path.append(str(Path.cwd()))
    if "--json" not in sys.argv:
        app()
    try:
        code = app(standalone_mode=False)
    except typer.Abort:
        code = INTERRUPTED
    except Exception as error:  # an option that is not there, an argument that is missing: typer has no name for these
        if not hasattr(error, "format_message"):
            raise
        error.show()  # type: ignore[attr-defined]
        show_json({"error": error.format_message(), "faults": []})
        code = error.exit_code  # type: ignore[attr-defined]
    sys.exit(code)
