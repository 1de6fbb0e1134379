"""The command line for users and scripts: streams, texts and exit codes."""

import json
import re
import shutil
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path
from typing import Any, get_args

import jsonschema
import pytest
import tomli_w
from invoked import COMMAND, refused, remoras

from missions.files import shipped_studies
from missions.runs.results import Results
from missions.scenarios import load, shipped
from missions.scenarios.explanations import explanations
from missions.sweeps.study import study_explanations

SHORT = ["--set", "scenario.duration_s=30"]
HEAVY = {
    "numpy", "mesa", "matplotlib", "pyarrow", "rdflib", "scipy", "pandas", "numba", "networkx", "duckdb", "distributed",
}  # fmt: skip


# Importing ----------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("commands", "needed"),
    [
        (
            {
                "run --help": 0, "frobnicate": 2, "run mapping-rendezvouz --per 0.5 --seed 3": 2, "plot nowhere": 2,
                "sweep strategies-quik --out nowhere": 2, "sweep --status --out nowhere": 2,
                "sweep --status --out SWEEP": 0, "list": 0,
            }, "",
        ),
        ({"validate mapping-rendezvous": 0, "explain codec": 0}, "rdflib"),
        ({"explain": 0}, "numpy"),  # of all missions, of which one reckons with maps
        ({"compare SWEEP": 0}, "numpy scipy"),
        ({"plot RUN roles": 0}, "rdflib numpy pandas matplotlib pyarrow"),
        ({"replay RUN --out PAGE": 0}, "rdflib numpy pyarrow"),
        (
            {"run mapping-rendezvous --set scenario.duration_s=30": 1},
            "rdflib numpy pyarrow mesa scipy pandas networkx",  # the last three come with Mesa
        ),
    ],
)  # fmt: skip
def test_commands_import_only_the_libraries_they_need(
    commands: dict[str, int], needed: str, swept: Path, results: Path, tmp_path: Path
):
    """What is answered at once needs none of these libraries: to load one takes longer than the answer may."""
    places = {"SWEEP": swept, "RUN": results, "PAGE": tmp_path / "a.html"}
    given = {" ".join(str(places.get(word, word)) for word in words.split()): of for words, of in commands.items()}
    program = f"""
import sys
from remoras.cli import app
from typer.testing import CliRunner
codes = [CliRunner().invoke(app, words.split()).exit_code for words in {[*given]}]
assert codes == {[*given.values()]}, codes
print(*sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    assert {*done.stdout.split()} & HEAVY <= {*needed.split()}


# list ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "among"),
    [
        ("scenarios", "mapping-rendezvous"), ("strategies", "remoras"), ("policies", "mps-ack-repeat"),
        ("channels", "bernoulli"), ("modems", "nanomodem-v3"),
    ],
)  # fmt: skip
def test_plug_in_names_are_listed_and_described(kind: str, among: str):
    text = remoras("list", kind)
    assert text.exit_code == 0
    assert re.search(rf"^ +{among} +\S", text.stdout, re.MULTILINE)
    rows = json.loads(remoras("list", kind, "--json").stdout)
    details = {"source", "factors", "messages", "authorities", "parameters"} if kind == "strategies" else set()
    assert [set(row) for row in rows] == [{"name", "description"} | details] * len(rows)
    assert among in {row["name"] for row in rows}
    assert all(row["description"] for row in rows)


def test_list_shows_every_kind_and_the_subject_of_studies():
    everything = json.loads(remoras("list", "--json").stdout)
    assert list(everything) == ["scenarios", "strategies", "policies", "channels", "modems", "networks", "plugins"]
    found = {row["name"]: row["description"] for row in json.loads(remoras("list", "studies", "--json").stdout)}
    assert list(found) == list(shipped_studies())
    assert found["strategies-quick"].startswith("Short form of the study `strategies-under-loss`")


def test_settings_of_a_strategy_are_listed():
    rows = {row["name"]: row for row in json.loads(remoras("list", "strategies", "--json").stdout)}
    central = rows["central"]
    assert central["source"].startswith("leader-follower")
    assert central["messages"]["jobDone"] == "a vehicle has done a job"
    assert {"margin": 0.05, "queue": 2}.items() <= {p["name"]: p["default"] for p in central["parameters"]}.items()
    text = remoras("list", "strategies").stdout
    assert re.search(
        r"^  central .*\n      source: .*\n      factors: .*\n      message playsRole: ", text, re.MULTILINE
    )
    assert "      parameter queue = 2: maximum jobs per vehicle, including the current one\n" in text
    assert "parameter queue" not in remoras("list").stdout


# run ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("settings", "code", "says"),
    [
        ([], 0, r"(?s)^completed +yes$.*^goal reached +100.0 %$"),
        (SHORT, 1, r"^reason +time is up: 0 % of the goal .*; not together after 30 s: Operational, Coordination; "),
    ],
)
def test_a_summary_has_ten_lines_and_the_exit_code_of_completion(settings: list[str], code: int, says: str):
    result = remoras("run", "mapping-rendezvous", *settings)
    assert result.exit_code == code
    assert len(result.stdout.splitlines()) <= 10
    assert re.search(says, result.stdout, re.MULTILINE)


ABSENT = (
    "fault=[{vehicle='AUV02',kind='joins',at_s=20.0},{vehicle='ASV00',kind='lost',at_s=40.0},"
    "{vehicle='AUV00',kind='restarts',at_s=25.0,until_s=50.0}]"
)


def test_summary_names_vehicles_that_were_out() -> None:
    """1000 J are used up at sea: of the reserve for the way home, the vehicle turns home before."""
    settings = ("--set", "scenario.duration_s=60", "--set", ABSENT, "--set", "vehicle.AUV01.energy_j=1000")
    (line,) = [
        line for line in remoras("run", "mapping-rendezvous", *settings).stdout.splitlines() if line.startswith("out")
    ]
    assert line.startswith("out                  ")
    told = dict(re.findall(r"(\w+ [a-z ]+) at (\d+) s", line))
    home_s, empty_s = (float(told.pop(f"AUV01 {what}")) for what in ("turned home on its last energy", "out of energy"))
    assert 0.0 < home_s < empty_s < 60.0
    assert told == {"AUV02 joined": "20", "ASV00 lost": "40", "AUV00 off": "25", "AUV00 back": "50"}
    assert "\nout " not in remoras("run", "mapping-rendezvous", *SHORT).stdout


def test_summary_names_a_vehicle_that_a_current_carries_off() -> None:
    """A fault leaves AUV00 0.4 of its speeds, after its work is done; the mission completes without it."""
    told = remoras("run", "pandora-inspection", "--seed", "1").stdout
    assert re.search(r"^out .*AUV00 made no headway at \d+ s", told, re.MULTILINE), told


def test_json_is_one_value_and_nothing_else(tmp_path: Path):
    """In a process of its own, where warnings and progress would show."""
    command = [*COMMAND, "run", "mapping-rendezvous", *SHORT, "--json", "--out", tmp_path / "out"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert json.loads(done.stdout) == Results.read(tmp_path / "out").summary


def test_options_reach_the_run():
    options = ["--policy", "m-ack", "--channel", "bernoulli", "--per", "0.5", "--seed", "4", "--strategy", "remoras"]
    report = json.loads(remoras("run", "mapping-rendezvous", *SHORT, *options, "--json").stdout)
    given = {"policy": "m-ack", "channel": "bernoulli", "per": 0.5, "seed": 4, "strategy": "remoras"}
    assert given.items() <= report.items()


def test_why_prints_one_fact_a_line_and_the_same_as_json(tmp_path: Path):
    remoras("run", "mapping-rendezvous", *SHORT, "--out", tmp_path / "run")
    asked = ("why", tmp_path / "run", "AUV00", "1", "--not", "Mapping")
    lines = remoras(*asked).stdout.splitlines()
    assert 3 <= len(lines) <= 8
    answer = json.loads(remoras(*asked, "--json").stdout)
    assert (answer["vehicle"], answer["at_s"]) == ("AUV00", 1.0)
    assert [line["text"] for line in answer["lines"]] == lines
    assert "no vehicle 'AUV9'" in refused("why", tmp_path / "run", "AUV9", "1")


def test_results_are_not_overwritten_without_force(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The mission would not complete and exit 1; an output that cannot be is refused before the run."""
    out = tmp_path / "run"
    run = ("run", "mapping-rendezvous", *SHORT, "--out")
    *_, last = remoras(*run, out, "--seed", "1").stdout.splitlines()
    assert f"remoras plot {out}" in last
    assert all(command in last for command in ("why", "replay", "report"))
    message = refused(*run, out, "--seed", "2")
    assert str(out) in message
    assert "--force" in message
    assert Results.read(out).summary["seed"] == 1
    assert remoras(*run, out, "--seed", "3", "--force").exit_code == 1
    assert Results.read(out).summary["seed"] == 3
    monkeypatch.setattr("missions.runs.run.run", lambda *_, **__: pytest.fail("it is run"))
    assert "names a file; allowed: a folder" in refused(*run, out / "summary.json")
    assert "--out" in refused(*run, out / "summary.json" / "below")


