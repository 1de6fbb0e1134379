"""What one must hold in mind: files that a run enters for each event, calls of a step, files that name a feature, names
that stand for two things.

    python -m benchmarks house
    python -m benchmarks.house mapping-corridor --set channel.per=0.5
    python -m benchmarks.house --against OLDER_CHECKOUT

A file is entered if one of its functions is called between the call of an event's function and its return. Counts are
of the program alone, without libraries, and the same in every run. ``--against`` also gives the CPU of the mission of
``benchmarks.mission`` over that of another checkout: the least of some runs of each in turn, each in its own process.
"""

from __future__ import annotations

import argparse
import ast
import re
import statistics
import subprocess
import sys
from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType
from typing import Any

from benchmarks.measuring import row, setup_of
from exchange.manager import ExchangeManager
from missions.runs.assembly import assemble
from remoras.vehicle import Vehicle

ROOT = Path(__file__).parents[1]
PACKAGES = ("remoras", "exchange", "missions", "worldmodel", "visualisation", "stress")
SCENARIO, SETTINGS, SEED = "mapping-rendezvous", ("channel.name=bernoulli", "channel.per=0.3"), 3
EVENTS: dict[str, tuple[Callable[..., Any], int]] = {
    "packet heard": (Vehicle.hear, 25), "packet spoken": (Vehicle.speak, 28),
    "packet_to_send": (ExchangeManager.packet_to_send, 10), "offer": (ExchangeManager.offer, 6),
}  # fmt: skip
"""The function of each event, and the most files that it should enter (median)."""
_KINDS = "lost|mute|deaf|slow|sensor|joins|biased|restarts|drains"
_BESIDE = rf"[\"']{{0}}[\"'](, *|: [^,]*, )[\"']({_KINDS})[\"']|[\"']({_KINDS})[\"'](, *|: [^,]*,\s+)[\"']{{0}}[\"']"
"""Two kinds of faults one behind the other: their names have other meanings, too."""
FEATURES = {
    "operator bans": r"bans\b|\bBan\b|ban_", "emission control": r"[Cc]overt", "clocks": r"OwnClock|[Tt]imekeep",
    "slot lists": r"NewSlots|SlotList|slot_list", "obligations": r"[Oo]bligation",
    "coarse values": r"coarse_above|Detail\(",
    "current": r'\bCurrent\b|CurrentTable|\bthrough_water|of(_feature)?\("current"',
    "navigation error": r'\bNavigation\b|Navigation[TC]|Adrift|FixingPosition|of(_feature)?\("navigation"',
    "terms of needs": r"blackout_s|newest_first|time_to_live", "beacons": r"[Bb]eacon", "parking": r"parking|parked",
    "relaying": r"\bRelaying\b|relaying\.",
    "bound strategy": r"is_bound|Bound\(|remoras\.bound|RadioAtOnce",
    **{
        f"kind of fault {kind}": rf"FaultKind\.{kind.upper()}|`{kind}`|[kK]ind = .{kind}\b|[\"']{kind}[\"']" + more
        for kind, more in {
            "mute": "", "deaf": "", "slow": "|SLOW_FACTOR", "joins": "|NOT_OF_JOINS", "drains": "|drain_w",
            "biased": r"|[Bb]iases|Bias\(|biased\(", "restarts": "|keeps_memory|MOST_RESTARTS|MEMORY_KEPT",
        }.items()
    },
    "kind of fault lost": r"FaultKind\.LOST|``lost``|[kK]ind = .lost\b., |.lost.: \w*Kind|" + _BESIDE.format("lost"),
    "kind of fault sensor": r"FaultKind\.SENSOR|``sensor``|[kK]ind = .sensor\b.|" + _BESIDE.format("sensor"),
}  # fmt: skip
"""Words by which a file shows that it knows of a feature. ``way_through_water`` of the checker is no
``through_water``: it is the way that any vehicle goes, whether the water moves or not."""
MOST_FILES, MOST_SHARED_NAMES = 3, 60
TIMED = """
import sys
sys.meta_path[:] = [one for one in sys.meta_path if "editable" not in repr(one)]
sys.path.insert(0, "")
from benchmarks.mission import mission_cpu_s
print(mission_cpu_s()[0])
"""
TRIES = 3


