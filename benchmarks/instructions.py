"""Instructions that the processor executes for missions, counted by Valgrind: the gate for speed.

A child process runs a mission under ``valgrind --tool=cachegrind``; the count of the same process without the run is
subtracted. Two counts of one version differ by 0.1 %, whatever else the machine does. A mission takes a minute.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from typing import Any

from benchmarks.measuring import row

PATCHES = ("strategy.name=cbba", "channel.name=bernoulli", "channel.per=0.4", "scenario.duration_s=600.0")
MISSIONS: dict[str, tuple[tuple[str, ...], float]] = {
    "mapping-rendezvous": (("channel.per=0.2",), 3.316),
    "mapping-patches": (PATCHES, 1.0),
    "pandora-day": (("scenario.duration_s=900.0", "current.surge=[]", "fault=[]"), 1.0),
    "trident-intervention": (("channel.per=0.2", "scenario.duration_s=1500.0"), 1.0),
    "arrows-archaeology": (("scenario.duration_s=1500.0",), 1.0),
}
"""By scenario: settings; instructions (10^9) of this version, CPython 3.11, x86-64. Lower what a change saves."""
CHILD = """
import sys
from benchmarks.measuring import setup_of
from missions.runs.assembly import assemble
fleet = assemble(setup_of(*sys.argv[2:]), 1)
if sys.argv[1] == "run":
    fleet.run()
"""
COUNTED = re.compile(r"I\s+refs:\s+([\d,]+)")


def instructions(*arguments: str) -> int:
    """Instructions of the child process; arguments: ``run`` or ``assemble``, scenario, settings."""
    command = ["valgrind", "--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null"]
    environment = {**os.environ, "PYTHONHASHSEED": "0"}
    done = subprocess.run(
        [*command, sys.executable, "-c", CHILD, *arguments], env=environment, capture_output=True, text=True, check=True
    )
    count = COUNTED.search(done.stderr)
    assert count is not None, done.stderr
    return int(count[1].replace(",", ""))


def rows() -> list[dict[str, Any]]:
    """Benchmark rows: instructions of each mission over those of the reference."""
    return [_row(scenario, settings, reference) for scenario, (settings, reference) in MISSIONS.items()]


def _row(scenario: str, settings: tuple[str, ...], reference: float) -> dict[str, Any]:
    name = f"instructions, {scenario}"
    if shutil.which("valgrind") is None:
        return row(name, None, "10^9", "reference", reference, why="valgrind is not installed")
    arguments = (scenario, *settings)
    subprocess.run([sys.executable, "-c", CHILD, "assemble", *arguments], check=True)  # fills the caches on disk
    n_instructions = instructions("run", *arguments) - instructions("assemble", *arguments)
    return row(name, n_instructions / 1e9, "10^9", "reference", reference)