def test_all_faults_of_a_file_are_reported_with_file_and_line(tmp_path: Path):
    file = tmp_path / "mine.toml"
    text = shipped()["mapping-rendezvous"].read_text(encoding="utf-8")
    file.write_text(text.replace("cell_m = 25.0", "cell = 25.0").replace("slot = 2", "slot = -1"), encoding="utf-8")
    message = refused("run", file)
    report = json.loads(remoras("validate", file, "--json").stdout)
    assert {fault["key"] for fault in report["faults"]} == {"world.cell", "world.cell_m", "vehicle.AUV01.slot"}
    for fault in report["faults"]:
        assert f"{file}:{fault['line']}: {fault['key']}" in message


# validate, example, explain -----------------------------------------------------------------------


def test_a_valid_scenario_is_described():
    """Four slots of 1.1058 + 0.6667 s."""
    result = remoras("validate", "mapping-rendezvous")
    assert result.exit_code == 0
    assert "ok; 4 vehicles, 2 groups, 3 jobs, slot 1.772 s, frame 7.09 s" in result.stdout
    assert "AUV00 plays Coordinator of Operational" in result.stdout


@pytest.mark.parametrize(("kind", "says"), [("scenario", "scenario ok; 4"), ("organisation", "ok; 1 templates, 4 gro")])
def test_every_example_validates(kind: str, says: str, tmp_path: Path):
    file = tmp_path / "mine.toml"
    file.write_text(remoras("new", kind, "--example").stdout, encoding="utf-8")
    assert says in remoras("validate", file).stdout
    if kind == "scenario":
        assert load(str(file)) == load("mapping-rendezvous")


