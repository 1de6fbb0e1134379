"""A study that has grown goes on in its folder: what was made stays, what is missing is added."""

from pathlib import Path

import pytest
from sweeping import ledger_length, outcome, started, study_text, written

from missions.errors import StudyChangedError
from missions.sweeps import SweepResults, load_study, sweep
from missions.sweeps.folder import SweepFolder
from missions.sweeps.ledger import LEDGER
from missions.sweeps.plan import SweepPlan

SMALL = study_text(repeats=2, per="[0.1]")
UNFORESEEN = """
[[unforeseen]]
name = "nothing"
[[unforeseen]]
name = "spread"
set = { uncertainty = { speed_spread = 0.3 } }
"""


def made(tmp_path: Path, text: str, out: str) -> Path:
    sweep(load_study(str(written(tmp_path, text))), tmp_path / out)
    return tmp_path / out


@pytest.mark.slow
def test_a_grown_folder_is_that_of_the_large_study(tmp_path: Path) -> None:
    """By strategies, by cases of what is unforeseen and by repeats."""
    text = study_text(repeats=3, per="[0.1]", extra=UNFORESEEN).replace('["remoras"]', '["central", "remoras"]')
    grown = made(tmp_path, SMALL, "grown")
    before = (grown / LEDGER).read_bytes()
    made(tmp_path, text, "grown")
    assert (grown / LEDGER).read_bytes().startswith(before)  # runs that were made stay, and are not made again
    assert outcome(grown) == outcome(made(tmp_path, text, "large"))
    assert SweepResults.read(grown).status() == SweepResults.read(tmp_path / "large").status()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (study_text(repeats=1, per="[0.1]"), r"\n  repeats: was 2, now 1"),
        (study_text(repeats=2, per="[0.4]"), r"\n  channel.bernoulli.per: was \[0.1\], now \[0.4\]"),
        (SMALL.replace('"ack", ', ""), r'\n  study.policies: was \["ack", "mps-ack"\], now \["mps-ack"\]'),
        (SMALL.replace("seed = 7", "seed = 8"), r"study.seed: was 7, now 8"),
        (SMALL.replace("duration_s = 20", "duration_s = 21"), r"set.scenario.duration_s: was 20, now 21"),
        (SMALL.replace("seed = 7", "seed = 7\nkeep_tables = 2"), r"study.keep_tables: was .*, now 2"),
    ],
)
def test_what_loses_runs_or_changes_them_is_refused(tmp_path: Path, text: str, expected: str) -> None:
    SweepFolder(tmp_path / "out", SweepPlan(load_study(str(written(tmp_path, SMALL))))).close()
    with pytest.raises(StudyChangedError, match=expected.replace(r"\n  repeats", r"\n  study.repeats")):
        SweepFolder(tmp_path / "out", SweepPlan(load_study(str(written(tmp_path, text)))))


@pytest.mark.slow
def test_a_killed_sweep_can_grow(tmp_path: Path) -> None:
    slow = study_text(repeats=6, per="[0.1]", duration_s=400)
    process = started("sweep", written(tmp_path, slow), "--out", tmp_path / "out", "--jobs", "1")
    while ledger_length(tmp_path / "out") < 2 and process.poll() is None:
        pass
    process.kill()
    process.communicate()
    n_made = ledger_length(tmp_path / "out")
    large = slow.replace("repeats = 6", "repeats = 7").replace('["remoras"]', '["remoras", "central"]')
    made(tmp_path, large, "out")
    assert 2 <= n_made <= 12
    assert outcome(tmp_path / "out") == outcome(made(tmp_path, large, "large"))
