"""Reference runs match their recorded digests, for any math library and number of workers."""

import builtins
import math
import os
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from reference import reference_runs
from reference.reference_runs import FILE, RUNS, digest, written

from missions.files import shipped
from remoras import motion
from remoras.strategies import strategies

OURS = ("worldmodel", "exchange", "remoras", "missions")
SCRIPT = Path(reference_runs.__file__)
WITHOUT_FMA = {
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-FMA4,-AVX,-AVX2,-AVX512F,-FMA_Usable,-AVX2_Usable",
    "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4",
}
"""The C library's functions and NumPy's loops as on a processor without fused multiplication and addition."""
OF_OTHER_FUNCTIONS = "fixed partition", "central, bursts", "nine, acoustic", "objects", "archaeology", "trident"
"""Runs with a tide, bursts, acoustics, fused places, maps of probability and relocation."""


@pytest.fixture
def whole_sums(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let ``sum`` refuse floats: from Python 3.12 on it makes up for rounding, before it does not."""

    def whole_sum(items: Iterable[Any], start: Any = 0) -> Any:
        known, caller = list(items), sys._getframe(1)
        if any(isinstance(item, float) for item in known) and caller.f_globals["__name__"].split(".")[0] in OURS:
            pytest.fail(f"{caller.f_code.co_filename}:{caller.f_lineno} adds up floats: take math.fsum")
        return real_sum(known, start)

    real_sum = sum
    monkeypatch.setattr(builtins, "sum", whole_sum)


@pytest.mark.usefixtures("whole_sums")
@pytest.mark.parametrize("name", RUNS)
def test_a_reference_run_matches_its_digest(name: str) -> None:
    assert digest(name) == written().get(name), (
        f"the run '{name}' gives something else than {FILE.name} says. If that is meant, write it anew by\n"
        f"    python {SCRIPT.relative_to(SCRIPT.parents[2])} write\n"
        "and say in CHANGELOG.md what runs do otherwise, and why"
    )


def test_reference_runs_cover_all_scenarios_and_strategies() -> None:
    assert {scenario for scenario, *_ in RUNS.values()} == set(shipped())
    named = {one.removeprefix("strategy.name=") for *_, given in RUNS.values() for one in given}
    assert set(strategies()) - {"remoras"} <= named


def test_every_digest_has_a_reference_run() -> None:
    assert list(written()) == list(RUNS)


def test_a_digest_changes_with_the_last_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Turns whose sine is off by a rounding error change it: else equal digests would say little."""
    turn = motion._turn
    monkeypatch.setattr(motion, "_turn", lambda most: (turn(most)[0], math.nextafter(turn(most)[1], 0.0)))
    assert digest("rendezvous sync") != written()["rendezvous sync"]


@pytest.mark.slow
def test_four_workers_and_another_math_library_give_the_same() -> None:
    """Without fused operations, exp, log, sin and their kind of the C library have other last bits."""
    command = [sys.executable, str(SCRIPT), "check", "4", *OF_OTHER_FUNCTIONS]
    paths = os.pathsep.join([str(SCRIPT.parents[2]), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, **WITHOUT_FMA, "PYTHONPATH": paths}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
