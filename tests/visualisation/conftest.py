"""Runs and sweeps that never took place, written once for all tests of figures."""

import pytest
from synthetic_runs import FICTIONS
from synthetic_sweeps import SWEEPS

from missions.runs.results import Results
from missions.sweeps.folder import SweepResults


@pytest.fixture(scope="session")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Results]:
    folder = tmp_path_factory.mktemp("runs")
    return {name: fiction.write(folder / name) for name, fiction in FICTIONS.items()}


@pytest.fixture(scope="session")
def sweeps(tmp_path_factory: pytest.TempPathFactory) -> dict[str, SweepResults]:
    folder = tmp_path_factory.mktemp("sweeps")
    return {name: sweep.write(folder / name) for name, sweep in SWEEPS.items()}


@pytest.fixture(scope="session")
def seven(sweeps: dict[str, SweepResults]) -> SweepResults:
    return sweeps["seven strategies"]
