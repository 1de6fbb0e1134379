"""Payload of the replay page for all kinds of runs: old, empty, large, with any names."""

import html
import json
import math
import shutil
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from replayed import LOSSY, asked, data_of, moments_s, recorded
from synthetic_runs import FICTIONS, Fiction

from missions.errors import OutputError
from missions.runs.results import Results
from missions.why import Causes, why
from remoras.cli.new import TEMPLATES
from visualisation.replay import page_text, run_data

WICKED = ['AUV "one"', "</script><b>'x'", "船 \U0001f6a2 ü", "<!-- & -->"]
MOST_OF_FOUR, MOST_OF_PAGE = 100_000, 300_000
"""Bytes in the page: of the data of 4 vehicles, of the whole page of it."""

FAULTY = ("fault=[{vehicle='AUV01',kind='lost',at_s=90.0},{vehicle='AUV02',kind='joins',at_s=60.0}]",)
"""Settings of a run in which one vehicle is lost and another joins later."""

LOOK = """([run]) => {
  const end_s = run.header.end_s, all = run.vehicles.map((_, v) => v);
  const seen = [0, end_s / 3, end_s].map((t) => all.map((v) => [
    run.at(v, t), run.mind(v, t), run.why(v, t), run.disagreements(v, t), run.bars(v).length, run.decisions(v).length,
  ]).concat([run.truth(t), run.matrix(t)]));
  return {
    n: all.length, packets: run.packets.length, items: run.items.length, events: run.events.length,
    names: run.vehicles.map((one) => one.name), places: run.world.places.map((one) => one.name),
    missing: run.missing,
    seen: seen.length, verdict: run.header.verdict,
    heard: run.packets.flatMap((packet) => packet.to).filter((to) => to.arrival_s !== null).length,
    matrix: run.matrix(end_s), groups: [...new Set(all.flatMap((v) => run.bars(v).map((bar) => bar.group)))],
  };
}"""
"""Asks for everything that a page asks for, at the beginning, in the middle and at the end."""


def test_page_of_four_vehicles_is_small_and_reproducible(results: Results) -> None:
    data = data_of(results)
    text = page_text("a run", [data])
    assert len(data) * 4 / 3 < MOST_OF_FOUR
    assert len(text.encode()) < MOST_OF_PAGE
    assert data_of(Results.read(results.folder)) == data
    assert page_text("a run", [data]) == text


def test_page_requests_no_further_resource(results: Results) -> None:
    text = html.unescape(page_text("a run", [data_of(results)]))
    assert "default-src 'none'" in text
    for way in ("http://", "https://", "fetch(", "XMLHttpRequest", "import(", "innerHTML", "@import", "eval("):
        assert way not in text.replace("http://www.w3.org/", ""), way  # names of vocabularies are no addresses
    assert text.count("url(") == text.count("url(#")  # a part of the page itself


def test_a_replay_ends_with_the_run_and_not_at_its_time_limit(tmp_path: Path) -> None:
    lost = ",".join(f"{{vehicle='{name}',kind='lost',at_s=90}}" for name in ("ASV00", "AUV00", "AUV01", "AUV02"))
    early = data_of(recorded(tmp_path / "early", f"fault=[{lost}]"))
    assert asked([early], "([run]) => run.header.end_s", tmp_path) == 90.0


# Damaged ------------------------------------------------------------------------------------------


