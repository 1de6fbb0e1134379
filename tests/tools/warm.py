"""Pytest in a fork of this process, which has imported the libraries once for all that are asked.

What is tested is imported in the fork alone, so each sees the program as it is at that moment. Times are CPU times: on
a busy machine nothing else would say the same twice.
"""

from __future__ import annotations

import importlib
import os
import re
import resource
import signal
import sys
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.tools.limited import HANGS_S, LIMIT

LIBRARIES = (
    "hypothesis", "matplotlib.figure", "mesa", "numpy", "pandas", "pyarrow.parquet", "pydantic", "rdflib",
    "scipy.optimize", "scipy.stats",
)  # fmt: skip
"""What most tests come to import."""
OPTIONS = ("-q", "-x", "-rfE", "-p", "no:warnings", "-p", "no:cacheprovider", "-p", "tests.tools.limited")
FAILED_TEST = re.compile(r"^(?:FAILED|ERROR) (tests/.+?)(?: - .*)?$", re.MULTILINE)
IS_SOUND = re.compile(r"\d+ (?:passed|deselected)|no tests ran")
UNLOADED = "no test can be loaded"
IN_ALL = 20
"""A session that has taken this many times its CPU time by the clock on the wall waits for what never comes."""


class Answer(NamedTuple):
    """What tests say.

    Attributes:
        failed: the test that failed first, ``UNLOADED``, "does not end", or None.
        cpu_s: what they took (s).
    """

    failed: str | None
    cpu_s: float


def load() -> None:
    """Import the libraries, those that are there."""
    for name in LIBRARIES:
        with suppress(ImportError):
            importlib.import_module(name)


def ask(root: Path, tests: Iterable[str], left_out: Iterable[str], limit_s: float) -> Answer:
    """Run tests of a checkout up to the first that fails.

    Args:
        root: of the checkout; tests: as pytest takes them; left_out: tests that are not asked.
        limit_s: CPU time after which no further test is asked (s).
    """
    arguments = [*OPTIONS, *(f"--deselect={name}" for name in left_out), *tests]
    with tempfile.TemporaryFile() as output:
        sys.stdout.flush()
        if (process := os.fork()) == 0:
            _become_pytest(root, arguments, limit_s, output.fileno())
        _, status, used = os.wait4(process, 0)
        with suppress(ProcessLookupError):  # what tests left behind
            os.killpg(process, signal.SIGKILL)
        output.seek(0)
        said = output.read().decode(errors="replace")
    cpu_s = used.ru_utime + used.ru_stime
    if os.WIFSIGNALED(status):
        return Answer("does not end", cpu_s)
    failed = FAILED_TEST.search(said)
    if failed is not None:
        return Answer(failed[1], cpu_s)
    return Answer(None if IS_SOUND.search(said) else UNLOADED, cpu_s)


def _become_pytest(root: Path, arguments: list[str], limit_s: float, output: int) -> None:
    """What the fork does; it never returns."""
    try:
        os.setpgid(0, 0)
        for stream in (1, 2):
            os.dup2(output, stream)
        _, hard = resource.getrlimit(resource.RLIMIT_CPU)
        most_s = int(limit_s + 2.0 * HANGS_S)
        resource.setrlimit(resource.RLIMIT_CPU, (most_s, hard))
        signal.alarm(IN_ALL * most_s)
        os.chdir(root)
        os.environ |= {"PYTHONPATH": str(root), "PYTHONPYCACHEPREFIX": str(root / ".compiled"), LIMIT: str(limit_s)}
        os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"
        sys.dont_write_bytecode, sys.pycache_prefix = False, str(root / ".compiled")
        sys.path[0] = str(root)
        status = int(pytest.main(arguments))
        sys.stdout.flush()
    except BaseException:  # of a mutant, whatever it is
        status = 3
    os._exit(status)
