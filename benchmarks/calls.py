"""What a vehicle's step costs: calls of the program per vehicle and step in four missions, and how that came about.

    python -m benchmarks calls
    python -m benchmarks.calls write "what the change buys"

The count is the same in every run and under every Python: of the functions of the program, without libraries, and
without comprehensions, which only some versions call. ``calls.toml`` is the ledger: an entry for each change after
which a mission takes 1 % more calls, or 1 % fewer, with what that buys. A test compares the last with what is counted.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tomllib
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

from benchmarks.house import ROOT
from benchmarks.measuring import row, setup_of
from missions.runs.assembly import assemble
from remoras.version import __version__

LEDGER = Path(__file__).with_name("calls.toml")
TOLERANCE = 0.01
"""A change of so much is worth an entry."""
MISSIONS: dict[str, tuple[str, float, tuple[str, ...]]] = {
    "mapping, PER 0.2": ("mapping-rendezvous", 600.0, ("channel.name=bernoulli", "channel.per=0.2")),
    "mapping, cbba, PER 0.4": (
        "mapping-patches", 300.0, ("strategy.name=cbba", "channel.name=bernoulli", "channel.per=0.4")
    ),
    "pandora": ("pandora-inspection", 600.0, ("fault=[]", "current.surge=[]")),
    "trident": ("trident-intervention", 600.0, ()),
}  # fmt: skip
"""By name: scenario, how much of it (s), and what is set. What is off in them costs nothing, or it shows here."""
SEED = 1


def calls_of_a_step(name: str) -> float:
    """Calls of the program per vehicle and step in a mission of ``MISSIONS``, in a process that remembers nothing."""
    command = [sys.executable, "-c", f"from benchmarks.calls import counted; print(counted({name!r}))"]
    return float(subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout)


def counted(name: str) -> float:
    """The same in this process: fewer, if it has made such a mission before."""
    scenario, duration_s, settings = MISSIONS[name]
    fleet = assemble(setup_of(scenario, f"scenario.duration_s={duration_s}", *settings), SEED)
    is_ours: dict[CodeType, bool] = {}
    n_calls = 0

    def count(frame: FrameType, event: str, _: Any) -> None:
        nonlocal n_calls
        if event != "call":
            return
        code = frame.f_code
        ours = is_ours.get(code)
        if ours is None:
            path, is_comprehension = code.co_filename, code.co_name.startswith("<") and code.co_name != "<lambda>"
            ours = is_ours[code] = path.startswith(str(ROOT)) and "site-packages" not in path and not is_comprehension
        n_calls += ours

    sys.setprofile(count)
    try:
        fleet.run()
    finally:
        sys.setprofile(None)
    n_steps: int = len(fleet.vehicles) * fleet.steps
    fleet.close()
    return n_calls / n_steps


def ledger() -> list[dict[str, Any]]:
    """Entries, the newest last: ``version``, ``change`` and ``calls`` by mission."""
    found: list[dict[str, Any]] = tomllib.loads(LEDGER.read_text(encoding="utf-8"))["entry"]
    return found


def write(change: str) -> None:
    """Add an entry of what is counted now.

    Args:
        change: what was changed, and what it buys.
    """
    lines = [f'\n[[entry]]\nversion = "{__version__}"\nchange = {json.dumps(change)}\n\n[entry.calls]']
    lines += [f'"{name}" = {calls_of_a_step(name):.1f}' for name in MISSIONS]
    with LEDGER.open("a", encoding="utf-8") as file:
        file.write("\n".join(lines) + "\n")


def rows() -> list[dict[str, Any]]:
    """Benchmark rows: calls of a step now over those of the first entry of the ledger."""
    first = ledger()[0]["calls"]
    found = []
    for name in MISSIONS:
        n_calls = calls_of_a_step(name)
        found.append(row(f"calls of a vehicle-step, {name}", n_calls, "calls", "the first of the ledger", first[name]))
    return found


def main() -> None:
    """Write an entry."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", choices=["write"])
    parser.add_argument("change", help="what was changed, and what it buys")
    write(parser.parse_args().change)


if __name__ == "__main__":
    main()
