"""CPU of a live run at full speed, watched by nobody and by one reader, against ``run`` of the same scenario.

The ratio is to be at most 1.2 unwatched, and 1.4 with a reader.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

from benchmarks.measuring import row

SCENARIOS = (
    ("4 vehicles", ("mapping-rendezvous", "--per", "0.6")),
    ("50 vehicles", ("mapping-patches", "--per", "0.6", "--set", "fleet.size=50", "--set", "scenario.duration_s=1200")),
)
REPEATS = 3
READ_EVERY_S = 0.4


def rows() -> list[dict[str, Any]]:
    """Benchmark rows."""
    found: list[dict[str, Any]] = []
    for name, arguments in SCENARIOS:
        usual_s = _least_s(partial(_run, arguments))
        for who, is_read in (("unwatched", False), ("one reader", True)):
            live_s = _least_s(partial(_live, arguments, is_read))
            found.append(row(f"live, {name}, {who}", live_s, "s CPU", "run", usual_s))
    return found


def _least_s(work: Callable[[], None]) -> float:
    """CPU time (s) of processes that ended during some work; the least of several times, which other work disturbs."""
    spent_s = []
    for _ in range(REPEATS):
        before = os.times()
        work()
        after = os.times()
        spent_s.append(after.children_user + after.children_system - before.children_user - before.children_system)
    return min(spent_s)


def _run(arguments: tuple[str, ...]) -> None:
    with tempfile.TemporaryDirectory() as scratch:
        out = str(Path(scratch) / "out")
        subprocess.run([*_command("run"), *arguments, "--out", out], stdout=subprocess.DEVNULL, check=False)
        assert Path(out).is_dir(), "the run wrote nothing"


def _live(arguments: tuple[str, ...], is_read: bool) -> None:
    """A live run at full speed from its start to its end, which writes its results as ``run`` does."""
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch) / "out"
        process = subprocess.Popen(
            [*_command("live"), *arguments, "--out", str(out), "--no-browser"],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        )  # fmt: skip
        assert process.stdout is not None
        url = process.stdout.readline().strip()
        for what in ({"do": "speed", "speed": "full"}, {"do": "start"}):
            asked = Request(f"{url}control", json.dumps(what).encode(), {"Content-Type": "application/json"})
            urlopen(asked).close()
        number = 0
        while not out.is_dir():
            time.sleep(READ_EVERY_S)  # this process is not measured
            if is_read:
                with urlopen(f"{url}news?{number}") as answer:
                    number = json.load(answer)["number"]
        process.send_signal(signal.SIGINT)
        process.wait()


def _command(name: str) -> list[str]:
    return [sys.executable, "-c", "from remoras.cli import main; main()", name]
