"""A sweep keeps the tables of all runs, so a metric that comes afterwards has them, up to a size."""

from pathlib import Path

import pytest
from sweeping import study_text, written

from missions.sweeps import folder, load_study, sweep
from missions.sweeps.folder import SweepResults


def with_tables(at: Path, keep: str = "") -> tuple[int, int]:
    """(runs made, runs whose tables are kept)."""
    text = study_text(repeats=3, per="0.4").replace("\nseed", f"\n{keep}\nseed")
    status = sweep(load_study(str(written(at, text))), at / "out", 1)
    kept = SweepResults.read(at / "out").table("roles").iloc[:, 0].nunique() if status.with_tables else 0
    assert kept == status.with_tables
    return status.done, kept


@pytest.mark.parametrize(("keep", "n"), [("", 6), ("keep_tables = 2", 4), ("keep_tables = 0", 0)])
def test_all_or_what_is_asked_for(keep: str, n: int, tmp_path: Path) -> None:
    assert with_tables(tmp_path, keep) == (6, n)


def test_no_more_than_the_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(folder, "MOST_TABLE_BYTES", 150_000)
    done, kept = with_tables(tmp_path)
    assert done == 6
    assert 0 < kept < 6
    assert with_tables(tmp_path) == (6, kept)  # the same command once more adds nothing
