"""Relations that the checker assumes, rule by rule, where two implementations could differ."""

import json
import math
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from missions.mapping.new_scenario import scenario_text
from missions.mapping.sensors import Seabed
from missions.runs.results import write_results
from missions.runs.run import run
from missions.scenarios import load, shipped
from missions.verification import NoResults, verify
from missions.verification.folder import COLUMNS, MISSIONS, NOT_DERIVED, OF_EVERY_RUN, columns_of
from missions.verification.mapping import cells_of
from missions.verification.packets import check_knowledge
from missions.verification.record import CheckReport, Record, TableColumns
from missions.verification.relations import has_no_effect

Corners = list[tuple[float, float]]
SLANTED: dict[str, Corners] = {
    "west": [(0.0, 0.0), (0.0, 100.0), (100.0, 100.0)],
    "east": [(0.0, 0.0), (100.0, 100.0), (100.0, 0.0)],
    "beyond": [(100.0, 0.0), (100.0, 100.0), (170.0, 40.0), (140.0, -30.0)],
}
"""Areas with borders that run through centres of cells."""


@pytest.mark.parametrize("cell_m", [10.0, 4.0, 7.3])
def test_a_cell_on_a_slanted_border_is_of_the_same_area_for_program_and_checker(cell_m: float) -> None:
    """Each cell of the square is of one of two triangles: a border is computed alike for the areas on both sides."""
    areas = [{"name": name, "corners_m": corners} for name, corners in SLANTED.items()]
    record = Record({"world": {"cell_m": cell_m}, "area": areas}, 1, {}, {})
    seabed = Seabed.of_areas(cell_m, SLANTED)
    assert {cell: area for cell, (area, _) in seabed.cells.items()} == cells_of(record)
    inside = {(x, y) for x in range(int(100 / cell_m)) for y in range(int(100 / cell_m))}
    assert inside <= seabed.cells.keys()


def _table(**columns: list[Any]) -> TableColumns:
    return TableColumns(pa.table(columns))


@pytest.mark.parametrize(("second_s", "n_wrong"), [(50.0, 0), (51.0, 2)])
def test_parts_of_a_dropped_block_return_with_its_last_part(second_s: float, n_wrong: int) -> None:
    """Parts 0-4 and 0-4.1 arrive at 10 and 20 s; at 50 s the second arrives again, which restores both."""
    scenario = {
        "vehicle": [{"name": "A", "slot": 0}, {"name": "B", "slot": 1}], "strategy": {"name": "remoras"},
        "communication": {"policy": "ack"}, "need": [{}],
    }  # fmt: skip
    uids, received = ["0-4", "0-4.1"], ["observed"] * 2 + ["received"] * 4
    tables = {
        "items": _table(
            uid=uids, origin=["A"] * 2, time_s=[0.0] * 2, recorded_s=[0.0] * 2, kind=["told"] * 2
        ),
        "packets": _table(
            slot=[2, 4, 6], time_s=[9.0, 19.0, 49.0], sender=["A"] * 3, receivers=[["B"]] * 3,
            arrivals_s=[[10.0], [20.0], [50.0]], item_uids=[["0-4"], ["0-4.1"], ["0-4.1"]], status_uids=[[], [], []],
        ),
        "knowledge": _table(
            time_s=[0.0, 0.0, 10.0, 20.0, second_s, second_s], vehicle=["A"] * 2 + ["B"] * 4, item=uids * 3,
            origin=["A"] * 6, event=received,
        ),
        "faults": _table(time_s=[45.0], vehicle=["B"], kind=["dropped block"], detail=["waited"]),
        "refused": _table(time_s=[], vehicle=[]), "trajectories": _table(time_s=[60.0]),
    }  # fmt: skip
    report = CheckReport()
    check_knowledge(Record(scenario, 1, {}, tables), report)
    assert report.n_findings["knowledge"] == n_wrong


