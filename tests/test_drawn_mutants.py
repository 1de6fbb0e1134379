"""Drawn mutants: which tests are nearest, what counts as caught, and that a draw goes on where it stopped."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.tools import nearest

ROOT = Path(__file__).parents[1]
SUMS = "def total(a, b):\n    return a + b\n\n\ndef half(a):\n    return a / 2\n"
TEST = """from remoras.sums import total


def test_total():
    assert total(2, 3) == 5


def test_that_fails_anyway():
    assert total(2, 3) == 6
"""


def checkout(root: Path, test: str = TEST) -> Path:
    """A program of two functions, with a test of the one."""
    for name, text in {
        "remoras/__init__.py": "", "remoras/sums.py": SUMS, "tests/remoras/test_sums.py": test,
        "tests/remoras/test_other.py": "from remoras import sums\n\n\ndef test_it_is_there():\n    assert sums.half\n",
        "tests/remoras/test_none.py": "def test_nothing():\n    pass\n",
    }.items():  # fmt: skip
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text, encoding="utf-8")
    return root


def drawn(root: Path, *arguments: str) -> list[str]:
    """What the tool says of all mutants of the program, in a process of its own, for it forks."""
    command = [sys.executable, "-m", "tests.tools.mutants", "--draw", "4", "--root", str(root), *arguments]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "MUTANT_HANGS_S": "2"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert not done.stderr, done.stderr
    return done.stdout.splitlines()


@pytest.mark.thorough
def test_what_no_test_notices_survives_and_a_draw_goes_on_where_it_stopped(tmp_path: Path) -> None:
    """Of a + b, a / 2 and the 2 in it only the first is tested; the test that fails anyway tells nothing."""
    root, log = checkout(tmp_path / "checkout"), tmp_path / "log.txt"
    lines = drawn(root, "--log", str(log))
    assert lines.pop() == "4 mutants drawn with seed 0, 1 caught, 25.0%"
    assert lines == log.read_text(encoding="utf-8").splitlines()
    caught = [line for line in lines if line.startswith("caught")]
    assert [line[-len("test_total") :] for line in caught] == ["test_total"]
    assert "a + b -> (a - b)" in caught[0]
    log.write_text("\n".join([*caught, lines[-1] if lines[-1] not in caught else lines[0]]) + "\n", encoding="utf-8")
    assert len(drawn(root, "--log", str(log))) == 3
    assert len(drawn(root, "--log", str(log), "--again")) == 4
    assert (root / "remoras/sums.py").read_text(encoding="utf-8") == SUMS


@pytest.mark.slow
def test_a_test_that_does_not_end_has_noticed(tmp_path: Path) -> None:
    """With a mutant that never leaves a loop; what a busy machine takes counts for nothing, CPU time alone does."""
    loops = "from remoras.sums import total\n\n\ndef test_total():\n    while total(2, 3) != 5:\n        pass\n"
    lines = drawn(checkout(tmp_path, loops))
    assert lines[-1] == "4 mutants drawn with seed 0, 1 caught, 25.0%"


def test_the_nearest_tests_bear_the_name_or_share_rare_words_and_reach_the_file(tmp_path: Path) -> None:
    found = nearest.Tests(checkout(tmp_path))
    assert found.nearest("remoras/sums.py") == ["tests/remoras/test_sums.py", "tests/remoras/test_other.py"]
    assert nearest.Tests(ROOT).nearest("missions/mapping/survey.py")[:2] == [
        "tests/docs/test_docstrings.py::test_examples_give_what_they_say[missions.mapping.survey]",
        "tests/missions/mapping/test_mapping_survey.py",
    ]
