"""Sweeps that are killed for real, and go on: no run lost, none doubled, the same tables as without."""

import json
import random
import subprocess
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

import psutil
import pytest
from sweeping import Serial, ledger_length, outcome, started, study_text, written

from missions.sweeps.driver import sweep
from missions.sweeps.ledger import LEDGER
from missions.sweeps.study import load_study

N_KILLS = 6


def workers_of(process: "subprocess.Popen[str]") -> list[psutil.Process]:
    """Children of its fork server; none once it has ended."""
    with suppress(psutil.NoSuchProcess):
        inner = psutil.Process(process.pid).children(recursive=True)
        return [child for child in inner if child.ppid() != process.pid]
    return []


@pytest.mark.slow
def test_a_sweep_that_is_killed_again_and_again_loses_nothing(tmp_path: Path) -> None:
    """Half of the kills meet a worker, half the parent; the moments are random."""
    text = study_text(repeats=N_KILLS * 2).replace("\nseed", "\nkeep_tables = 5\nseed")
    study, out, draws = written(tmp_path, text), tmp_path / "out", random.Random(20)

    def start() -> "subprocess.Popen[str]":
        return started("sweep", study, "--out", out, "--jobs", "2")

    process = start()
    for number, length in enumerate(sorted(draws.randrange(N_KILLS * 5) for _ in range(N_KILLS))):
        if number % 2:
            process.kill()
            process.wait()
            process = start()
        while ledger_length(out) < length and process.poll() is None:
            time.sleep(0.01)
        time.sleep(draws.uniform(0.0, 0.5))
        if number % 2 == 0 and (workers := workers_of(process)):
            draws.choice(workers).kill()
    assert process.wait(120) == 0, process.communicate()
    keys = Counter(json.loads(line)["key"] for line in (out / LEDGER).read_text().splitlines())
    assert (len(keys), set(keys.values())) == (N_KILLS * 8, {1})
    sweep(load_study(str(study)), tmp_path / "serial", executor=Serial())
    assert outcome(out) == outcome(tmp_path / "serial")
