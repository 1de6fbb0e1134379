"""A study that has grown goes on in its folder: what was made stays, what is missing is added."""

from pathlib import Path

import pytest
from sampling import sampled
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
STOPPING = '[stopping]\nmetric = "n_bytes"\nhalf_width = {}\nminimum = 2\nmaximum = {}\n'


def ruled(half_width: float, maximum: int) -> str:
    return study_text(repeats=2, per="[0.1]", extra=STOPPING.format(half_width, maximum))


GROWN = {
    "repeats": study_text(repeats=3, per="[0.1]"),
    "loss rates": study_text(repeats=2, per="[0.1, 0.4]"),
    "strategies": SMALL.replace('["remoras"]', '["central", "remoras"]'),
    "policies": SMALL.replace('"mps-ack"]', '"mps-ack", "m-ack"]'),
    "vehicles": SMALL.replace("repeats =", "vehicles = [4, 5]\nrepeats ="),
    "scenarios": SMALL.replace('"mapping-rendezvous"', '["mapping-patches", "mapping-rendezvous"]'),
    "channels": SMALL.replace("[set]", '[[channel]]\nname = "perfect"\n[set]'),
    "points": SMALL + "[grid]\nuncertainty.speed_spread = [0.0, 0.2]\n",
    "unforeseen": SMALL + UNFORESEEN,
    "a rule": ruled(1.0, 4),
    "all at once": study_text(repeats=3, extra=UNFORESEEN).replace('["remoras"]', '["remoras", "central"]'),
    "metrics": SMALL.replace('"n_bytes"]', '"n_bytes", "completed"]\nbaseline = "mps-ack"'),
}


def made(tmp_path: Path, text: str, out: str) -> Path:
    sweep(load_study(str(written(tmp_path, text))), tmp_path / out)
    return tmp_path / out


@pytest.mark.slow
@pytest.mark.parametrize("what", sampled(GROWN, "all at once", "strategies", "unforeseen"))
def test_a_grown_folder_is_that_of_the_large_study(tmp_path: Path, what: str) -> None:
    grown = made(tmp_path, SMALL, "grown")
    before = (grown / LEDGER).read_bytes()
    made(tmp_path, GROWN[what], "grown")
    assert (grown / LEDGER).read_bytes().startswith(before)  # runs that were made stay, and are not made again
    assert outcome(grown) == outcome(made(tmp_path, GROWN[what], "large"))
    assert SweepResults.read(grown).status() == SweepResults.read(tmp_path / "large").status()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (study_text(repeats=1, per="[0.1]"), r"\n  repeats: was 2, now 1"),
        (study_text(repeats=2, per="[0.4]"), r"\n  channel.bernoulli.per: was \[0.1\], now \[0.4\]"),
        (SMALL.replace('"ack", ', ""), r'\n  study.policies: was \["ack", "mps-ack"\], now \["mps-ack"\]'),
        (SMALL.replace("seed = 7", "seed = 8"), r"study.seed: was 7, now 8"),
        (SMALL.replace("duration_s = 20", "duration_s = 21"), r"set.scenario.duration_s: was 20, now 21"),
        (SMALL.replace("seed = 7", "seed = 7\nkeep_tables = 2"), r"study.keep_tables: was 1, now 2"),
    ],
)
def test_what_loses_runs_or_changes_them_is_refused(tmp_path: Path, text: str, expected: str) -> None:
    SweepFolder(tmp_path / "out", SweepPlan(load_study(str(written(tmp_path, SMALL))))).close()
    with pytest.raises(StudyChangedError, match=expected.replace(r"\n  repeats", r"\n  study.repeats")):
        SweepFolder(tmp_path / "out", SweepPlan(load_study(str(written(tmp_path, text)))))


def test_of_a_change_that_grows_and_loses_only_the_loss_is_named(tmp_path: Path) -> None:
    SweepFolder(tmp_path / "out", SweepPlan(load_study(str(written(tmp_path, SMALL))))).close()
    text = SMALL.replace('["remoras"]', '["remoras", "central"]').replace("[0.1]", "[0.2]")
    with pytest.raises(StudyChangedError) as caught:
        SweepFolder(tmp_path / "out", SweepPlan(load_study(str(written(tmp_path, text)))))
    assert "channel.bernoulli.per: was [0.1], now [0.2]" in str(caught.value)
    assert "strategies: was" not in str(caught.value)


@pytest.mark.slow
def test_a_tighter_rule_adds_runs_and_a_looser_one_keeps_them(tmp_path: Path) -> None:
    """Bytes differ between repeats, so a half-width of a hundredth of a byte is never reached."""
    folder = made(tmp_path, ruled(1e6, 5), "out")
    assert SweepResults.read(folder).status().done == 2 * 2
    made(tmp_path, ruled(0.01, 5), "out")
    tight = SweepResults.read(folder).status()
    assert outcome(folder) == outcome(made(tmp_path, ruled(0.01, 5), "large"))
    made(tmp_path, ruled(1e6, 5), "out")
    assert SweepResults.read(folder).status() == tight
    assert tight.remaining == 0
    assert tight.done > 2 * 2


@pytest.mark.slow
@pytest.mark.thorough
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
