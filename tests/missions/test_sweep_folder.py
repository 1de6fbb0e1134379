"""The folder of a sweep: nothing lost, nothing doubled, whatever the end of the file looks like."""

import shutil
from pathlib import Path

import pytest
from sweeping import study_text, written

from missions.errors import OutputError, StudyChangedError
from missions.sweeps.folder import SweepFolder, SweepResults
from missions.sweeps.ledger import LEDGER
from missions.sweeps.plan import SweepPlan
from missions.sweeps.study import load_study
from missions.sweeps.worker import Needed, run_chunk


def plan_of(tmp_path: Path, text: str = study_text(repeats=2)) -> SweepPlan:
    return SweepPlan(load_study(str(written(tmp_path, text))))


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a sweep of which three of eight runs are made."""
    folder = tmp_path_factory.mktemp("made")
    plan = plan_of(folder)
    log = SweepFolder(folder / "out", plan)
    log.append(run_chunk(Needed.like_here(), list(plan.missing({}))[:3]))
    log.compact()
    log.close()
    return folder / "out"


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "out"))


@pytest.mark.slow
@pytest.mark.parametrize("cut", [1, 2, 40, 200])
def test_a_torn_tail_is_cut_and_its_run_made_again(folder: Path, tmp_path: Path, cut: int) -> None:
    plan = plan_of(tmp_path)
    content = (folder / LEDGER).read_bytes()
    (folder / LEDGER).write_bytes(content[:-cut])
    log = SweepFolder(folder, plan)
    assert len(log.lines) == 2
    assert (folder / LEDGER).read_bytes() == content[: content[:-1].rindex(b"\n") + 1]
    log.append(run_chunk(Needed.like_here(), list(plan.missing(log.summaries))))
    log.close()
    status = SweepResults.read(folder).status()
    assert (status.planned, status.done, status.remaining) == (8, 8, 0)


def test_status_leaves_a_torn_tail_alone(folder: Path) -> None:
    """The sweep that writes it may be at it right now."""
    content = (folder / LEDGER).read_bytes()[:-5]
    (folder / LEDGER).write_bytes(content)
    assert SweepResults.read(folder).status().remaining == 6
    assert (folder / LEDGER).read_bytes() == content


def test_a_broken_line_in_the_middle_is_named(folder: Path, tmp_path: Path) -> None:
    plan = plan_of(tmp_path)
    lines = (folder / LEDGER).read_text().splitlines(keepends=True)
    (folder / LEDGER).write_text(lines[0] + "oops\n" + lines[2])
    with pytest.raises(OutputError, match=r"ledger.jsonl:2: not a line"):
        SweepFolder(folder, plan)


@pytest.mark.parametrize("line", ["42", "{}", '{"key": "x"}', "null"])
def test_a_line_that_is_no_run_is_named_with_its_remedy(folder: Path, tmp_path: Path, line: str) -> None:
    plan = plan_of(tmp_path)
    whole = (folder / LEDGER).read_text()
    (folder / LEDGER).write_text(whole + line + "\n")
    with pytest.raises(OutputError, match=r"ledger.jsonl:4: not a line of a run.* Take the line out"):
        SweepResults.read(folder).status()
    (folder / LEDGER).write_text(whole)
    assert SweepResults.read(folder).status().done == 3
    SweepFolder(folder, plan).close()


OF_ANOTHER_VERSION = '{"version": "1", "study": {"x": 1}, "digests": []}'


@pytest.mark.parametrize("text", ["", "[]", "42", '{"version": "1"}', OF_ANOTHER_VERSION])
def test_a_folder_that_does_not_say_what_it_is_for_can_be_set_aside(folder: Path, tmp_path: Path, text: str) -> None:
    plan = plan_of(tmp_path)
    (folder / "study.json").write_text(text)
    with pytest.raises(OutputError, match=r"study.json: does not describe a study"):
        SweepResults.read(folder).status()
    with pytest.raises(StudyChangedError):
        SweepFolder(folder, plan)
    SweepFolder(folder, plan, force_new=True).close()
    assert len((folder / "before-1" / LEDGER).read_text().splitlines()) == 3


def test_a_strategy_whose_file_has_changed_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    own = tmp_path / "own_strategy_of_this_test.py"
    own.write_text("from remoras.strategies.central import STRATEGY\n")
    reference = f"{own.stem}:STRATEGY"
    plan = plan_of(tmp_path, study_text(repeats=1).replace('"remoras"', f'"{reference}"'))
    SweepFolder(tmp_path / "out", plan).close()
    SweepFolder(tmp_path / "out", plan).close()
    own.write_text("from remoras.strategies.cbba import STRATEGY\n")
    with pytest.raises(StudyChangedError, match=r"code.\w+.py: was .*, now "):
        SweepFolder(tmp_path / "out", plan)


def test_the_folder_of_a_run_is_not_taken_for_a_sweep(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "summary.json").write_text("{}")
    with pytest.raises(OutputError, match="holds the results of a single run"):
        SweepFolder(tmp_path / "out", plan_of(tmp_path))


def test_starting_anew_sets_the_old_runs_aside(folder: Path, tmp_path: Path) -> None:
    old = (folder / LEDGER).read_bytes()
    log = SweepFolder(folder, plan_of(tmp_path, study_text(repeats=1)), force_new=True)
    assert log.lines == {}
    log.close()
    assert (folder / "before-1" / LEDGER).read_bytes() == old


def test_two_sweeps_do_not_write_one_folder(tmp_path: Path) -> None:
    plan = plan_of(tmp_path)
    log = SweepFolder(tmp_path / "out", plan)
    with pytest.raises(OutputError, match="another sweep is writing"):
        SweepFolder(tmp_path / "out", plan)
    log.close()
