"""Power cuts, kills and disk errors at any write: no lost, repeated or mixed run."""

import json
import os
import shutil
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any, ClassVar

import pytest
from failing_disk import FAULTS, OPERATIONS, FailingDisk, Killed
from sampling import sampled
from sweeping import Serial, outcome, study_text, written

from missions.errors import OutputError
from missions.sweeps.driver import PartlyDoneError, sweep
from missions.sweeps.ledger import LEDGER, LINE_KEYS, FinishedRun, RunLedger
from missions.sweeps.study import Study, load_study

N_CUTS = 20
UNUSED = ("ftruncate", "link", "rename")
"""Operations that a sweep does not need where nothing fails."""


class PowerCut(BaseException):
    """Nothing that runs catches it."""


class Disk:
    """Content of a folder that survives a power cut.

    A file has the content that it had when it was synced last, a folder the names. A name whose file was never synced
    is there, with nothing in it.

    Args:
        root: folder that is looked at.
        n_syncs: after so many the power is cut; None for never.
    """

    def __init__(self, root: Path, n_syncs: int | None) -> None:
        self.root = root
        self.left = n_syncs
        self.n_syncs = 0
        self._contents: dict[int, bytes] = {}
        self._names: dict[int, dict[str, int]] = {}
        self._held: list[int] = []  # so that no number of a file is given to another
        self._fsync = os.fsync

    def fsync(self, handle: int) -> None:
        """Synchronise as the system does, and record the content on the disk."""
        path = Path(f"/proc/self/fd/{handle}").readlink()
        self._fsync(handle)
        if not path.is_relative_to(self.root):
            return
        if self.left is not None and self.n_syncs == self.left:
            raise PowerCut
        self.n_syncs += 1
        number = os.fstat(handle).st_ino
        self._held.append(os.dup(handle))
        if path.is_dir():
            self._names[number] = {}
            for one in path.iterdir():
                self._names[number][one.name] = one.stat().st_ino
                self._held.append(os.open(one, os.O_RDONLY))
        else:
            self._contents[number] = path.read_bytes()

    def left_over(self, folder: Path, number: int, is_folder: Callable[[int], bool]) -> None:
        """Recreate the folder as it is on the disk."""
        folder.mkdir()
        for name, one in self._names.get(number, {}).items():
            if is_folder(one):
                self.left_over(folder / name, one, is_folder)
            else:
                (folder / name).write_bytes(self._contents.get(one, b""))

    def restart(self, out: Path) -> None:
        """The machine is on again."""
        kinds = {os.fstat(handle).st_ino: os.fstat(handle).st_mode for handle in self._held}
        number = out.stat().st_ino
        after = out.with_name("after")
        self.left_over(after, number, lambda one: kinds.get(one, 0) & 0o170000 == 0o040000)
        shutil.rmtree(out)
        after.rename(out)
        for handle in self._held:
            os.close(handle)


def small(tmp_path: Path) -> Study:
    return load_study(str(written(tmp_path, study_text(repeats=2, per="[0.1]", duration_s=5))))


class Remembering(Serial):
    """Executor that makes equal runs once for all tests here, which examine the storage of runs only."""

    made: ClassVar[dict[tuple[str, ...], list[FinishedRun]]] = {}

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        *_, tasks = args
        keys = tuple(task.key for task in tasks)
        if keys not in self.made:
            self.made[keys] = fn(*args)
        return super().submit(lambda: self.made[keys])


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("whole")
    sweep(small(folder), folder / "out", executor=Remembering())
    return outcome(folder / "out")


def lines_of(out: Path) -> set[bytes]:
    return set((out / LEDGER).read_bytes().split(b"\n")) if (out / LEDGER).exists() else set()


@pytest.mark.slow
@pytest.mark.parametrize("number", sampled(range(N_CUTS), 1, 7, 12, 18))
def test_power_cut_loses_no_finished_run(
    tmp_path: Path, whole: Any, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    study, out = small(tmp_path), tmp_path / "out"
    out.mkdir()
    counting = Disk(tmp_path / "counted", None)
    monkeypatch.setattr(os, "fsync", counting.fsync)
    sweep(study, tmp_path / "counted", executor=Remembering())
    disk = Disk(out, counting.n_syncs * number // N_CUTS)
    monkeypatch.setattr(os, "fsync", disk.fsync)
    n_told = [0]
    with pytest.raises(PowerCut):
        sweep(study, out, executor=Remembering(), progress=lambda n_finished, _: n_told.append(n_finished))
    monkeypatch.undo()
    disk.restart(out)
    assert len(lines_of(out) - {b""}) >= n_told[-1], "only lines that were being written may be gone"
    sweep(study, out, executor=Remembering())
    assert outcome(out) == whole


SOME = [(name, "error", 6) for name in ("write", "fsync", "replace", "mkdir")]
SOME += [("parquet", "dead", 6), ("write", "short", 6), ("fsync", "dead", 6)]
"""Operation, how it fails, and at how many of its calls at most; continuous integration tries these."""
ALL = [(name, fault, None) for name in OPERATIONS for fault in FAULTS if fault != "short" or name == "write"]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "fault", "most"), sampled([*SOME, *ALL], *SOME))
def test_an_error_at_each_write_in_turn_loses_nothing(
    tmp_path: Path, whole: Any, monkeypatch: pytest.MonkeyPatch, name: str, fault: str, most: int | None
) -> None:
    study, disk = small(tmp_path), FailingDisk(monkeypatch, name, fault)
    sweep(study, tmp_path / "counted", executor=Remembering())
    total = disk.counts[name]
    assert total or name in UNUSED
    for number in sorted({1 + total * one // (most or total) for one in range(most or total)}):
        out = tmp_path / f"out{number}"
        told = ""
        disk.fail_at(number)
        try:
            sweep(study, out, executor=Remembering())
        except (PartlyDoneError, OutputError, Killed) as error:
            told = str(error)
            disk.heal()
            sweep(study, out, executor=Remembering())  # while the error still holds what was open
        disk.heal()
        assert "workers" not in told, "it is the disk that is at fault"
        assert outcome(out) == whole, number
        keys = Counter(line["key"] for line in map(json.loads, (out / LEDGER).read_text().splitlines()))
        assert set(keys.values()) == {1}, number
        shutil.rmtree(out)


def line(key: str) -> dict[str, Any]:
    return {**dict.fromkeys(LINE_KEYS), "key": key, "summary": {}}


def test_ledger_line_is_synced_after_its_last_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ledger = RunLedger(tmp_path / "ledger.jsonl")
    write, done = os.write, []
    monkeypatch.setattr(os, "write", lambda file, content: done.append("written") or write(file, content[:7]))
    monkeypatch.setattr(os, "fsync", lambda file: done.append("synced"))
    ledger.append([line("one")])
    assert done.count("synced") >= 1
    assert done[-1] == "synced"
    ledger.close()
