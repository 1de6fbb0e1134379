"""Run benchmarks: modules here with a function ``rows``.

Other modules are shared functions, or commands of their own, such as ``python -m benchmarks.tuning``.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
from typing import Any

BENCHMARKS = ("htn", "install", "instructions", "live", "organisation", "seas", "speed", "worldmodel")


def main() -> int:
    """Run the named benchmarks, all of them without a name, and print their rows."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("name", nargs="*", help=f"of {', '.join(BENCHMARKS)}")
    parser.add_argument("--json", action="store_true", help="print one JSON value and nothing else")
    arguments = parser.parse_args()
    unknown = sorted(set(arguments.name) - set(BENCHMARKS))
    if unknown:
        parser.error(f"unknown benchmark {', '.join(unknown)}: allowed are {', '.join(BENCHMARKS)}")
    results: list[dict[str, Any]] = []
    for name in arguments.name or BENCHMARKS:
        rows = importlib.import_module(f"benchmarks.{name}").rows()
        results += rows
        if not arguments.json:
            print(*map(_line, rows), sep="\n", flush=True)
    if arguments.json:
        print(json.dumps(results, indent=2))
    return 0


def _line(row: dict[str, Any]) -> str:
    """A row as text, with the goal of a row that has one, and whether it is met."""
    if row["value"] is None:
        return f"{row['name']:<40} n/a: {row['why']}"
    goal = f"   {row['goal']}: {'met' if row['met'] else 'NOT MET'}" if "goal" in row else ""
    return (
        f"{row['name']:<40} {row['value']:>10.4g} {row['unit']:<8} {row['ratio']:>8.3g} x "
        f"{row['reference']} ({row['reference_value']:.4g}){goal}"
    )


if __name__ == "__main__":
    sys.exit(main())
