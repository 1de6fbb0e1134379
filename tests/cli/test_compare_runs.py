"""``compare`` of two runs: keys, metrics, and the first event that differs."""

import json
from pathlib import Path

import pytest
from invoked import refused, remoras

import remoras as package

SHORT = ("--set", "scenario.duration_s=60")


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Runs by name: twice the same one, with more loss, with another strategy, and of another mission."""
    folder = tmp_path_factory.mktemp("runs")
    runs = {
        "one": ("mapping-rendezvous", "--per", 0.2),
        "same": ("mapping-rendezvous", "--per", 0.2),
        "lossy": ("mapping-rendezvous", "--per", 0.6),
        "cbba": ("mapping-rendezvous", "--per", 0.2, "--strategy", "cbba"),
        "escort": ("escort-lines",),
    }
    for name, arguments in runs.items():
        assert remoras("run", *arguments, *SHORT, "--out", folder / name).exit_code == 1
    return {name: folder / name for name in runs}


def test_equal_runs_are_said_to_be_equal(folders: dict[str, Path]):
    said = remoras("compare", folders["one"], folders["same"]).stdout
    assert "the configurations and seeds are equal" in said
    assert "all bytes of the tables are equal" in said


def test_with_more_loss_the_first_event_is_a_packet_that_only_one_run_receives(folders: dict[str, Path]):
    result = remoras("compare", folders["one"], folders["lossy"], "--json")
    found = json.loads(result.stdout)
    assert found["keys"] == {"channel.per": [0.2, 0.6]}
    assert not found["same_bytes"]
    tables = [package.open(folders[name]).table("packets") for name in ("one", "lossy")]
    lost = [[sorted(names) for names in table["lost_by"]] for table in tables]
    number = next(n for n, (a, b) in enumerate(zip(*lost, strict=False)) if a != b)
    event = found["event"]
    assert (event["table"], event["time_s"]) == ("packets", tables[0]["time_s"][number])
    assert sorted(event["first"]["lost_by"]) == lost[0][number]
    assert sorted(event["other"]["lost_by"]) == lost[1][number]
    assert "received it in the first run only" in event["cause"]
    assert "first event that differs" in remoras("compare", folders["one"], folders["lossy"]).stdout


def test_metrics_are_side_by_side_with_their_difference(folders: dict[str, Path]):
    said = remoras("compare", folders["one"], folders["cbba"], "--metric", "n_bytes").stdout
    row = next(line.split() for line in said.splitlines() if line.startswith("n_bytes"))
    summaries = [package.open(folders[name]).summary["n_bytes"] for name in ("one", "cbba")]
    assert [float(value) for value in row[1:]] == [*summaries, summaries[1] - summaries[0]]
    assert "strategy.name" in said


def test_runs_of_different_missions_are_compared_by_what_they_share(folders: dict[str, Path]):
    said = remoras("compare", folders["one"], folders["escort"]).stdout
    assert said.startswith("different missions, ")
    assert "tables of the first run only" in said


def test_wrong_folders_and_options_are_refused_in_one_line(folders: dict[str, Path], tmp_path: Path):
    for arguments, why in (
        ((folders["one"], tmp_path), "no results of a run, missing"),
        ((folders["one"], folders["same"], "--baseline", "ack"), "apply to sweeps"),
        ((folders["one"], folders["same"], "--crossing", "a,b"), "apply to sweeps"),
        ((folders["one"], folders["same"], "--metric", "n_byte"), "n_bytes"),
    ):
        message = refused("compare", *arguments)
        assert why in message
        assert message.count("\n") == 1
