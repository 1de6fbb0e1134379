"""Would a test notice? Each mutant of ``tests/mutants.toml`` is one change to the program that its tests have to catch.

    python -m tests.tools.mutants
    python -m tests.tools.mutants --only missions/statistics.py exchange
    python -m tests.tools.mutants --draw 60 --seed 7 --log drawn.txt

In a copy of the checkout the tests of all mutants have to pass first. Then one mutant after another is put in, and its
tests run. Each has its line: caught or survives. The exit status is 1 if one survives. A mutant whose text does not
occur exactly once in its file, or whose file or test is not there, is an error that names it.

With ``--draw`` mutants are drawn by a seed (``tests/tools/drawing.py``), and each is put before the tests that are
nearest to its file (``tests/tools/nearest.py``) for two minutes of CPU time at most; how much is caught is the last
line. With ``--log FILE`` a draw that was stopped goes on where it was, and ``--again`` asks those that survived.
"""

from __future__ import annotations

import argparse
import os
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

from tests.tools import warm
from tests.tools.drawing import Drawn, draw
from tests.tools.nearest import N_NEAR, Tests

ROOT = Path(__file__).parents[2]
LIST = ROOT / "tests" / "mutants.toml"
KEYS = {"file", "text", "replacement", "tests"}
LEFT_OUT = shutil.ignore_patterns(".*", "__pycache__", "build", "*.egg-info")
HANGS_S = 120.0
"""Tests that take longer do not end: the mutant is caught."""
PYTEST = (sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:warnings", "-p", "no:cacheprovider")
N_FURTHER = 16
"""So many files of tests are asked at once after the nearest."""
CAUGHT, SURVIVES = "caught   ", "survives "
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


class Catcher:
    """Asks the tests that are nearest to drawn mutants.

    Args:
        root: of a copy of the checkout; limit_s: CPU time for each mutant (s).

    Attributes:
        cpu_s: CPU time of all that was asked (s).
    """

    def __init__(self, root: Path, limit_s: float = HANGS_S) -> None:
        warm.load()
        self.cpu_s = 0.0
        self._root = root
        self._limit_s = limit_s
        self._tests = Tests(root)
        self._sound: set[str] = set()
        self._left_out: set[str] = set()

    def catcher(self, mutant: Drawn, number: int) -> str | None:
        """The nearest test that notices a mutant in time; None if none does.

        A test that fails without the mutant, too, has noticed nothing, and is asked no more.

        Args:
            mutant, number: as for ``put_in``.

        Raises:
            MutantError: no test can be loaded without the mutant.
        """
        left_s, n = self._limit_s, N_NEAR + 1
        waiting = self._tests.nearest(mutant.file, mutant.line)
        while waiting and left_s > 0.0:
            with put_in(self._root, mutant, number):
                answer = self._ask(waiting[:n], left_s)
            left_s -= answer.cpu_s
            if answer.failed is None:
                waiting, n = waiting[n:], N_FURTHER
            elif self._passes(answer.failed, waiting[:n]):  # else the same again, without the test that always fails
                return answer.failed
        return None

    def _passes(self, failed: str, tests: list[str]) -> bool:
        """True if what failed of some tests does not without a mutant."""
        if failed in self._sound:
            return True
        is_test = failed.startswith("tests/")
        answer = self._ask([failed] if is_test else tests, 1.0 if failed == warm.UNLOADED else HANGS_S)
        if answer.failed is None:
            self._sound.add(failed)
        elif answer.failed.startswith("tests/"):
            self._left_out.add(answer.failed)
        elif not is_test:
            raise MutantError(f"without any mutant: {answer.failed}: {' '.join(tests)}")
        return answer.failed is None if is_test else True

    def _ask(self, tests: list[str], limit_s: float) -> warm.Answer:
        answer = warm.ask(self._root, tests, sorted(self._left_out), limit_s)
        self.cpu_s += answer.cpu_s
        return answer


def main_of_drawn(root: Path, n: int, seed: int, log: Path | None, again: bool, limit_s: float) -> int:
    """Draw mutants and ask the nearest tests of each; returns 1 if one survives.

    Args:
        root: of the checkout; n: how many; seed: of the draw.
        log: file that gets the line of each mutant, and of which the mutants are not asked.
        again: ask those that survive by the log; limit_s: CPU time for each mutant (s).
    """
    lines = log.read_text(encoding="utf-8").splitlines() if log is not None and log.exists() else []
    said = {line[len(CAUGHT) :].partition(" [")[0]: line[: len(CAUGHT)] for line in lines}
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "checkout"
        shutil.copytree(root, copy, ignore=LEFT_OUT)
        catcher = Catcher(copy, limit_s)
        names = []
        for number, mutant in enumerate(draw(copy, n, seed), 1):
            names.append(name := f"{number} {mutant}")
            if name in said and not (again and said[name] == SURVIVES):
                continue
            before_s = catcher.cpu_s
            test = catcher.catcher(mutant, number)
            said[name] = SURVIVES if test is None else CAUGHT
            line = f"{said[name]}{name} [{catcher.cpu_s - before_s:.0f} s] {test or ''}".rstrip()
            print(line, flush=True)
            if log is not None:
                with log.open("a", encoding="utf-8") as file:
                    file.write(f"{line}\n")
    n_caught = sum(said[name] == CAUGHT for name in names)
    print(f"{n} mutants drawn with seed {seed}, {n_caught} caught, {n_caught / n:.1%}")
    return int(n_caught < n)


def main(arguments: list[str] | None = None) -> int:
    """Run the list, or what ``--only`` leaves of it; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", type=Path, default=LIST, help="the mutants")
    parser.add_argument("--root", type=Path, default=ROOT, help="of the checkout")
    parser.add_argument("--only", nargs="+", default=[""], help="beginnings of the names of files")
    parser.add_argument("--draw", type=int, help="draw so many mutants instead of reading the list")
    parser.add_argument("--seed", type=int, default=0, help="of the draw")
    parser.add_argument("--log", type=Path, help="of the draw: what it has is not asked, the rest is added")
    parser.add_argument("--again", action="store_true", help="ask those that survive by the log")
    parser.add_argument("--limit-s", type=float, default=HANGS_S, help="CPU time for each that is drawn")
    asked = parser.parse_args(arguments)
    if asked.draw is not None:
        return main_of_drawn(asked.root, asked.draw, asked.seed, asked.log, asked.again, asked.limit_s)
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
                print(f"{SURVIVES if is_alive else CAUGHT}{mutant}", flush=True)
    except MutantError as error:
        print(error, file=sys.stderr)
        return 2
    print(f"{len(mutants)} mutants, {n_alive} survive, {time.monotonic() - began_s:.0f} s")
    return int(n_alive > 0)


if __name__ == "__main__":
    raise SystemExit(main())
