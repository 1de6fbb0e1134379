"""Synthetic runs and sweeps, written once for all tests of figures."""

import pytest
from replayed import recorded
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


LOST = (
    "channel.per=0.4", "fault=[{kind='lost',vehicle='AUV00',at_s=200},{kind='lost',vehicle='AUV02',at_s=300}]",
    "scenario.duration_s=1100",
)  # fmt: skip
"""The head is lost, and with it a plan; what AUV02 leaves undone has its branch of the next head's plan mended."""


@pytest.fixture(scope="session")
def lost(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return recorded(tmp_path_factory.mktemp("lost") / "run", *LOST, seed=3)


@pytest.fixture(scope="session")
def seven(sweeps: dict[str, SweepResults]) -> SweepResults:
    return sweeps["seven strategies"]
