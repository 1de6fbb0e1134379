"""Does another version of the program give the same results? Run 40 configurations with each, compare row by row.

    python tests/tools/same_results.py make OLD --python OLD_VENV/bin/python
    python tests/tools/same_results.py make NEW
    python tests/tools/same_results.py compare OLD NEW

``make`` runs ``remoras run`` once per configuration; folders that are complete are kept. ``compare`` reads every table
that both versions wrote, whatever else they write, and every field of the summary that both have but ``wall_s``. It
prints the first difference of each and exits with 1 if there is one.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq

STRATEGIES = ("remoras", "fixed-partition", "central", "contract-net", "status-broadcast", "cbba", "rendezvous-sync")
POLICIES = ("ack", "ack-repeat", "m-ack", "m-ack-repeat", "mps-ack", "mps-ack-repeat")
MACHINE = {"wall_s"}
TOLERANCE = 1e-9


def configurations() -> dict[str, list[str]]:
    """Arguments of ``remoras run`` by name: both scenarios, all strategies and policies, four channels, seeds."""
    found: dict[str, list[str]] = {}
    for scenario in ("mapping-rendezvous", "mapping-patches"):
        for strategy in STRATEGIES:
            found[f"{scenario}-{strategy}"] = [scenario, "--strategy", strategy, "--per", "0.4", "--seed", "7"]
    for policy in POLICIES:
        found[f"policy-{policy}"] = ["mapping-rendezvous", "--policy", policy, "--per", "0.6", "--seed", "3"]
        found[f"patches-{policy}"] = ["mapping-patches", "--policy", policy, "--per", "0.2", "--seed", "5"]
    found["perfect"] = ["mapping-rendezvous", "--channel", "perfect"]
    found["patches-perfect"] = ["mapping-patches", "--channel", "perfect"]
    for strategy in ("remoras", "central", "cbba"):
        bursts = [
            "--channel",
            "gilbert-elliott",
            "--set",
            "channel.per_bad=0.9",
            "--strategy",
            strategy,
            "--seed",
            "11",
        ]
        found[f"bursts-{strategy}"] = ["mapping-rendezvous", *bursts]
    link = "channel.link=[{sender='AUV01', receiver='AUV00', per=0.9}]"
    found["matrix"] = ["mapping-rendezvous", "--channel", "matrix", "--per", "0.3", "--set", link, "--seed", "2"]
    found["blackout"] = [
        "mapping-rendezvous", "--per", "0.2", "--set",
        "channel.blackout=[{from_s=400.0, until_s=900.0, vehicle='AUV02'}]",
    ]  # fmt: skip
    found["heavy-loss"] = ["mapping-rendezvous", "--per", "0.8", "--seed", "9"]
    found["patches-heavy-loss"] = ["mapping-patches", "--per", "0.9", "--seed", "4", "--strategy", "contract-net"]
    found["spread"] = ["mapping-patches", "--per", "0.5", "--set", "uncertainty.speed_spread=0.3", "--seed", "6"]
    found["eight"] = ["mapping-rendezvous", "--per", "0.5", "--set", "fleet.size=8", "--seed", "8"]
    found["low-battery"] = ["mapping-patches", "--per", "0.1", "--set", "vehicle.AUV02.energy_j=200000", "--seed", "1"]
    found["ten-copies"] = ["mapping-patches", "--per", "0.3", "--set", "fleet.size=10", "--strategy", "central"]
    found["no-influence"] = ["mapping-rendezvous", "--per", "0.1", "--set", "decision.weight_external=0"]
    return found


def make(folder: Path, python: str, jobs: int) -> None:
    """Run every configuration that ``folder`` does not have yet."""

    def run(name: str, arguments: list[str]) -> None:
        out = folder / name
        if not (out / "summary.json").is_file():
            command = [python, "-c", "from remoras.cli import main; main()", "run", *arguments, "--out", str(out)]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if not (out / "summary.json").is_file():
                raise SystemExit(f"{name}: {' '.join(command)}\n{done.stderr}")

    folder.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(jobs) as pool:
        list(pool.map(lambda item: run(*item), configurations().items()))


def differences(old: Path, new: Path) -> list[str]:
    """What differs between two folders of results, a line for each table or field."""
    found = []
    before, after = (json.loads((folder / "summary.json").read_text(encoding="utf-8")) for folder in (old, new))
    for field in before.keys() & after.keys() - MACHINE:
        if not alike(before[field], after[field]):
            found.append(f"summary {field}: {before[field]} != {after[field]}")
    found += [f"summary {field}: gone" for field in before.keys() - after.keys()]
    for path in sorted(old.glob("*.parquet")):
        if not (new / path.name).is_file():
            found.append(f"{path.name}: gone")
            continue
        rows, new_rows = (pq.read_table(folder / path.name).to_pylist() for folder in (old, new))
        columns = rows[0].keys() & new_rows[0].keys() if rows and new_rows else ()
        unlike = next(
            (
                n
                for n, (a, b) in enumerate(zip(rows, new_rows, strict=False))
                if any(not alike(a[c], b[c]) for c in columns)
            ),
            None,
        )
        if len(rows) != len(new_rows):
            found.append(f"{path.name}: {len(rows)} rows != {len(new_rows)}")
        if unlike is not None:
            found.append(f"{path.name} row {unlike}: {rows[unlike]} != {new_rows[unlike]}")
    return found


def alike(one: Any, other: Any) -> bool:
    """Equal, numbers up to rounding."""
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=TOLERANCE, abs_tol=TOLERANCE) or (math.isnan(one) and math.isnan(other))
    return bool(one == other)


def compare(old: Path, new: Path) -> int:
    """Print how many configurations differ, and how; the exit code."""
    names = [name for name in configurations() if (old / name).is_dir()]
    unlike = {name: found for name in names if (found := differences(old / name, new / name))}
    for name, found in unlike.items():
        print(name, *found, sep="\n    ")
    print(f"{len(names)} configurations compared, {len(unlike)} differ")
    return 1 if unlike or not names else 0


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    commands = parser.add_subparsers(dest="command", required=True)
    making = commands.add_parser("make")
    making.add_argument("folder", type=Path)
    making.add_argument("--python", default=sys.executable)
    making.add_argument("--jobs", type=int, default=2)
    comparing = commands.add_parser("compare")
    comparing.add_argument("old", type=Path)
    comparing.add_argument("new", type=Path)
    given = parser.parse_args()
    if given.command == "make":
        make(given.folder, given.python, given.jobs)
        return 0
    return compare(given.old, given.new)


if __name__ == "__main__":
    sys.exit(main())