@pytest.mark.parametrize(("valid", "faulty", "is_seen_alone"), [
    ('succession = ["Performer"]', 'succession = ["Perfomer"]', True),
    ('requires = { sensor = "mapping" }', 'requires = { capability = "SurveyPlatfrm" }', False),
    ("maximum = 3", "maximum = 2", True),
])  # fmt: skip
def test_validate_finds_the_faults_that_a_run_refuses(valid: str, faulty: str, is_seen_alone: bool, tmp_path: Path):
    """Of an organisation alone, all but the demands on vehicles; with a scenario, exactly those of a run."""
    file = tmp_path / "teams.toml"
    text = remoras("new", "organisation", "--example").stdout
    assert valid in text
    file.write_text(text.replace(valid, faulty), encoding="utf-8")
    setting = "mapping-nine-teams", "--set", f"organisation={file}"
    message = refused("validate", *setting)
    assert message == refused("run", *setting)
    alone = remoras("validate", file)
    assert (alone.exit_code != 0) == is_seen_alone
    assert is_seen_alone or f"validate SCENARIO --set organisation={file}" in alone.stdout


def test_a_key_is_explained_by_type_range_and_meaning():
    text = remoras("explain", "channel.per").stdout
    assert "packet error rate" in text
    assert "channel.per  (number, at least 0, below 1, default 0.0)" in text


def test_the_ontology_of_a_scenario_is_explained_term_by_term():
    text = remoras("explain", "ontology").stdout
    assert "SurveyPlatform  (class below CapablePlatform and Vehicle)\n    A vehicle that has a mapping sonar" in text
    assert "ratedSpeed  (attribute of Vehicle: 0 to 20 m/s, steps of 0.05)" in text
    assert "mappedCell  (attribute of Area: 0 to 4095, steps of 1)" in text
    assert "foundAt" not in text
    terms = json.loads(remoras("explain", "ontology", "--scenario", "mapping-inspection", "--json").stdout)
    (found,) = [term for term in terms if term["name"] == "foundAt"]
    assert found == {
        "name": "foundAt",
        "kind": "attribute of Find: -10000 to 10000 m, steps of 0.5 east and north",
        "meaning": "Where a find lies.",
        "file": "finds",
    }
    assert all(term["meaning"] for term in terms)


def test_explanations_of_keys_show_no_python_types():
    for name, (kind, _) in (explanations() | study_explanations()).items():
        assert re.match(r"(text|number|whole number|true or false|table|lists? of|one of|value)", kind), (name, kind)
        assert not re.search(r"\b(str|int|float|bool|dict|tuple|None|Any|Literal|Annotated)\b|[()]", kind), (name, kind)


@cache
def schema(*arguments: str) -> Any:
    made: dict[str, Any] = json.loads(remoras("explain", *arguments, "--schema").stdout)
    jsonschema.Draft202012Validator.check_schema(made)
    return jsonschema.Draft202012Validator(made)


