"""Would a test notice? Each mutant of ``tests/mutants.toml`` is one change to the program that its tests have to catch.

    python -m tests.tools.mutants
    python -m tests.tools.mutants --only missions/statistics.py exchange
    python -m tests.tools.mutants --draw 60 --seed 7

In a copy of the checkout the tests of all mutants have to pass first. Then one mutant after another is put in, and its
tests run. Each has its line: caught or survives. The exit status is 1 if one survives. A mutant whose text does not
occur exactly once in its file, or whose file or test is not there, is an error that names it.

With ``--draw`` mutants are drawn by a seed (``tests/tools/drawing.py``), and each is put before the tests that are
nearest to its file (``tests/tools/nearest.py``) for two minutes at most; how much is caught is the last line.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from tests.tools.drawing import Drawn, draw
from tests.tools.limited import LIMIT
from tests.tools.nearest import nearest

ROOT = Path(__file__).parents[2]
LIST = ROOT / "tests" / "mutants.toml"
KEYS = {"file", "text", "replacement", "tests"}
LEFT_OUT = shutil.ignore_patterns(".*", "__pycache__", "build", "*.egg-info")
HANGS_S = 120.0
"""Tests that take longer do not end: the mutant is caught."""
PYTEST = (sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:warnings", "-p", "no:cacheprovider")
FAILED_TEST = re.compile(r"^(?:FAILED|ERROR) (tests/.+?)(?: - .*)?$", re.MULTILINE)
IS_SOUND = re.compile(r"\d+ passed")
PASSED, FAILED = 0, 1
"""Exit statuses of pytest; all others say that no test was asked."""


class MutantError(Exception):
    """The list does not fit the program, or its tests cannot tell anything."""


class Mutant(NamedTuple):
    """A change that tests have to catch.

    Attributes:
        file: of the program, from the root of the checkout; text: that stands in it once.
        replacement: what takes its place.
        tests: as pytest takes them.
    """

    file: str
    text: str
    replacement: str
    tests: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.file}: {_line(self.text)} -> {_line(self.replacement)}"

    def applied(self, content: str) -> str:
        """The content of the file with the change.

        Raises:
            MutantError: the text does not occur exactly once, or nothing changes.
        """
        if (n := content.count(self.text)) != 1:
            raise MutantError(f"{self}: the text occurs {n} times; allowed: once")
        if self.text == self.replacement:
            raise MutantError(f"{self}: changes nothing")
        return content.replace(self.text, self.replacement)


def _line(text: str) -> str:
    """A text in one line."""
    return " ".join(text.split()) or "(nothing)"


def read(path: Path = LIST) -> list[Mutant]:
    """The mutants of a list.

    Raises:
        MutantError: an entry lacks a key, or has another one.
    """
    found = []
    for number, entry in enumerate(tomllib.loads(path.read_text(encoding="utf-8"))["mutant"], 1):
        if entry.keys() != KEYS:
            raise MutantError(f"{path.name}: mutant {number} has {', '.join(sorted(entry))}; allowed: {sorted(KEYS)}")
        found.append(Mutant(entry["file"], entry["text"], entry["replacement"], tuple(entry["tests"])))
    return found


def check(mutants: Iterable[Mutant], root: Path = ROOT) -> None:
    """See that every mutant can be put in.

    Raises:
        MutantError: a file or a test is not there, or a text does not occur exactly once.
    """
    for mutant in mutants:
        for name, _, test in [(mutant.file, "", ""), *(test.partition("::") for test in mutant.tests)]:
            if not (root / name).is_file() or f"def {test}" not in f"def {(root / name).read_text(encoding='utf-8')}":
                raise MutantError(f"{mutant}: {test or name} is not there")
        if not mutant.tests:
            raise MutantError(f"{mutant}: no test is named")
        mutant.applied((root / mutant.file).read_text(encoding="utf-8"))


def environment_of(root: Path) -> dict[str, str]:
    """The environment in which the tests of a checkout see its program."""
    environment = {**os.environ, "PYTHONPATH": str(root), "PYTHONPYCACHEPREFIX": str(root / ".compiled")}
    environment["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"  # those that are installed cost a second each time
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    return environment


def status(root: Path, tests: Iterable[str], limit_s: float | None = HANGS_S) -> int:
    """Exit status of pytest in a checkout; ``FAILED`` if it does not end within the limit."""
    try:
        done = subprocess.run(
            [*PYTEST, *tests], cwd=root, env=environment_of(root), capture_output=True, timeout=limit_s, check=False
        )
    except subprocess.TimeoutExpired:
        return FAILED
    return done.returncode


@contextmanager
def put_in(root: Path, mutant: Mutant | Drawn, number: int) -> Iterator[None]:
    """Change a copy of the checkout by a mutant; afterwards it is as before.

    Args:
        root: of the copy; mutant: to put in.
        number: above 0, another for each: the time of the file, by which Python knows what it has compiled.
    """
    path = root / mutant.file
    before, at = path.read_bytes(), path.stat()
    try:
        path.write_text(mutant.applied(before.decode()), encoding="utf-8")
        os.utime(path, (at.st_atime, int(at.st_mtime) + number))
        yield
    finally:
        path.write_bytes(before)
        os.utime(path, ns=(at.st_atime_ns, at.st_mtime_ns))


def survives(root: Path, mutant: Mutant, number: int) -> bool:
    """True if no test of a mutant notices it; arguments as for ``put_in``.

    Raises:
        MutantError: its tests could not be run with it.
    """
    with put_in(root, mutant, number):
        found = status(root, mutant.tests)
    if found not in (PASSED, FAILED):
        raise MutantError(f"{mutant}: its tests end with status {found}, so none was asked")
    return found == PASSED


def main_of_drawn(root: Path, n: int, seed: int) -> int:
    """Draw mutants and ask the nearest tests of each; returns 1 if one survives."""
    n_caught = 0
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "checkout"
        shutil.copytree(root, copy, ignore=LEFT_OUT)
        for number, mutant in enumerate(draw(copy, n, seed), 1):
            began_s = time.monotonic()
            test = catcher(copy, mutant, number)
            n_caught += test is not None
            took = f"{time.monotonic() - began_s:.0f} s"
            print("survives" if test is None else "caught  ", mutant, f"[{took}]", test or "", flush=True)
    print(f"{n} mutants drawn with seed {seed}, {n_caught} caught, {n_caught / n:.1%}")
    return int(n_caught < n)


def catcher(root: Path, mutant: Drawn, number: int) -> str | None:
    """The nearest test that notices a drawn mutant within ``HANGS_S``; None if none does.

    A test that fails without the mutant, too, has noticed nothing.

    Args:
        root, number: as for ``survives``.
    """
    tests = nearest(root, mutant.file)
    with put_in(root, mutant, number):
        output = _asked(root, tests)
    failed = FAILED_TEST.findall(output)
    if not failed:
        return None if IS_SOUND.search(output) else "no test can be loaded"
    fails_anyway = FAILED_TEST.search(_asked(root, failed)) is not None
    return None if fails_anyway else failed[0]


def _asked(root: Path, tests: Iterable[str]) -> str:
    """What pytest prints of tests, at most for ``HANGS_S`` and the time of one test."""
    command = [*PYTEST, "-rfE", "-p", "tests.tools.limited", *tests]
    environment = {**environment_of(root), LIMIT: str(HANGS_S)}
    try:
        return subprocess.run(
            command, cwd=root, env=environment, capture_output=True, text=True, timeout=3 * HANGS_S, check=False
        ).stdout
    except subprocess.TimeoutExpired:
        return ""


def main(arguments: list[str] | None = None) -> int:
    """Run the list, or what ``--only`` leaves of it; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", type=Path, default=LIST, help="the mutants")
    parser.add_argument("--root", type=Path, default=ROOT, help="of the checkout")
    parser.add_argument("--only", nargs="+", default=[""], help="beginnings of the names of files")
    parser.add_argument("--draw", type=int, help="draw so many mutants instead of reading the list")
    parser.add_argument("--seed", type=int, default=0, help="of the draw")
    asked = parser.parse_args(arguments)
    if asked.draw is not None:
        return main_of_drawn(asked.root, asked.draw, asked.seed)
    began_s, n_alive = time.monotonic(), 0
    try:
        mutants = [one for one in read(asked.list) if one.file.startswith(tuple(asked.only))]
        check(mutants, asked.root)
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder) / "checkout"
            shutil.copytree(asked.root, root, ignore=LEFT_OUT)
            if status(root, dict.fromkeys(test for one in mutants for test in one.tests), None) != PASSED:
                raise MutantError("the tests do not pass without any mutant, so they can tell nothing")
            for number, mutant in enumerate(mutants, 1):
                is_alive = survives(root, mutant, number)
                n_alive += is_alive
                print("survives" if is_alive else "caught  ", mutant, flush=True)
    except MutantError as error:
        print(error, file=sys.stderr)
        return 2
    print(f"{len(mutants)} mutants, {n_alive} survive, {time.monotonic() - began_s:.0f} s")
    return int(n_alive > 0)


if __name__ == "__main__":
    raise SystemExit(main())
