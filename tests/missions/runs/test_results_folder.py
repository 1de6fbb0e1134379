"""Atomic replacement of a results folder: an interruption leaves the old or the new run."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from failing_disk import FailingDisk, Killed
from small_mission import SMALL, pond

from missions import disk as folders
from missions.disk import drafted, new_content
from missions.errors import OutputError
from missions.runs.results import MemoryResults, Results, write_results
from missions.runs.run import Run
from missions.runs.run import run as run_scenario


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, Run]:
    scenario = pond(tmp_path_factory.mktemp("scenario"), SMALL, "scenario.duration_s=40")
    return run_scenario(scenario, 1), run_scenario(scenario, 2)


def everything_in(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def drawn(folder: Path) -> None:
    """Figures of the run in a folder, and a note of the user's."""
    for name in ("roles.svg", "roles.txt", "ranking.csv", "ranking.txt", "ranking.png"):
        (folder / name).write_text("older", encoding="utf-8")
    (folder / "notes").mkdir(exist_ok=True)
    (folder / "notes" / "mine.md").write_text("precious", encoding="utf-8")
    (folder / "photo.png").write_text("precious", encoding="utf-8")
    (folder / "thesis.txt").write_text("precious", encoding="utf-8")


# One run, one id ----------------------------------------------------------------------------------


def ids_of(folder: Path) -> set[str]:
    found = {
        json.loads((folder / name).read_text(encoding="utf-8"))["run_id"] for name in ("summary.json", "manifest.json")
    }
    return found | {pq.read_schema(path).metadata[b"run_id"].decode() for path in folder.glob("*.parquet")}


def test_files_of_a_run_share_an_id_derived_from_content(runs: tuple[Run, Run], tmp_path: Path) -> None:
    for number, run in enumerate((runs[0], runs[0], runs[1])):
        write_results(run, tmp_path / str(number))
    first, same, other = (ids_of(tmp_path / str(number)) for number in range(3))
    assert len(first) == 1
    assert first == same != other
    assert MemoryResults(runs[0]).summary["run_id"] in first
    for path in (tmp_path / "0").glob("*.parquet"):
        assert path.read_bytes() == (tmp_path / "1" / path.name).read_bytes()


@pytest.mark.parametrize("foreign", ["manifest.json", "packets.parquet", "coverage.parquet"])
def test_a_mixture_of_two_runs_is_refused_by_name(runs: tuple[Run, Run], tmp_path: Path, foreign: str) -> None:
    for run, name in zip(runs, ("one", "other"), strict=True):
        write_results(run, tmp_path / name)
    shutil.copy(tmp_path / "other" / foreign, tmp_path / "one" / foreign)
    results = Results.read(tmp_path / "one")
    with pytest.raises(OutputError, match=f"holds files of two runs: .*{foreign}"):
        _ = results.scenario if foreign == "manifest.json" else results.table(foreign.removesuffix(".parquet"))
    assert Results.read(tmp_path / "other").table("packets").num_rows > 0


# The folder is exchanged whole --------------------------------------------------------------------


def test_replacing_a_run_removes_its_derived_files_and_keeps_others(runs: tuple[Run, Run], tmp_path: Path) -> None:
    write_results(runs[0], tmp_path / "out")
    drawn(tmp_path / "out")
    (tmp_path / "out" / "facts.parquet").write_bytes((tmp_path / "out" / "packets.parquet").read_bytes())
    write_results(runs[1], tmp_path / "out", force=True)
    write_results(runs[1], tmp_path / "fresh")
    found = everything_in(tmp_path / "out")
    precious = {name: found.pop(name) for name in ("notes/mine.md", "photo.png", "thesis.txt")}
    assert set(precious.values()) == {b"precious"}
    assert found == everything_in(tmp_path / "fresh")
    assert {path.name for path in tmp_path.iterdir()} == {"out", "fresh"}