@pytest.mark.slow
def test_the_schema_takes_every_shipped_file():
    names: dict[str, str] = {}  # a scenario of each mission: its schema is that of all of them
    for name, path in shipped().items():
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
        known = names.setdefault(tables["scenario"].get("mission", ""), name)
        schema("--scenario", known).validate(tables)
    for path in shipped_studies().values():
        schema("study").validate(tomllib.loads(path.read_text(encoding="utf-8")))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("cell_m = 25.0", "cells_m = 25.0"),
        ('vehicle_type = "ASV"', 'vehicle_type = "UFO"'),
        ("slot = 2", 'slot = "two"'),
    ],
)
def test_the_schema_refuses_the_values_that_validation_refuses(old: str, new: str):
    text = shipped()["mapping-rendezvous"].read_text(encoding="utf-8")
    assert old in text
    with pytest.raises(jsonschema.ValidationError):
        schema().validate(tomllib.loads(text.replace(old, new)))


# plot, doctor, what is not there yet --------------------------------------------------------------


def test_a_sweep_is_drawn_by_the_same_command(swept: Path, tmp_path: Path):
    result = remoras("plot", swept, "bytes", "ranking", "--metric", "n_bytes", "--format", "svg", "--out", tmp_path)
    assert result.exit_code == 0, result.output
    assert [Path(line).name for line in result.stdout.splitlines()] == [
        f"{stem}.{suffix}" for stem in ("bytes", "ranking-n_bytes") for suffix in ("svg", "csv", "txt")
    ]
    assert result.stderr == ""
    everything = remoras("plot", swept, "--all", "--format", "svg", "--out", tmp_path / "all")
    assert everything.stdout.count(".svg") > 20
    assert re.search(r"^remoras: note: .*no run has a value of", everything.stderr, re.MULTILINE)


def test_figures_of_a_run_and_of_a_sweep_are_not_confused(results: Path, swept: Path):
    assert "'trajectories' is a figure of a single run" in refused("plot", swept, "trajectories")
    assert "'trade-off' is a figure of a sweep" in refused("plot", results, "trade-off")
    assert "holds a single run" in refused("plot", results, "--metric", "n_bytes")
    assert "apply to sweeps" in refused("compare", results, "--metric", "n_bytes", "--out", "rows.csv")
    assert "holds the results of a run" in refused("swarm", "mapping-rendezvous", "--out", results)
    assert "--all: applies to the figures of a sweep" in refused("plot", results, "--all")
    said = refused("plot", swept, "bytes", "--metric", "n_bytes")
    assert "applies to the figures ranking and differences only" in said
    assert "did you mean 'n_bytes'" in refused("plot", swept, "ranking", "--metric", "n_byte")


def test_an_export_is_written_into_the_folder_and_counted(results: Path, tmp_path: Path) -> None:
    made = remoras("export", results, "--format", "csv", "--out", tmp_path / "tables", "--json")
    assert made.exit_code == 0, made.output
    said = json.loads(made.stdout)
    assert said["path"] == str(tmp_path / "tables")
    assert (tmp_path / "tables" / "trajectories.csv").read_text().count("\n") == said["counts"]["trajectories"] + 1
    assert "exists; name another with --out or add --force" in refused(
        "export", results, "--format", "csv", "--out", tmp_path / "tables"
    )
    again = remoras("export", results, "--format", "csv", "--out", tmp_path / "tables", "--force")
    assert again.stdout.startswith(f"{tmp_path / 'tables'}\n")


def test_figure_formats_are_those_of_the_package() -> None:
    from remoras.cli.results import ExportFormat
    from visualisation.exports import FORMATS

    assert [*get_args(ExportFormat)] == [*FORMATS]


def test_export_refuses_a_sweep(results: Path, swept: Path, tmp_path: Path) -> None:
    assert "holds a sweep; allowed: the results of one run" in refused("export", swept, "--format", "csv")
    assert "no results of a run" in refused("export", tmp_path, "--format", "csv")
    assert list(tmp_path.iterdir()) == []
    shutil.copytree(results, tmp_path / "nowhere")
    manifest = json.loads((results / "manifest.json").read_text())
    scenario = tomllib.loads(manifest["scenario"])
    del scenario["world"]["origin_deg"]
    (tmp_path / "nowhere" / "manifest.json").write_text(json.dumps({**manifest, "scenario": tomli_w.dumps(scenario)}))
    assert "world.origin_deg" in refused("export", tmp_path / "nowhere", "--format", "geojson")


def test_the_organisation_is_drawn_for_a_time_and_a_view(results: Path, tmp_path: Path) -> None:
    view = ("--at", "20", "--viewer", "AUV01", "--format", "svg", "--out", tmp_path)
    assert remoras("plot", results, "organisation", *view).exit_code == 0
    caption = (tmp_path / "organisation.txt").read_text(encoding="utf-8")
    assert caption.startswith("Organisation in the view of AUV01, over mission time; the thick line marks 20.0 s. ")


@pytest.mark.slow
def test_doctor_reports_no_fault_in_this_installation():
    result = remoras("doctor")
    assert result.exit_code == 0, result.output
    assert "mesa" in result.stdout
    assert result.stdout.rstrip().endswith("ok")