def entered(scenario: str, settings: Sequence[str], seed: int) -> tuple[dict[str, list[int]], float]:
    """Files entered in each event of a run, and calls of the program per vehicle and step.

    Args:
        scenario: shipped name or file.
        settings: KEY=VALUE of it.
        seed: of the run.
    """
    fleet = assemble(setup_of(scenario, *settings), seed)
    names = {of.__code__: name for name, (of, _) in EVENTS.items()}
    files: dict[Any, str] = {}
    found: dict[str, list[int]] = defaultdict(list)
    under_way: list[tuple[Any, set[str]]] = []
    n_calls = 0

    def follow(frame: FrameType, event: str, _: Any) -> None:
        nonlocal n_calls
        code = frame.f_code
        if event == "call":
            file = files.get(code)
            if file is None:
                path = code.co_filename
                file = files[code] = path if path.startswith(str(ROOT)) and "site-packages" not in path else ""
            if not file:
                return
            n_calls += 1
            if code in names:
                under_way.append((frame, set()))
            for _, seen in under_way:
                seen.add(file)
        elif event == "return" and under_way and under_way[-1][0] is frame:
            found[names[code]].append(len(under_way.pop()[1]))

    sys.setprofile(follow)
    try:
        fleet.run()
    finally:
        sys.setprofile(None)
    n_steps = len(fleet.vehicles) * fleet.steps
    fleet.close()
    return found, n_calls / n_steps


def naming() -> dict[str, int]:
    """How many source files name each feature."""
    texts = [file.read_text(encoding="utf-8") for package in PACKAGES for file in (ROOT / package).rglob("*.py")]
    return {name: sum(re.search(words, text) is not None for text in texts) for name, words in FEATURES.items()}


def shared_names() -> dict[str, list[str]]:
    """Public functions and classes that two or more modules define on their top level, with the files of each."""
    homes: dict[str, list[str]] = defaultdict(list)
    files = (file for package in PACKAGES for file in sorted((ROOT / package).rglob("*.py")))
    for file in (file for file in files if "templates" not in file.parts):
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
                homes[node.name].append(file.relative_to(ROOT).as_posix())
    return {name: files for name, files in sorted(homes.items()) if len(set(files)) > 1}


def cpu_s(checkout: Path) -> float:
    """CPU of the run that ``benchmarks.mission`` measures, in a process that takes the program from a checkout (s)."""
    command = [sys.executable, "-c", TIMED]
    return float(subprocess.run(command, cwd=checkout, stdout=subprocess.PIPE, text=True, check=True).stdout)


def rows(
    scenario: str = SCENARIO, settings: Sequence[str] = SETTINGS, seed: int = SEED, against: Path | None = None
) -> list[dict[str, Any]]:
    """Benchmark rows: files entered for each event, calls, files that name a feature, and CPU over another checkout."""
    found, n_calls = entered(scenario, settings, seed)
    made = [
        _row(f"files entered, {name}", statistics.median(found[name]), "files", most, max(found[name]))
        for name, (_, most) in EVENTS.items()
        if found[name]
    ]
    made.append(_row("calls of a vehicle-step", n_calls, "calls", None, n_calls))
    made += [_row(f"files that name {name}", n, "files", MOST_FILES, n) for name, n in naming().items()]
    n_shared = len(shared_names())
    made.append(_row("names in two modules or more", n_shared, "names", MOST_SHARED_NAMES, n_shared))
    if against is not None:
        pairs = [[cpu_s(path) for path in (ROOT, against)] for _ in range(TRIES)]
        own_s, other_s = (min(column) for column in zip(*pairs, strict=True))
        made.append(_row("CPU of the run over the other's", own_s / other_s, "x", 1.5, other_s))
    return made


def _row(name: str, value: float, unit: str, most: float | None, reference: float) -> dict[str, Any]:
    ratio = value / reference if reference else 1.0
    return row(name, value, unit, "the most", reference, ratio, "" if most is None else f"<= {most:g}", value)


def main() -> None:
    """Print the rows of a scenario."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", nargs="?", default=SCENARIO)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--against", type=Path, help="another checkout, of which the CPU is compared")
    given = parser.parse_args()
    settings = given.set or (SETTINGS if given.scenario == SCENARIO else ())
    for told in rows(given.scenario, settings, given.seed, given.against):
        goal = f"   {told['goal']}: {'met' if told['met'] else 'NOT MET'}" if "goal" in told else ""
        print(f"{told['name']:<36} {told['value']:>8.4g} {told['unit']:<6} at most {told['reference_value']:.4g}{goal}")


if __name__ == "__main__":
    main()
