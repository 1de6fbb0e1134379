"""Which tests are nearest to a file of the program: by name, then by how many imports lie between."""

from __future__ import annotations

import ast
import heapq
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

PACKAGES = ("exchange", "missions", "remoras", "stress", "visualisation", "worldmodel")
WORD = re.compile(r"\w+")
REFERENCE = "tests/reference/test_reference_runs.py"
"""Holds the tables of short runs of all scenarios and strategies byte for byte: near to whatever a run rests on."""
FAR = ("tests/docs/", "tests/stress/", "tests/test_", "tests/tools/", "tests/benchmarks/")
"""Tests that are about something else, or ask everything and take long."""
N_NEAR = 6
"""Files of tests that are asked before ``REFERENCE``."""


def nearest(root: Path, file: str) -> list[str]:
    """Test files from near to far; those that reach the file by no import are left out.

    Args:
        root: of the checkout; file: of the program, from there.
    """
    importers = _importers(root)
    steps: dict[str, int] = {}
    waiting = [(0, file)]
    while waiting:
        step, found = heapq.heappop(waiting)
        if found not in steps:
            steps[found] = step
            for importer in sorted(importers[found]):
                heapq.heappush(waiting, (step + 1, importer))
    words = _defined(root / file)
    tests = [name for name in steps if Path(name).name.startswith("test_") and not name.startswith(FAR)]

    def rank(name: str) -> tuple[bool, int, int, str]:
        return not _bears_name(name, file), -_n_words(root / name, words), steps[name], name

    ranked = sorted(tests, key=rank)
    near = [name for name in ranked if name != REFERENCE]
    return [*near[:N_NEAR], REFERENCE, *near[N_NEAR:]]


def _bears_name(test: str, file: str) -> bool:
    return Path(test).stem == f"test_{Path(file).stem}"


def _defined(path: Path) -> frozenset[str]:
    """The name of a file, and the names of the functions and classes in it."""
    found = {path.stem}
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("__"):
            found.add(node.name)
    return frozenset(found)


def _n_words(path: Path, words: frozenset[str]) -> int:
    """How many of some words a file has."""
    return len(words & set(WORD.findall(path.read_text(encoding="utf-8"))))


def _importers(root: Path) -> dict[str, set[str]]:
    """The files that import a file, by it."""
    files = {
        path.relative_to(root).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
        for top in (*PACKAGES, "tests")
        for path in sorted((root / top).rglob("*.py"))
    }
    homes = {_module(name): name for name in files}
    importers: dict[str, set[str]] = defaultdict(set)
    for name, tree in files.items():
        for module in _imported(tree):
            if module in homes and homes[module] != name:
                importers[homes[module]].add(name)
    return importers


def _module(name: str) -> str:
    """The name that a file is imported by: helpers of tests by their stem."""
    path = Path(name).with_suffix("")
    if path.parts[0] == "tests":
        return path.stem
    return ".".join(path.parts).removesuffix(".__init__")


def _imported(tree: ast.Module) -> Iterator[str]:
    """Modules that a file imports, by a statement or by a text that is the name of one."""
    for node in ast.walk(tree):
        match node:
            case ast.Import(names):
                yield from (one.name for one in names)
            case ast.ImportFrom(module=str() as module, names=names):
                yield module
                yield from (f"{module}.{one.name}" for one in names)
            case ast.Constant(str() as text):
                yield text.partition(":")[0]
