"""What starts cost: commands over a bare Python, and ``remoras run`` over the mission that it runs; and its memory.

Processes of this machine, one after another in turn, with files of compiled modules and tables of ontologies at hand as
after the first start. Ratios of CPU times are medians of pairs, with the least and the greatest of them in the name.
"""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.measuring import row

PAIRS = 7
COMMANDS: dict[str, tuple[tuple[str, ...], str]] = {
    "list": (("list",), "<= 13"),
    "validate": (("validate", "mapping-rendezvous"), "<= 15"),
    "explain": (("explain",), "<= 7"),
}
"""Arguments of each command, and its goal over a bare Python."""
LOSSY = ("channel.per=0.2",)
MISSION = (
    "import time; from benchmarks.measuring import run_cpu_s, setup_of;"
    f"print(run_cpu_s(setup_of('mapping-rendezvous', *{LOSSY!r}))[0])"
)
RUN_GOAL = "<= 2"
DAY, DAY_MB = "pandora-day", 200.0
PEAK = (
    "import resource, sys; from remoras.__main__ import main\n"
    "try: main()\n"
    "except SystemExit: pass\n"
    "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, file=sys.stderr)"
)


def _environment() -> dict[str, str]:
    """As a user has it: modules may be kept compiled."""
    return {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}


def cpu_s(*arguments: str) -> tuple[float, str]:
    """(CPU seconds of a Python with these arguments, what it printed)."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=True, env=_environment())
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done.stdout


def start_rows() -> list[dict[str, Any]]:
    """Commands over a bare Python."""
    bare_s: list[float] = []
    spent_s: dict[str, list[float]] = {name: [] for name in COMMANDS}
    for arguments, _ in COMMANDS.values():
        cpu_s("-m", "remoras", *arguments)  # what it keeps for the next time is kept now
    for _ in range(PAIRS):
        bare_s.append(cpu_s("-c", "pass")[0])
        for name, (arguments, _) in COMMANDS.items():
            spent_s[name].append(cpu_s("-m", "remoras", *arguments)[0])
    return [
        _row(f"remoras {name}", spent_s[name], "a bare Python", bare_s, goal) for name, (_, goal) in COMMANDS.items()
    ]


def run_rows() -> list[dict[str, Any]]:
    """``remoras run`` over its mission, and the peak of the memory of a long one."""
    whole_s: list[float] = []
    mission_s: list[float] = []
    with tempfile.TemporaryDirectory() as made:
        out = ("--out", str(Path(made) / "run"), "--force")
        for _ in range(PAIRS):
            settings = [part for setting in LOSSY for part in ("--set", setting)]
            whole_s.append(cpu_s("-m", "remoras", "run", "mapping-rendezvous", *settings, *out)[0])
            mission_s.append(float(cpu_s("-c", MISSION)[1]))
        command = [sys.executable, "-c", PEAK, "run", DAY, *out]
        done = subprocess.run(command, capture_output=True, text=True, check=True, env=_environment())
    peak_mb = int(done.stderr.split()[-1]) * 1024 / 1e6
    return [
        _row("remoras run", whole_s, "its mission", mission_s, RUN_GOAL),
        row(f"peak memory of remoras run {DAY}", peak_mb, "MB", "limit", DAY_MB, goal="<= 1"),
    ]


def _row(name: str, spent_s: list[float], reference: str, reference_s: list[float], goal: str) -> dict[str, Any]:
    ratios = [own / its for own, its in zip(spent_s, reference_s, strict=True)]
    shown = f"{name} ({min(ratios):.3g} to {max(ratios):.3g} x)"
    value_s, its_s = statistics.median(spent_s), statistics.median(reference_s)
    return row(shown, value_s, "s CPU", reference, its_s, statistics.median(ratios), goal)


def rows() -> list[dict[str, Any]]:
    """Benchmark rows."""
    return [*start_rows(), *run_rows()]
