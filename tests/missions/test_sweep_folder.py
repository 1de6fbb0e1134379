"""Folder of a sweep: no lost or repeated run after torn files and extensions of the study."""

import errno
import os
import shutil
from operator import itemgetter
from pathlib import Path

import pytest
from sweeping import outcome, study_text, written

import remoras
from missions.errors import OutputError, StudyChangedError
from missions.sweeps import sweep
from missions.sweeps.folder import SweepFolder, SweepResults
from missions.sweeps.ledger import LEDGER
from missions.sweeps.plan import SweepPlan
from missions.sweeps.study import load_study
from missions.sweeps.worker import run_task
from missions.verification import verify


def plan_of(tmp_path: Path, text: str = study_text(repeats=2)) -> SweepPlan:
    return SweepPlan(load_study(str(written(tmp_path, text))))


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a sweep of which three of eight runs are made."""
    folder = tmp_path_factory.mktemp("made")
    plan = plan_of(folder)
    log = SweepFolder(folder / "out", plan)
    log.append([run_task(task) for task in list(plan.missing({}))[:3]])
    log.compact()
    log.close()
    return folder / "out"


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "out"))


@pytest.mark.slow
def test_torn_last_line_is_removed_and_its_run_repeated(folder: Path, tmp_path: Path) -> None:
    plan = plan_of(tmp_path)
    content = (folder / LEDGER).read_bytes()
    (folder / LEDGER).write_bytes(content[:-200])
    log = SweepFolder(folder, plan)
    assert len(log.summaries) == 2
    assert (folder / LEDGER).read_bytes() == content[: content[:-1].rindex(b"\n") + 1]
    log.append([run_task(task) for task in plan.missing(log.summaries)])
    log.close()
    status = SweepResults.read(folder).status()
    assert (status.planned, status.done, status.remaining) == (8, 8, 0)


def test_a_sweep_is_refused_on_a_file_system_without_locks(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two sweeps could write there at once."""

    def without_locks(*_: object) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr("fcntl.flock", without_locks)
    with pytest.raises(OutputError, match="No locks available"):
        SweepFolder(folder, plan_of(tmp_path))


def test_status_does_not_repair_a_torn_last_line(folder: Path) -> None:
    """The sweep that writes it may be at it right now."""
    content = (folder / LEDGER).read_bytes()[:-5]
    (folder / LEDGER).write_bytes(content)
    assert SweepResults.read(folder).status().remaining == 6
    assert (folder / LEDGER).read_bytes() == content


OF_ANOTHER_VERSION = '{"version": "1", "study": {"x": 1}, "digests": []}'


@pytest.mark.parametrize("text", ["", "[]", "42", '{"version": "1"}', OF_ANOTHER_VERSION])
def test_folder_without_valid_study_file_is_refused(folder: Path, tmp_path: Path, text: str) -> None:
    plan = plan_of(tmp_path)
    (folder / "study.json").write_text(text)
    for ask in (SweepResults.status, lambda results: results.metrics):
        with pytest.raises(OutputError, match=r"^[^:]*study.json: does not describe a study"):
            ask(SweepResults.read(folder))
    with pytest.raises(StudyChangedError):
        SweepFolder(folder, plan)


def test_the_folder_of_a_run_is_not_taken_for_a_sweep(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "summary.json").write_text("{}")
    with pytest.raises(OutputError, match="holds the results of a single run"):
        SweepFolder(tmp_path / "out", plan_of(tmp_path))


def test_second_sweep_in_one_folder_is_refused(tmp_path: Path) -> None:
    plan = plan_of(tmp_path)
    log = SweepFolder(tmp_path / "out", plan)
    with pytest.raises(OutputError, match="another sweep is writing"):
        SweepFolder(tmp_path / "out", plan)
    log.close()


SMALL = study_text(repeats=2, per="[0.1]")


UNFORESEEN = """
[[unforeseen]]
name = "nothing"
[[unforeseen]]
name = "spread"
set = { uncertainty = { speed_spread = 0.3 } }
"""


def swept(tmp_path: Path, text: str, out: str) -> Path:
    sweep(load_study(str(written(tmp_path, text))), tmp_path / out)
    return tmp_path / out


@pytest.mark.slow
def test_extended_sweep_equals_the_larger_study(tmp_path: Path) -> None:
    """Extended by strategies, by unforeseen cases and by repeats."""
    text = study_text(repeats=3, per="[0.1]", extra=UNFORESEEN).replace('["remoras"]', '["central", "remoras"]')
    grown = swept(tmp_path, SMALL, "grown")
    before = (grown / LEDGER).read_bytes()
    swept(tmp_path, text, "grown")
    assert (grown / LEDGER).read_bytes().startswith(before)  # runs that were made stay, and are not made again
    assert outcome(grown) == outcome(swept(tmp_path, text, "large"))
    assert SweepResults.read(grown).status() == SweepResults.read(tmp_path / "large").status()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (study_text(repeats=1, per="[0.1]"), r"\n  repeats: was 2, now 1"),
        (study_text(repeats=2, per="[0.4]"), r"\n  channel.bernoulli.per: was \[0.1\], now \[0.4\]"),
        (SMALL.replace('"ack", ', ""), r'\n  study.policies: was \["ack", "mps-ack"\], now \["mps-ack"\]'),
        (SMALL.replace("duration_s = 20", "duration_s = 21"), r"set.scenario.duration_s: was 20, now 21"),
        (SMALL.replace("seed = 7", "seed = 7\nkeep_tables = 2"), r"study.keep_tables: was .*, now 2"),
    ],
)
def test_study_change_that_loses_or_changes_runs_is_refused(tmp_path: Path, text: str, expected: str) -> None:
    SweepFolder(tmp_path / "out", plan_of(tmp_path, SMALL)).close()
    with pytest.raises(StudyChangedError, match=expected.replace(r"\n  repeats", r"\n  study.repeats")):
        SweepFolder(tmp_path / "out", plan_of(tmp_path, text))


def with_tables(at: Path, keep: str = "") -> tuple[int, int]:
    """(runs made, runs whose tables are kept)."""
    text = study_text(repeats=3, per="0.4").replace("\nseed", f"\n{keep}\nseed")
    status = sweep(load_study(str(written(at, text))), at / "out", 1)
    kept = list((at / "out" / "runs").glob("key=*"))
    assert len(kept) == status.with_tables
    return status.done, len(kept)


@pytest.mark.parametrize(("keep", "n"), [("", 6), ("keep_tables = 2", 4), ("keep_tables = 0", 0)])
def test_tables_are_kept_for_all_or_the_requested_runs(keep: str, n: int, tmp_path: Path) -> None:
    assert with_tables(tmp_path, keep) == (6, n)


def test_kept_tables_do_not_exceed_the_size_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("missions.sweeps.folder.MOST_TABLE_BYTES", 150_000)
    done, kept = with_tables(tmp_path)
    assert done == 6
    assert 0 < kept < 6
    assert with_tables(tmp_path) == (6, kept)  # the same command once more adds nothing


def test_a_sampled_run_can_be_read_and_verified_as_any_run(folder: Path) -> None:
    line = min(SweepResults.read(folder).lines.values(), key=itemgetter("key"))
    run = remoras.open(folder / "runs" / f"key={line['key']}")
    assert isinstance(run, remoras.Run)
    assert {**run.summary, "run_id": None} == {**line["summary"], "run_id": None}
    report = verify(folder)
    assert not report.findings
    assert report.checked["positions"]
    assert report.checked["runs"]
