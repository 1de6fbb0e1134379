"""A folder of results is exchanged whole: killed at any moment it holds the older run or the new one."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from small_mission import SMALL

from missions.errors import OutputError
from missions.runs import folder as folders
from missions.runs.folder import new_content
from missions.runs.results import MemoryResults, Results, write_results
from missions.runs.run import Run
from missions.runs.run import run as run_scenario
from missions.scenarios import load


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, Run]:
    file = tmp_path_factory.mktemp("scenario") / "pond.toml"
    file.write_text(SMALL, encoding="utf-8")
    one, other = (run_scenario(load(str(file), [("--set", "scenario.duration_s=40")]), seed) for seed in (1, 2))
    return one, other


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


def test_all_files_of_a_run_share_an_id_that_its_content_gives(runs: tuple[Run, Run], tmp_path: Path) -> None:
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


def without_id(path: Path) -> None:
    if path.suffix == ".json":
        content = json.loads(path.read_text(encoding="utf-8"))
        del content["run_id"]
        path.write_text(json.dumps(content), encoding="utf-8")
    else:
        pq.write_table(pq.read_table(path).replace_schema_metadata(None), path)


def test_a_folder_of_an_older_version_has_no_ids_and_is_read(runs: tuple[Run, Run], tmp_path: Path) -> None:
    write_results(runs[0], tmp_path / "out")
    without_id(tmp_path / "out" / "packets.parquet")
    with pytest.raises(OutputError, match=r"packets\.parquet of a run of an older version"):
        Results.read(tmp_path / "out").table("packets")
    for path in (tmp_path / "out").iterdir():
        without_id(path)
    results = Results.read(tmp_path / "out")
    assert results.manifest["seed"] == 1
    assert results.table("packets").num_rows == MemoryResults(runs[0]).table("packets").num_rows


# The folder is exchanged whole --------------------------------------------------------------------


def test_what_was_made_of_the_older_run_goes_with_it_and_what_was_not_stays(
    runs: tuple[Run, Run], tmp_path: Path
) -> None:
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


class Killed(BaseException):
    """A process that is killed does nothing any more: it does not clear up either."""


_alive = -1
"""Changes of files that the process makes before it is killed; below zero it lives on."""


def _watch(event: str, arguments: tuple[object, ...]) -> None:
    global _alive  # noqa: PLW0603  # an audit hook cannot be taken away
    if _alive < 0 or event not in (
        "os.rename",
        "os.remove",
        "os.mkdir",
        "os.rmdir",
        "os.link",
        "shutil.rmtree",
        "open",
    ):
        return
    if event == "open" and not (isinstance(arguments[1], str) and "w" in arguments[1]):
        return
    if _alive == 0:
        raise Killed
    _alive -= 1


sys.addaudithook(_watch)


@contextmanager
def killed_after(changes: int) -> Iterator[None]:
    global _alive  # noqa: PLW0603
    _alive = changes
    try:
        yield
    finally:
        _alive = -1


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


def kill_everywhere(tmp_path: Path, out: Path, is_sound: Callable[[Path], bool]) -> int:
    """Replace results again and again, killed one change of a file later each time; returns how often."""
    for changes in range(200):
        put(out, "older")
        drawn(out)
        try:
            with killed_after(changes):
                put(out, "newer")
        except Killed:
            assert is_sound(out), changes
            assert (out / "notes" / "mine.md").read_text(encoding="utf-8") == "precious"
        else:
            assert own_of(out) == {"newer"}
            left = {path.name for path in tmp_path.iterdir()}
            assert left == {out.name}, "old drafts are cleared"
            return changes
    pytest.fail("never came to its end")


def test_killed_at_any_moment_the_folder_holds_the_older_run_or_the_new_one(tmp_path: Path) -> None:
    n_kills = kill_everywhere(
        tmp_path,
        tmp_path / "out",
        lambda out: own_of(out) in ({"older"}, {"newer"}) and len(list(out.glob("*.json"))) == 2,
    )
    assert n_kills > 10


def test_where_folders_cannot_be_swapped_in_one_step_the_older_run_is_put_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(folders, "_swapped", lambda one, other: False)

    def is_sound(out: Path) -> bool:
        folders.check_output(out, force=True)
        return own_of(out) in ({"older"}, {"newer"}) and len(list(out.glob("*.json"))) == 2

    assert kill_everywhere(tmp_path, tmp_path / "out", is_sound) > 10


def test_a_folder_that_one_works_in_is_filled_in_place_and_refused_until_it_is_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A shell in the folder would be left in one that is gone."""
    out = tmp_path / "out"
    out.mkdir()
    monkeypatch.chdir(out)

    def is_sound(out: Path) -> bool:
        if own_of(out) in ({"older"}, {"newer"}) and len(list(out.glob("*.json"))) == 2:
            return True
        with pytest.raises(OutputError, match=r"missing: .*manifest\.json"):
            Results.read(out)
        return True

    assert kill_everywhere(tmp_path, out, is_sound) > 10
    assert Path.cwd().samefile(out)


def test_a_folder_of_other_things_is_not_moved(tmp_path: Path) -> None:
    out = tmp_path / "home"
    out.mkdir()
    drawn(out)
    before, inode = everything_in(out), out.stat().st_ino
    put(out, "newer")
    assert out.stat().st_ino == inode
    assert before.items() <= everything_in(out).items()


def test_an_older_draft_is_cleared_and_a_second_writer_is_refused(tmp_path: Path) -> None:
    (tmp_path / ".out-draft" / "below").mkdir(parents=True)
    (tmp_path / ".out-draft" / "junk.parquet").write_text("junk", encoding="utf-8")
    with new_content(tmp_path / "out") as draft:
        assert list(draft.iterdir()) == []
        program = (
            "import sys; from pathlib import Path; from missions.runs.folder import new_content\n"
            "with new_content(Path(sys.argv[1])): pass"
        )
        done = subprocess.run(
            [sys.executable, "-c", program, tmp_path / "out"], capture_output=True, text=True, check=False
        )
        assert "another run is writing this folder" in done.stderr
        contents("newer")(draft)
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert own_of(tmp_path / "out") == {"newer"}


def test_the_rights_of_the_folder_stay(tmp_path: Path) -> None:
    put(tmp_path / "out", "older")
    (tmp_path / "out").chmod(0o750)
    put(tmp_path / "out", "newer")
    assert (tmp_path / "out").stat().st_mode & 0o777 == 0o750


def test_a_folder_behind_a_link_is_exchanged_where_it_is(tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    put(tmp_path / "disk" / "out", "older")
    (tmp_path / "link").symlink_to(tmp_path / "disk" / "out")
    put(tmp_path / "link", "newer")
    assert (tmp_path / "link").is_symlink()
    assert own_of(tmp_path / "disk" / "out") == {"newer"}
    assert os.listdir(tmp_path / "disk") == ["out"]  # noqa: PTH208
