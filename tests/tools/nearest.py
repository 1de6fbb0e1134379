"""Which tests are nearest to a place of the program: by name, by rare words that they share, by imports between."""

from __future__ import annotations

import ast
import heapq
import re
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path

PACKAGES = ("exchange", "missions", "remoras", "stress", "visualisation", "worldmodel")
WORD = re.compile(r"[^\W_]{3,}")
REFERENCE = "tests/reference/test_reference_runs.py"
"""Holds the tables of short runs of all scenarios and strategies byte for byte: near to whatever a run rests on."""
EXAMPLES = "tests/docs/test_docstrings.py"
"""Has a test for each file with examples in its docstrings."""
LEFT_OUT = ("tests/docs/", "tests/tools/", "tests/benchmarks/")
"""Tests that are about something else."""
FAR = ("tests/stress/", "tests/test_")
"""Tests that ask everything and take long."""
SAME_ROOM, OF_ALL = 4.0, 0.25
"""So much more counts what a test of the same package shares, and so much less what one of ``FAR`` does."""
N_NEAR = 6
"""Files of tests that are asked before ``REFERENCE``."""


class Tests:
    """The tests of a checkout and what they import, read once.

    Args:
        root: of the checkout.
    """

    def __init__(self, root: Path) -> None:
        self._root = root
        self._importers = _importers(root)
        self._words = {
            path.relative_to(root).as_posix(): _words(path.read_text(encoding="utf-8"))
            for path in (root / "tests").rglob("test_*.py")
        }
        self._n_with = Counter(word for words in self._words.values() for word in words)

    def nearest(self, file: str, line: int = 0) -> list[str]:
        """Tests from near to far; those that reach the file by no import are left out.

        Args:
            file: of the program, from the root of the checkout; line: of the place in it, 0 for all of it.
        """
        steps: dict[str, int] = {}
        waiting = [(0, file)]
        while waiting:
            step, found = heapq.heappop(waiting)
            if found not in steps:
                steps[found] = step
                for importer in self._importers.get(found, ()):
                    heapq.heappush(waiting, (step + 1, importer))
        source = (self._root / file).read_text(encoding="utf-8")
        about, room = _about(source, file, line), "stress" if Path(file).stem == "invariants" else Path(file).parts[0]

        def rank(name: str) -> tuple[bool, float, int, str]:
            shared = sum(1.0 / self._n_with[word] for word in about & self._words[name])
            shared *= SAME_ROOM if name.startswith(f"tests/{room}/") else OF_ALL if name.startswith(FAR) else 1.0
            return not _bears_name(name, file), -shared, steps[name], name

        ranked = sorted((name for name in steps if name in self._words and not name.startswith(LEFT_OUT)), key=rank)
        examples = [f"{EXAMPLES}::test_examples_give_what_they_say[{_module(file)}]"] * (">>> " in source)
        near = [*examples, *(name for name in ranked if name != REFERENCE)]
        return [*near[:N_NEAR], *[REFERENCE] * (REFERENCE in ranked), *near[N_NEAR:]]


def _bears_name(test: str, file: str) -> bool:
    """True for the test of one file, with the name of its folder or without.

    >>> _bears_name("tests/missions/mapping/test_mapping_survey.py", "missions/mapping/survey.py")
    True
    """
    path = Path(file)
    return Path(test).stem in (f"test_{path.stem}", f"test_{path.parent.name}_{path.stem}")


def _about(source: str, file: str, line: int) -> frozenset[str]:
    """Words of a place: the name of the file, what is defined in it, and all of the function that holds the line."""
    found = {Path(file).stem}
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found.add(node.name)
            if isinstance(node, ast.FunctionDef) and node.lineno <= line <= (node.end_lineno or 0):
                found.add(ast.get_source_segment(source, node) or "")
    return _words(" ".join(found))


def _words(text: str) -> frozenset[str]:
    return frozenset(word.lower() for word in WORD.findall(text))


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
        if any(isinstance(node, ast.Attribute) and node.attr == "iter_modules" for node in ast.walk(tree)):
            for found in files:  # strategies are imported as they are found in the folder
                if Path(found).parent == Path(name).parent and found != name:
                    importers[found].add(name)
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
