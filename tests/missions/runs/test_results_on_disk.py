"""A disk that fails, or a kill, at any write of a run's results leaves the older run or the new one, whole."""

from pathlib import Path

import pytest
from failing_disk import FAULTS, OPERATIONS, FailingDisk, Killed
from sampling import sampled
from small_mission import SMALL

from missions.errors import OutputError
from missions.runs import folder as folders
from missions.runs.folder import check_output
from missions.runs.results import MemoryResults, Results, write_results
from missions.runs.run import run as run_scenario
from missions.scenarios import load

PRECIOUS = "notes/mine.md"
UNUSED = ("ftruncate", "fsync", "replace")
"""Operations that are not needed to replace a run."""
CASES = [(name, fault) for name in OPERATIONS for fault in FAULTS if fault != "short" or name == "write"]
TRIED = (("write", "short"), ("rename", "error"), ("link", "dead"), ("mkdir", "full"), ("parquet", "error"))
"""By continuous integration."""


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[MemoryResults, MemoryResults]:
    file = tmp_path_factory.mktemp("scenario") / "pond.toml"
    file.write_text(SMALL, encoding="utf-8")
    one, other = (run_scenario(load(str(file), [("--set", "scenario.duration_s=40")]), seed) for seed in (1, 2))
    return MemoryResults(one), MemoryResults(other)


def held(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.mark.slow
@pytest.mark.parametrize("swaps", [True, False], ids=["swapped", "in two steps"])
@pytest.mark.parametrize(("name", "fault"), sampled(CASES, *TRIED))
def test_the_folder_holds_the_older_run_or_the_new_one(
    tmp_path: Path,
    runs: tuple[MemoryResults, MemoryResults],
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    fault: str,
    swaps: bool,
) -> None:
    out, (older, newer), whole = tmp_path / "out", runs, []
    if not swaps:
        monkeypatch.setattr(folders, "_swapped", lambda one, other: False)
    for run in runs:
        write_results(run, out, force=True)
        (out / PRECIOUS).parent.mkdir(exist_ok=True)
        (out / PRECIOUS).write_text("precious", encoding="utf-8")
        whole.append(held(out))
    disk = FailingDisk(monkeypatch, name, fault)
    write_results(older, out, force=True)
    total = disk.counts[name]
    assert total or name in UNUSED or (name == "rename" and swaps)
    for number in range(1, total + 1):
        assert held(out) == whole[0]
        disk.fail_at(number)
        told = False
        try:
            write_results(newer, out, force=True)
        except (OutputError, Killed):
            told = True
        disk.heal()
        if not out.exists():
            assert fault in ("dead", "killed"), "an error leaves nothing that has to be put back"
            check_output(out, force=True)
        found = held(out)
        assert found == whole[1] or (told and found == whole[0]), number
        assert Results.read(out).manifest["seed"] == (1 if found == whole[0] else 2)
        write_results(older, out, force=True)
    assert [path.name for path in tmp_path.iterdir()] == ["out"], "drafts are cleared"
