"""Ctrl-C and SIGTERM end a command with one line, the exit code of the signal and no partial results."""

import subprocess
import sys
from pathlib import Path

import pytest

RUN = ("run", "mapping-rendezvous", "--set", "scenario.duration_s=30")
WHILE_LOADING = """
class Signalling:
    def find_spec(self, name, *_):
        if name == {module!r}:
            os.kill(os.getpid(), {number})
sys.meta_path.insert(0, Signalling())
"""
WHILE_RUNNING = """
from remoras.fleet.fleet import Fleet
record = Fleet._record
def signalling(self, now_s):
    record(self, now_s)
    if now_s >= 20.0:
        os.kill(os.getpid(), {number})
Fleet._record = signalling
"""
WHEN_WRITTEN = """
from missions.runs import results
write = results.write_results
def signalling(*given):
    write(*given)
    os.kill(os.getpid(), {number})
results.write_results = signalling
"""
ENDS = pytest.mark.parametrize(("number", "code", "said"), [(2, 130, "interrupted"), (15, 143, "terminated")])


def ended(trap: str, *arguments: object, handlers: str = "SIG_DFL") -> "subprocess.CompletedProcess[str]":
    """``remoras`` in a process of its own, which sends itself a signal.

    Args:
        trap: source that sends it.
        arguments: of the command.
        handlers: of both signals before the program begins.
    """
    before = f"import os, sys, signal\nfor number in (2, 15): signal.signal(number, signal.{handlers})\n"
    program = f"{before}{trap}\nfrom remoras.__main__ import main\nmain()"
    command = [sys.executable, "-c", program, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@ENDS
@pytest.mark.parametrize("module", ["remoras.cli.app", "numpy"])
def test_an_interruption_during_imports_is_reported_in_one_line(module: str, number: int, code: int, said: str) -> None:
    done = ended(WHILE_LOADING.format(module=module, number=number), *RUN)
    assert (done.returncode, done.stdout, done.stderr) == (code, "", f"remoras: {said}\n")


@pytest.mark.slow
@ENDS
def test_an_interrupted_run_writes_nothing(tmp_path: Path, number: int, code: int, said: str) -> None:
    out = tmp_path / "out"
    done = ended(WHILE_RUNNING.format(number=number), *RUN, "--out", out)
    assert (done.returncode, done.stdout) == (code, "")
    assert done.stderr == f"remoras: {said}\n"
    assert list(tmp_path.iterdir()) == []


def test_results_written_before_an_interruption_remain(tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = ended(WHEN_WRITTEN.format(number=15), *RUN, "--out", out)
    assert (done.returncode, done.stderr) == (143, "remoras: terminated\n")
    assert (out / "summary.json").is_file()


def test_ignored_signals_do_not_interrupt() -> None:
    """So does ``nohup``, and a shell with what it starts in the background."""
    done = ended(WHILE_LOADING.format(module="typer", number=2), "--version", handlers="SIG_IGN")
    assert done.returncode == 0
    assert done.stdout.startswith("remoras ")
