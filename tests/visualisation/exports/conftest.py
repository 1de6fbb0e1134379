"""Exported runs: a real one of two minutes with a datum, and one of an older version."""

from pathlib import Path

import pytest
from synthetic_runs import Fiction

import remoras
from missions.figure import Place
from missions.runs.results import Results
from missions.scenarios.parts import mission_of

pytest.importorskip("mcap")

ORIGIN_DEG = [43.35, 3.75]
FAULTS = [
    {"kind": "joins", "vehicle": "ASV00", "at_s": 20.0},
    {"kind": "lost", "vehicle": "AUV01", "at_s": 60.0, "until_s": 80.0},
    {"kind": "lost", "vehicle": "AUV02", "at_s": 90.0},
]


@pytest.fixture(scope="session")
def run(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """Two minutes of the shipped mission with its datum, at a loss with both received and lost packets."""
    folder = tmp_path_factory.mktemp("exported") / "run"
    settings = {"scenario.duration_s": 120.0, "world.origin_deg": ORIGIN_DEG, "fault": FAULTS}
    remoras.run("mapping-rendezvous", per=0.6, seed=3, set=settings).save(folder)
    return Results.read(folder)


@pytest.fixture(scope="session")
def places(run: Results) -> tuple[Place, ...]:
    return mission_of(run.scenario).places


@pytest.fixture
def older(tmp_path: Path) -> Results:
    """As an older version wrote it: without packets, depths, an id or a datum; names that no topic may have."""
    found = Fiction(vehicles=('A "quoted" name', "</script>", "\U0001f420", "a b")).write(tmp_path / "older")
    for name in ("packets", "knowledge"):
        (found.folder / f"{name}.parquet").unlink()
    return found