def test_a_damaged_scenario_is_named(tmp_path: Path) -> None:
    results = Fiction().write(tmp_path / "run")
    path = tmp_path / "run" / "manifest.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "scenario": "[scenario\nname="}))
    with pytest.raises(OutputError, match="the scenario in its manifest is damaged"):
        run_data(results)


# Runs of all kinds --------------------------------------------------------------------------------


def test_a_run_of_any_kind_is_shown(runs: dict[str, Results], tmp_path: Path) -> None:
    """One lasts 0 s, one has empty tables, in one no vehicle moves."""
    data = [run_data(runs[name], fiction.places) for name, fiction in FICTIONS.items()]
    looks = asked(data, f"(runs) => runs.map((run) => ({LOOK})([run]))", tmp_path)
    for told, fiction, results in zip(looks, FICTIONS.values(), runs.values(), strict=True):
        assert told["names"] == list(fiction.vehicles)
        assert told["places"] == [place.name for place in fiction.places]
        assert told["packets"] == results.table("packets").num_rows
        assert ("not completed" in told["verdict"]) != fiction.completed


def test_special_characters_in_names_are_shown_and_never_executed(tmp_path: Path) -> None:
    milestones, roles = [(WICKED[1], WICKED[0], WICKED[3], 5.0)], [(WICKED[1], WICKED[2])]
    fiction = Fiction(WICKED, roles, outlines=WICKED[:2], points=WICKED[2:], milestones=milestones)
    data = run_data(fiction.write(tmp_path / "run"), fiction.places)
    told = asked([data], LOOK, tmp_path)
    assert told["names"] == WICKED
    assert told["places"] == WICKED
    assert told["groups"] == [WICKED[1]]
    text = page_text(WICKED[1], [data])
    assert "</script><b>" not in text
    assert "&lt;/script&gt;&lt;b&gt;" in text


# A mission of one's own ---------------------------------------------------------------------------


@pytest.fixture
def buoys(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Results:
    """Mission of the how-to, with words unknown to the package."""
    for name in ("buoys.py", "buoys.ttl", "buoys.toml"):
        shutil.copy(TEMPLATES / name, tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    return recorded(tmp_path / "run", scenario=str(tmp_path / "buoys.toml"), seed=3)


WORK = """([run]) => ({
  jobs: run.world.places.filter((place) => place.isJob).map((place) => [place.name, place.done_s]),
  others: run.world.places.filter((place) => !place.isJob).map((place) => place.what),
  layers: run.layers.map((layer) => [layer.name, layer.rows.map((row) => [row.time_s, row.x, row.y, row.text])]),
  finds: run.finds.map((find) => [find.attribute, find.x, find.y]), n: run.cost.n_work, last: run.cost.truth.at(-1),
})"""


def test_user_mission_is_drawn_from_its_declarations(buoys: Results, tmp_path: Path) -> None:
    """Jobs with times of the mission's table, its sightings, and reported facts about them."""
    told = asked([data_of(buoys)], WORK, tmp_path)
    done = {row["job"]: row["time_s"] for row in reversed(buoys.table("jobs").to_pylist())}
    assert dict(told["jobs"]) == done
    assert len(done) == told["n"] == 5
    assert told["last"] == 1.0
    assert told["others"] == ["rally point"]
    layers = dict(told["layers"])
    assert sorted(row[3] for row in layers["jobs"]) == sorted(done)
    sightings = [(row["time_s"], row["x_m"], row["y_m"]) for row in buoys.table("sightings").to_pylist()]
    assert [tuple(row[:3]) for row in layers["sightings"]] == sightings
    assert ["location", 150.0, 20.0] in told["finds"]


SAMPLES = """([run]) => run.layers.filter((layer) => layer.name === "temperatures").map((layer) => ({
  total: layer.total, columns: layer.columns.map(({ name, unit, kind }) => [name, unit, kind]),
  isEvents: layer.isEvents, rows: layer.rows.map((row) => [row.x, row.y, ...row.values, row.text]),
  listed: run.events.filter((event) => event.kind === "temperatures").length,
}))[0]"""


@pytest.mark.parametrize("n", [3, 90])
def test_table_values_are_placed_at_positions_of_their_vehicle(results: Results, tmp_path: Path, n: int) -> None:
    """For four vehicles, 3 rows are shown as events, 90 as samples."""
    shutil.copytree(results.folder, tmp_path / "run")
    unit = {"unit": "degC"}
    schema = pa.schema([
        ("time_s", pa.float64()), ("vehicle", pa.string()), pa.field("temperature_c", pa.float64(), metadata=unit),
        ("n", pa.int64()), ("note", pa.string()),
    ])  # fmt: skip
    rows = [
        (float(k), "AUV01", None if k == 2 else -0.5 + 0.3 * k, 100_000 + k, "deep" if k % 2 else None)
        for k in range(n)
    ]
    table = pa.Table.from_arrays([pa.array(column) for column in zip(*rows, strict=True)], schema=schema)
    pq.write_table(table, tmp_path / "run" / "temperatures.parquet")
    sampled = Results.read(tmp_path / "run")
    told = asked([data_of(sampled)], SAMPLES, tmp_path)
    assert told["columns"] == [["temperature_c", "degC", "float"], ["n", "", "int"], ["note", "", "text"]]
    assert (told["total"], told["isEvents"], told["listed"]) == (n, n == 3, 3 if n == 3 else 0)
    tracks = {row["time_s"]: row for row in sampled.table("trajectories").to_pylist() if row["vehicle"] == "AUV01"}
    for (time_s, _, temperature_c, n_samples, note), (x, y, *values, _) in zip(rows, told["rows"], strict=True):
        assert values[0] == (None if temperature_c is None else pytest.approx(temperature_c, rel=5e-5))
        assert values[1:] == [n_samples, note or ""]
        assert (x, y) == pytest.approx((tracks[time_s]["x_m"], tracks[time_s]["y_m"]), abs=0.05)
    assert told["rows"][1][-1] == "temperature c -0.2\u00a0degC, n 100001, deep"


HIDDEN = "([run]) => run.jobs.map((job) => [job.name, job.cameUp_s, job.done_s])"


def test_undiscovered_jobs_are_listed_by_name(tmp_path: Path) -> None:
    """The scenario has their number, but no item has their positions."""
    settings = ("channel.per=0.6", "finds.number=8", "scenario.duration_s=700")
    results = recorded(tmp_path / "run", *settings, scenario="mapping-patches", seed=4)
    told = asked([data_of(results)], HIDDEN, tmp_path)
    said: dict[str, float] = {}
    for row in results.table("items").to_pylist():
        if row["attribute"] == "foundAt":
            said[row["subject"]] = min(row["recorded_s"], said.get(row["subject"], math.inf))
    assert 0 < len(said) < 8
    assert {name: came_up_s for name, came_up_s, _ in told if came_up_s is not None} == said
    assert [name for name, *_ in told] == [f"find {n}" for n in range(1, 9)]


def test_settings_are_shown_as_the_user_writes_them(results: Results, tmp_path: Path) -> None:
    header = asked([data_of(results)], "([run]) => run.header", tmp_path)
    assert header["slot_s"] == pytest.approx(1.7725, abs=1e-3)  # the nanomodem over 1000 m
    settings = header["settings"]
    for key, value in (("channel.per", "0.6"), ("strategy.name", "remoras"), ("vehicle.AUV01.depth_m", "20.0")):
        assert settings[key] == value


# Why ----------------------------------------------------------------------------------------------

WHY = """([run], times_s) => run.vehicles.map((_, v) => times_s.map((t) => run.why(v, t).map(
  (line) => [line.text, line.time_s, line.vehicle, line.slot])))"""


@pytest.mark.parametrize("settings", [(LOSSY,), ("channel.name=perfect", "strategy.name=fixed-partition"), FAULTY])
def test_page_gives_the_answers_of_the_command(settings: tuple[str, ...], tmp_path: Path) -> None:
    results = recorded(tmp_path / "run", *settings, "scenario.duration_s=400")
    names = [vehicle.name for vehicle in results.scenario.vehicle]
    causes = Causes(results)
    asked_s = sorted({*moments_s(results), *(from_s for _, from_s, _ in causes.moments())})
    told = asked([data_of(results)], WHY, tmp_path, asked_s)
    for name, answers in zip(names, told, strict=True):
        for at_s, lines in zip(asked_s, answers, strict=True):
            expected = causes.lines(name, at_s)
            numbers = [(line.time_s, names.index(line.vehicle), line.slot) for line in expected]
            shown = [(time_s, v, None if slot < 0 else slot) for _, time_s, v, slot in lines]
            assert ([text for text, *_ in lines], shown) == ([line.text for line in expected], numbers)
            if any(from_s == at_s for vehicle, from_s, _ in causes.moments() if vehicle == name):
                assert why(results, name, at_s).lines == tuple(expected)


COUNTS = "([run]) => run.layers.find((one) => one.name === 'counts').rows.map((row) => row.values[0])"


def test_large_integers_do_not_distort_later_values(tmp_path: Path) -> None:
    results = recorded(tmp_path / "run", "scenario.duration_s=5")
    counts = [5, 2**60 + 2**9, 7, -(2**59), 9]
    pq.write_table(pa.table({"time_s": [0.0, 1.0, 2.0, 3.0, 4.0], "count": counts}), results.folder / "counts.parquet")
    assert list(map(float, asked([data_of(results)], COUNTS, tmp_path))) == counts
