"""What an installation without extras takes: the packages that are required, and how large they are.

By what each installed distribution says of its files; modules that Python compiles are left out, since an installer
may do without them. They add a quarter.
"""

from __future__ import annotations

from importlib import metadata
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement

import remoras
from benchmarks.measuring import row

NAME, MB = "remoras-sim", 1e6
MOST_MB, MOST_REQUIRED = 400.0, 11.0
OWN = ("worldmodel", "exchange", "remoras", "missions", "visualisation")
SHOWN = 4
"""So many of the largest have a row of their own."""


def required(name: str) -> list[str]:
    """Names of the distributions that one requires without extras, on this machine."""
    needs = [Requirement(text) for text in metadata.requires(name) or ()]
    return sorted({need.name.lower() for need in needs if need.marker is None or need.marker.evaluate({"extra": ""})})


def closure(name: str) -> dict[str, float]:
    """Size (MB) of each distribution that one requires, directly or not."""
    sizes: dict[str, float] = {}
    waiting = required(name)
    while waiting:
        other = waiting.pop()
        if other not in sizes:
            sizes[other] = size_mb(other)
            waiting += required(other)
    return sizes


def size_mb(name: str) -> float:
    """Size (MB) of the files of a distribution, without compiled modules."""
    paths = [Path(str(file.locate())) for file in metadata.files(name) or () if file.suffix != ".pyc"]
    return sum(path.stat().st_size for path in paths if path.is_file()) / MB


def own_mb() -> float:
    """Size (MB) of this program's own packages."""
    root = Path(str(remoras.__file__)).parents[1]
    files = (path for name in OWN for path in (root / name).rglob("*") if path.suffix != ".pyc" and path.is_file())
    return sum(path.stat().st_size for path in files) / MB


def rows() -> list[dict[str, Any]]:
    """Benchmark rows."""
    sizes = closure(NAME)
    whole_mb, n_required = sum(sizes.values()) + own_mb(), float(len(required(NAME)))
    largest = sorted(sizes, key=lambda name: -sizes[name])[:SHOWN]
    return [
        row("required packages", n_required, "", "limit", MOST_REQUIRED, goal="<= 1"),
        row(f"installed without extras, {len(sizes)} packages", whole_mb, "MB", "limit", MOST_MB, goal="<= 1"),
        row(
            "of these Mesa and what it requires", sum(closure("mesa").values()) + size_mb("mesa"), "MB", "all", whole_mb
        ),
        *(row(f"of these {name}", sizes[name], "MB", "all", whole_mb) for name in largest),
    ]
