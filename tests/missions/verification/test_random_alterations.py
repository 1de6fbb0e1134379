"""Share of random alterations that the checker reports, by table, and random runs without findings."""

import random
import shutil
from collections import Counter
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from sampling import sampled

from missions.runs.results import write_results
from missions.runs.run import run
from missions.scenarios import load
from missions.verification import NoResults, verify
from tests.missions.verification.alterations import alter
from tests.missions.verification.drawn_runs import MISSIONS, drawn_run

FAULTS = 'fault=[{kind="mute",vehicle="AUV01",at_s=100,until_s=160},{kind="slow",vehicle="AUV02",at_s=300,until_s=350}]'
RUNS = {
    "mapping-rendezvous": ["scenario.duration_s=400", "channel.per=0.3", "current.east_mps=0.3", FAULTS],
    "trident-intervention": ["scenario.duration_s=600"],
    "arrows-archaeology": ["scenario.duration_s=500"],
}
N_EACH = 100
"""Alterations of each run."""
CHECKS = {
    "acknowledged", "acknowledgements", "arrivals", "choices", "columns", "coverage", "deliveries", "depth", "energy",
    "facts", "faults", "figures", "founded", "goal", "items", "knowledge", "mapped", "observed", "once",
    "order", "plans", "positions", "readable", "received", "receivers", "reports", "requests", "roles",
    "satisfaction", "senders", "signals", "sizes", "slots", "swath", "ticks", "values", "vehicles", "views", "weights"
}  # fmt: skip
"""Checks of which each names some alteration."""


@pytest.mark.slow
@pytest.mark.thorough
def test_most_random_alterations_of_every_table_are_reported(tmp_path: Path) -> None:
    """The share is 93 % (214 of 229); 80 % of all, and 50 % of each table, leave room for the draw."""
    n_named, n_drawn, naming = Counter[str](), Counter[str](), set[str]()
    for name, settings in RUNS.items():
        made = tmp_path / name
        write_results(run(load(name, [("--set", one) for one in settings]), 3), made)
        untouched = verify(made)
        assert list(untouched.lines) == []
        draw = random.Random(name)
        tables = [path.stem for path in sorted(made.glob("*.parquet")) if pq.read_metadata(path).num_rows]
        for number in range(N_EACH):
            folder = tmp_path / f"{name} {number}"
            shutil.copytree(made, folder)
            alteration = alter(folder, draw.choice(tables), draw)
            if not alteration.names & untouched.not_checked.keys():
                checks = named_by(folder)
                naming |= checks
                n_drawn[alteration.table] += 1
                n_named[alteration.table] += bool(checks)
            shutil.rmtree(folder)
    assert n_named.total() >= 0.8 * n_drawn.total(), n_named
    few = {table: (n_named[table], n) for table, n in n_drawn.items() if n >= 4 and n_named[table] < 0.5 * n}
    assert few == {}
    assert naming >= CHECKS, "a check that names nothing"


def named_by(folder: Path) -> set[str]:
    """Checks that find something."""
    try:
        return set(verify(folder).n_findings)
    except NoResults:
        return {"results"}


@pytest.mark.slow
@pytest.mark.parametrize("mission", sampled(MISSIONS, "mapping-rendezvous", "pandora-inspection", "recovery-field"))
def test_drawn_runs_pass(mission: str, tmp_path: Path) -> None:
    """No false alarm in any setting."""
    settings, made = drawn_run(mission, random.Random(f"passes {mission} 0"), 600.0)
    write_results(made, tmp_path / "run")
    assert list(verify(tmp_path / "run").lines) == [], settings