def contents(text: str) -> Callable[[Path], None]:
    def fill(draft: Path) -> None:
        for name in ("summary.json", "manifest.json", "packets.parquet", "roles.parquet"):
            (draft / name).write_text(text, encoding="utf-8")

    return fill


def put(folder: Path, text: str) -> None:
    with new_content(folder) as draft:
        contents(text)(draft)


def own_of(folder: Path) -> set[str]:
    files = [path for path in folder.glob("*.*") if path.is_file() and path.stem not in ("photo", "thesis")]
    return {path.read_text(encoding="utf-8") for path in files}


def is_whole(out: Path) -> bool:
    return own_of(out) in ({"older"}, {"newer"}) and len(list(out.glob("*.json"))) == 2


@pytest.mark.parametrize("fault", ["killed", "error"])
@pytest.mark.parametrize("place", ["elsewhere", "without swaps", "inside"])
def test_interrupted_write_leaves_the_old_or_the_new_run_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str, fault: str
) -> None:
    """A folder that one works in is filled in place, and refused until it is whole: a shell would be left in none."""
    out = tmp_path / "out"
    out.mkdir()
    if place == "without swaps":
        monkeypatch.setattr(folders, "_swapped", lambda one, other: False)
    elif place == "inside":
        monkeypatch.chdir(out)
    disk = FailingDisk(monkeypatch, None, fault)
    for number in range(1, 400):
        put(out, "older")
        drawn(out)
        disk.fail_at(number)
        try:
            put(out, "newer")
        except (Killed, OSError, OutputError):
            disk.heal()
            folders.check_output(out, force=True)
            if not is_whole(out):
                assert place == "inside"
                with pytest.raises(OutputError, match=r"missing: .*manifest\.json"):
                    Results.read(out)
            assert (out / "notes" / "mine.md").read_text(encoding="utf-8") == "precious"
        else:
            disk.heal()
            assert own_of(out) == {"newer"}
            if number > 10 and [path.name for path in tmp_path.iterdir()] == ["out"]:
                break
    else:
        pytest.fail("never came to its end")
    assert place != "inside" or Path.cwd().samefile(out)


def test_an_older_draft_is_cleared_and_a_second_writer_is_refused(tmp_path: Path) -> None:
    (tmp_path / ".out-draft" / "below").mkdir(parents=True)
    (tmp_path / ".out-draft" / "junk.parquet").write_text("junk", encoding="utf-8")
    with new_content(tmp_path / "out") as draft:
        assert list(draft.iterdir()) == []
        program = (
            "import sys; from pathlib import Path; from missions.disk import new_content\n"
            "with new_content(Path(sys.argv[1])): pass"
        )
        done = subprocess.run(
            [sys.executable, "-c", program, tmp_path / "out"], capture_output=True, text=True, check=False
        )
        assert "another run is writing this folder" in done.stderr
        contents("newer")(draft)
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert own_of(tmp_path / "out") == {"newer"}


def test_a_file_never_replaces_a_folder(tmp_path: Path) -> None:
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "thesis.txt").write_text("precious", encoding="utf-8")
    with pytest.raises(IsADirectoryError), drafted(tmp_path / "results") as draft:
        draft.write_text("rows", encoding="utf-8")
    assert everything_in(tmp_path) == {"results/thesis.txt": b"precious"}


def test_permissions_of_the_folder_are_kept(tmp_path: Path) -> None:
    put(tmp_path / "out", "older")
    (tmp_path / "out").chmod(0o750)
    put(tmp_path / "out", "newer")
    assert (tmp_path / "out").stat().st_mode & 0o777 == 0o750


def test_linked_folder_is_replaced_in_place(tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    put(tmp_path / "disk" / "out", "older")
    (tmp_path / "link").symlink_to(tmp_path / "disk" / "out")
    put(tmp_path / "link", "newer")
    assert (tmp_path / "link").is_symlink()
    assert own_of(tmp_path / "disk" / "out") == {"newer"}
    assert os.listdir(tmp_path / "disk") == ["out"]  # noqa: PTH208
