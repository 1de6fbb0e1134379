"""Invocation of the command line: in this process, or as a program of its own."""

import sys

from typer.testing import CliRunner, Result

from remoras.cli import app

MAIN = "from remoras.cli import main; main()"
COMMAND = [sys.executable, "-c", MAIN]


def remoras(*arguments: object) -> Result:
    """Output and exit code of a command."""
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def refused(*arguments: object) -> str:
    """The message of a command that the user got wrong: exit 2, one message on stderr, nothing on stdout."""
    result = remoras(*arguments)
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    assert isinstance(result.exception, SystemExit)
    return result.stderr