def test_a_fault_for_good_outlasts_the_end_of_an_earlier_one() -> None:
    details = ["mapping, until 489.8 s", "mapping, for good", "over"]
    table = _table(time_s=[180.1, 333.5, 489.8], vehicle=["A"] * 3, kind=["sensor"] * 3, detail=details)
    assert [spell.until_s for spell in Record({}, 1, {}, {"faults": table}).spells] == [489.8, math.inf]


@pytest.mark.parametrize(("left_s", "has_none"), [(90.0, True), (107.0, True), (115.0, False)])
def test_second_release_in_one_frame_has_no_effect(left_s: float, has_none: bool) -> None:
    """AUV03 resigns at 100 s; a release by its leader takes effect before, in the same frame of 7 s, or later."""
    plays = {("AUV03", "Crew", "Lifter", "AUV03"): [(5.0, True), (left_s, False)]}
    resigns = ("AUV03", "AUV03", "release", "Crew", "Lifter", "AUV03", "", "")
    assert has_no_effect(plays, resigns, 100.0, 7.0) is has_none


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made") / "run"
    write_results(run(load("mapping-rendezvous", [("--set", "scenario.duration_s=30")]), 1), folder)
    return folder


def test_reports_at_a_motion_tick_follow_where_times_are_rounded(tmp_path: Path) -> None:
    """292.2 s has its tick of 0.2 s, also as rounded to single precision."""
    settings = ("strategy.name=cbba", "scenario.duration_s=300", "scenario.tick_s=0.2")
    write_results(run(load("minehunting-contacts", [("--set", one) for one in settings]), 50), tmp_path / "run")
    assert list(verify(tmp_path / "run").lines) == []


def test_help_that_the_bound_awards_without_packets_follows(tmp_path: Path) -> None:
    settings = ("strategy.name=oracle", "scenario.duration_s=600")
    write_results(run(load("recovery-field", [("--set", one) for one in settings]), 2), tmp_path / "run")
    assert list(verify(tmp_path / "run").lines) == []


NEEDS = ("objectivePositioning = 5\n", "batteryFraction = 1\n")


