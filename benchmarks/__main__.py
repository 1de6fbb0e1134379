"""Run benchmarks: modules here with a function ``rows``.

``dividing`` is part of ``organisation``; ``measuring`` holds shared functions. Separate commands, such as ``python -m
benchmarks.tuning``: ``contest``, ``crossing``, ``healing``, ``holdings``, ``intervals``, ``mechanisms``, ``site``,
``tuning``, ``under_loss`` and ``variants``.
"""

from __future__ import annotations

import argparse
import importlib
import json
import pkgutil
import sys
from typing import Any

import benchmarks

NO_BENCHMARKS = {
    "__main__", "contest", "crossing", "dividing", "healing", "holdings", "intervals", "measuring",
    "mechanisms", "site", "tuning", "under_loss", "variants",
}  # fmt: skip


def main() -> int:
    """Run the named benchmarks, all of them without a name, and print their rows."""
    modules = {info.name for info in pkgutil.iter_modules(benchmarks.__path__)}
    names = sorted(modules - NO_BENCHMARKS)
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("name", nargs="*", help=f"of {', '.join(names)}")
    parser.add_argument("--json", action="store_true", help="print one JSON value and nothing else")
    arguments = parser.parse_args()
    unknown = sorted(set(arguments.name) - set(names))
    if unknown:
        parser.error(f"unknown benchmark {', '.join(unknown)}: allowed are {', '.join(names)}")
    results: list[dict[str, Any]] = []
    for name in arguments.name or names:
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
