"""The command ``replay``: the place of its page, and its refusals."""

import resource
import shutil
import subprocess
from pathlib import Path

from invoked import COMMAND, refused, remoras

from missions.runs.results import write_results
from missions.runs.run import run
from missions.scenarios import load


def record(folder: Path, *settings: str, scenario: str = "mapping-rendezvous", seed: int = 1) -> Path:
    loaded = load(scenario, [("--set", one) for one in ("scenario.duration_s=30", *settings)])
    write_results(run(loaded, seed), folder)
    return folder


def test_the_page_is_written_into_the_folder_or_to_out(results: Path, tmp_path: Path) -> None:
    shutil.copytree(results, tmp_path / "run")
    result = remoras("replay", tmp_path / "run")
    assert (result.exit_code, result.stdout.strip()) == (0, str(tmp_path / "run" / "replay.html"))
    assert result.stderr == ""
    text = (tmp_path / "run" / "replay.html").read_text(encoding="utf-8")
    assert text.startswith("<!DOCTYPE html>")
    assert "<title>mapping-rendezvous, remoras, seed 1 - replay</title>" in text
    assert remoras("replay", results, "--out", tmp_path / "mission.html").exit_code == 0
    assert (tmp_path / "mission.html").read_text(encoding="utf-8") == text


def test_replay_keeps_an_existing_file_without_force(results: Path, tmp_path: Path) -> None:
    out = tmp_path / "mine.html"
    out.write_text("mine")
    assert (
        refused("replay", results, "--out", out) == f"remoras: --out {out}: exists; name another file or add --force\n"
    )
    assert out.read_text() == "mine"
    assert remoras("replay", results, "--out", out, "--force").exit_code == 0
    assert out.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert list(tmp_path.iterdir()) == [out]


def test_a_full_disk_leaves_no_partial_file_and_harms_none(results: Path, tmp_path: Path) -> None:
    """The disk is full for files of more than 20 kB."""
    out = tmp_path / "mission.html"
    out.write_text("older")

    def fill() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))

    command = [*COMMAND, "replay", str(results), "--out", str(out), "--force"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, preexec_fn=fill)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"remoras: --out {out}: cannot be written: File too large\n"
    assert out.read_text() == "older"
    assert list(tmp_path.iterdir()) == [out]


def test_a_folder_that_is_no_run_is_named(results: Path, tmp_path: Path) -> None:
    assert "is a folder; name a file, such as" in refused("replay", results, "--out", tmp_path)
    assert "there is no folder" in refused("replay", results, "--out", tmp_path / "none" / "a.html")
    (tmp_path / "study.json").write_text("{}")
    assert "holds a sweep; allowed: the results of one run" in refused("replay", tmp_path)
    assert "holds a sweep" in refused("replay", results, tmp_path, "--out", tmp_path / "a.html")


def test_a_truncated_table_is_named_and_nothing_is_written(results: Path, tmp_path: Path) -> None:
    shutil.copytree(results, tmp_path / "run")
    path = tmp_path / "run" / "items.parquet"
    path.write_bytes(path.read_bytes()[:100])
    assert f"{path}: damaged: " in refused("replay", tmp_path / "run")
    assert not (tmp_path / "run" / "replay.html").exists()


def test_missing_tables_are_listed_with_the_views_they_remove(results: Path, tmp_path: Path) -> None:
    shutil.copytree(results, tmp_path / "run")
    for name in ("decisions", "items", "trajectories", "packets", "roles", "knowledge"):
        (tmp_path / "run" / f"{name}.parquet").unlink()
    result = remoras("replay", tmp_path / "run")
    assert result.exit_code == 0
    assert result.stderr == (
        f"remoras: {tmp_path / 'run'}: tables are missing; not shown: positions of the vehicles; roles of the "
        "vehicles; packets sent and received; items sent, and the knowledge of each vehicle; reasons of decisions\n"
    )


def test_a_scenario_that_this_version_cannot_read_is_refused(results: Path, tmp_path: Path) -> None:
    shutil.copytree(results, tmp_path / "run")
    path = tmp_path / "run" / "manifest.json"
    path.write_text(path.read_text(encoding="utf-8").replace("duration_s", "length_s"), encoding="utf-8")
    assert "length_s" in refused("replay", tmp_path / "run")


def test_two_runs_of_different_worlds_are_not_compared(results: Path, tmp_path: Path) -> None:
    """Of other seed, loss and strategy, that is; not of other borders, work or vehicles."""
    other = record(tmp_path / "other", "channel.per=0.1", "strategy.name='central'", seed=2)
    assert remoras("replay", results, other, "--out", tmp_path / "two.html").exit_code == 0
    text = (tmp_path / "two.html").read_text(encoding="utf-8")
    assert text.count('class="run"') == 2
    assert "<title>mapping-rendezvous, remoras, seed 1 beside mapping-rendezvous, central, seed 2 - replay" in text
    for name, what, settings, scenario in (
        ("wide", "world", ("world.x_m=[-200.0, 800.0]",), "mapping-rendezvous"),
        ("patches", "world", (), "mapping-patches"),
        ("named", "vehicles", ("vehicle.AUV02.name='AUV09'",), "mapping-rendezvous"),
    ):
        apart = record(tmp_path / name, *settings, scenario=scenario)
        said = refused("replay", results, apart, "--out", tmp_path / "a.html")
        assert said.startswith(f"remoras: {apart}: {what} differ from {results}; two runs are shown side by side if")