@pytest.fixture(scope="module")
def generated(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Runs of a generated scenario, as it is and without two of its needs."""
    folder = tmp_path_factory.mktemp("generated")
    text = scenario_text("mine", {"nanomodem-v3": 1000.0}, areas=12, side=50.0)
    for name, dropped in {"whole": (), "fewer": NEEDS}.items():
        lines = text.splitlines(keepends=True)
        assert {*dropped} <= {*lines}
        (folder / f"{name}.toml").write_text("".join(line for line in lines if line not in dropped))
        scenario = load(str(folder / f"{name}.toml"), [("--set", "scenario.duration_s=90")])
        write_results(run(scenario, 1), folder / name)
    return {name: folder / name for name in ("whole", "fewer")}


@pytest.mark.parametrize("name", ["whole", "fewer"])
def test_runs_of_generated_scenarios_follow(name: str, generated: dict[str, Path]) -> None:
    assert list(verify(generated[name]).lines) == []


def test_a_run_of_a_single_vehicle_follows(tmp_path: Path) -> None:
    """It reports to no vehicle, and every item is known to the whole fleet at once."""
    text = scenario_text("alone", {"nanomodem-v3": 1000.0}, vehicles=2, areas=1, side=50.0)
    (tmp_path / "alone.toml").write_text(text[: text.rindex("[[vehicle]]")])
    write_results(run(load(str(tmp_path / "alone.toml")), 1), tmp_path / "run")
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert (summary["completed"], summary["mean_latency_s"]) == (True, None)
    assert (summary["consistent_fraction"], summary["consistency_time_s"]) == (1.0, 0.0)
    assert list(verify(tmp_path / "run").lines) == []


SPARSE_POLICY = """
from exchange.policy.acknowledgement import Acknowledgement
from exchange.policy.policies import ACK, AckPolicy

def every_other_frame(n_nodes, frame, sender, row, column):
    return frame == 0 and row == sender

POLICY = AckPolicy(Acknowledgement("sparse", "rare", every_other_frame, ACK.header, period_frames=2), repeat=True)
"""
RARE_SETTINGS = {
    "off within a tick": 'fault=[{vehicle="AUV01",kind="lost",at_s=60.4,until_s=60.41}]',
    "two failures of one sensor": 'fault=[{vehicle="AUV00",kind="sensor",at_s=40},'
    '{vehicle="AUV00",kind="sensor",at_s=60,until_s=80}]',
    "acknowledgements that last": "communication.policy=lasting",
    "packets refused by a slow clock": "vehicle.AUV02.clock.drift_ppm=-10000",
    "policy of the user": "communication.policy=own.py:POLICY",
}  # fmt: skip


@pytest.mark.parametrize("case", RARE_SETTINGS)
def test_runs_in_rare_settings_follow(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They differ from all others in when a vehicle is off, which sensor works, or what a header acknowledges."""
    monkeypatch.chdir(tmp_path)
    Path("own.py").write_text(SPARSE_POLICY, encoding="utf-8")
    settings = ["scenario.duration_s=160", "channel.per=0.3", RARE_SETTINGS[case]]
    write_results(run(load("mapping-rendezvous", [("--set", one) for one in settings])), tmp_path / "run")
    assert verify(tmp_path / "run").findings == []


@pytest.mark.parametrize("name", ["whole", "fewer"])
def test_reports_are_sent_exactly_if_a_vehicle_needs_them(
    name: str, generated: dict[str, Path], tmp_path: Path
) -> None:
    """Of two equal runs one lists the need; with the list of the other, all its reports of batteries are wrong."""
    folder = tmp_path / "altered"
    shutil.copytree(generated[name], folder)
    path = folder / "manifest.json"
    manifest = json.loads(path.read_text())
    scenario, need = manifest["scenario"], NEEDS[1]
    other = scenario.replace(need, "") if need in scenario else scenario.replace("mappedCell", f"{need}mappedCell")
    path.write_text(json.dumps({**manifest, "scenario": other}))
    items = pq.read_table(folder / "items.parquet").column("attribute").to_pylist()
    assert verify(folder).n_findings["reports"] == items.count("batteryFraction") > 0


def _scenario(value: Any) -> Callable[[dict[str, Any]], str]:
    return lambda manifest: json.dumps({**manifest, "scenario": value})


MANIFESTS: dict[str, Callable[[dict[str, Any]], str]] = {
    "deep": lambda _: '{"scenario": ' + "[" * 100_000 + "]" * 100_000 + "}",
    "a scenario that is a number": _scenario(7),
    "nothing": lambda _: "",
}


@pytest.mark.parametrize("case", MANIFESTS)
def test_manifest_without_content_is_one_error(case: str, made: Path, tmp_path: Path) -> None:
    folder = tmp_path / "altered"
    shutil.copytree(made, folder)
    path = folder / "manifest.json"
    path.write_text(MANIFESTS[case](json.loads(path.read_text())))
    with pytest.raises(NoResults) as raised:
        verify(folder)
    assert len(str(raised.value).splitlines()) == 1


def test_checker_knows_tables_of_every_shipped_mission() -> None:
    references = {load(name).scenario.mission for name in shipped()} | {"missions.nodes.recording:Stations"}
    assert MISSIONS.keys() == {name.removeprefix("missions.").removesuffix("Mission") for name in references}


def test_every_column_of_a_run_is_checked_or_named(made: Path) -> None:
    """Ten of the 126 columns of the tables of every run are not checked, nor the presence of rows of three tables."""
    report = verify(made)
    columns = {f"{path.stem}.{name}" for path in made.glob("*.parquet") for name in _columns(path)}
    known = {f"{name}.{column}" for name in COLUMNS for column in columns_of(name)}
    assert columns <= known
    assert report.not_checked.keys() >= NOT_DERIVED.keys()
    assert len({one for one in known if one.partition(".")[0] in OF_EVERY_RUN}) == 126
    assert {name for names in MISSIONS.values() for name in names} <= COLUMNS.keys()


def _columns(path: Path) -> list[str]:
    return list(pq.read_schema(path).names)
