"""Instructions that the processor executes for one mission, counted by Valgrind: the gate for speed.

A child process runs ``mapping-rendezvous`` under ``valgrind --tool=cachegrind``; the count of the same process without
the run is subtracted. Two counts of one version differ by 0.1 %, whatever else the machine does. It takes a minute.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from typing import Any

from benchmarks.measuring import row

SCENARIO, PER, SEED = "mapping-rendezvous", 0.2, 1
REFERENCE = 3.575
"""Instructions (10^9) of this version, with CPython 3.11 on x86-64. A change that saves instructions lowers it."""
CHILD = f"""
import sys
from benchmarks.measuring import setup_of
from missions.runs.assembly import assemble
fleet = assemble(setup_of({SCENARIO!r}, "channel.per={PER}"), {SEED})
if "run" in sys.argv:
    fleet.run()
"""
COUNTED = re.compile(r"I\s+refs:\s+([\d,]+)")


def instructions(*arguments: str) -> int:
    """Instructions of the child process; with the argument ``run`` it runs the mission."""
    command = ["valgrind", "--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null"]
    environment = {**os.environ, "PYTHONHASHSEED": "0"}
    done = subprocess.run(
        [*command, sys.executable, "-c", CHILD, *arguments], env=environment, capture_output=True, text=True, check=True
    )
    match = COUNTED.search(done.stderr)
    assert match is not None, done.stderr
    return int(match[1].replace(",", ""))


def rows() -> list[dict[str, Any]]:
    """Benchmark row: instructions of the mission over those of the reference."""
    name = f"instructions of a mission, PER {PER}"
    if shutil.which("valgrind") is None:
        return [row(name, None, "10^9", "reference", REFERENCE, why="valgrind is not installed")]
    subprocess.run([sys.executable, "-c", CHILD], check=True)  # fills the caches on disk
    n_instructions = instructions("run") - instructions()
    return [row(name, n_instructions / 1e9, "10^9", "reference", REFERENCE)]
