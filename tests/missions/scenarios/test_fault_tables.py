"""The tables ``[[fault]]``: what they mean, how they are set from outside, and what is refused, with its place."""

from datetime import date
from pathlib import Path

import pytest
import tomli_w
from small_mission import SMALL, line_of
from typer.testing import CliRunner

from missions.document import Document
from missions.errors import ConfigurationError
from missions.runs.results import manifest
from missions.runs.run import run
from missions.scenarios import load
from missions.scenarios.faults import DeclaredFault, kind_named
from missions.scenarios.loading import scenario_from
from missions.scenarios.scenario import Scenario
from missions.sweeps.study import load_study
from remoras.cli import app

DATED = {"kind": "lost", "vehicle": "Diver", "at_s": 3, "rate_per_h": date(1979, 5, 27), "factor": date(1979, 5, 27)}
LOST = 'kind = "lost"\nvehicle = "Diver"\nat_s = 300.0\n'
JOINS = 'kind = "joins"\nvehicle = "Diver"\nat_s = 300.0\n'


def with_faults(*tables: str) -> str:
    return SMALL + "".join(f"\n[[fault]]\n{table}" for table in tables)


def read(*tables: str) -> Scenario:
    return scenario_from(Document.of_text(with_faults(*tables), "pond.toml"))


def refused(*tables: str) -> list[str]:
    """What is said of these tables, a line each."""
    with pytest.raises(ConfigurationError) as caught:
        read(*tables)
    return str(caught.value).splitlines()


def declared(kind: str, **keys: object) -> DeclaredFault:
    return kind_named(kind)(kind=kind, **keys)


# What they mean -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("table", "expected"),
    [
        (LOST, declared("lost", vehicle="Diver", at_s=300.0)),
        (
            'kind = "slow"\nvehicle = "any"\nat_s = [300, 900.5]\nuntil_s = 1000\nfactor = 0.25',
            declared("slow", vehicle="any", at_s=(300.0, 900.5), until_s=1000.0, factor=0.25),
        ),
        (
            'kind = "sensor"\nvehicle = "head of Team"\nrate_per_h = 0.2\nsensor = "mapping"',
            declared("sensor", vehicle="head of Team", rate_per_h=0.2, sensor="mapping"),
        ),
    ],
)
def test_a_table_is_the_fault_that_it_says(table: str, expected: DeclaredFault) -> None:
    text = with_faults(table).replace('playable_roles = ["Hand",', 'playable_roles = ["Skipper", "Hand",')
    (found,) = scenario_from(Document.of_text(text, "pond.toml")).fault
    assert found == expected


def test_a_scenario_without_faults_has_none() -> None:
    assert read().fault == ()


def test_the_manifest_holds_the_faults_as_declared_and_repeats_them() -> None:
    tables = LOST + "until_s = 400.0\n", 'kind = "mute"\nvehicle = "any"\nat_s = [0, 60]\n'
    finished = run(read(*tables), seed=2)
    again = scenario_from(Document.of_text(manifest(finished)["scenario"], "manifest.json"))
    assert again.fault == read(*tables).fault
    assert run(again, seed=2).recorder.faults == finished.recorder.faults != []


# Set from outside ---------------------------------------------------------------------------------


def test_faults_are_set_as_a_whole_or_one_by_one() -> None:
    tables = 'fault=[{kind="lost",vehicle="AUV01",at_s=300},{kind="mute",vehicle="any",rate_per_h=1}]'
    scenario = load("mapping-rendezvous", [("--set", tables), ("--set", "fault.1.at_s=[100,200]")])
    assert [table.vehicle for table in scenario.fault] == ["AUV01", "any"]
    assert scenario.fault[0].at_s == (100.0, 200.0)


def test_a_fault_set_from_outside_is_refused_by_its_option() -> None:
    lost, unknown = ('{kind="lost",vehicle="AUV01",at_s=300}', '{kind="lost",vehicle="AUV1",at_s=300}')
    with pytest.raises(ConfigurationError, match=r"--set \(fault\.2\.vehicle\) = \"AUV1\".*did you mean 'AUV"):
        load("mapping-rendezvous", [("--set", f"fault=[{lost},{unknown}]")])
    with pytest.raises(ConfigurationError, match=r"'3' is none of 1"):
        load("mapping-rendezvous", [("--set", f"fault=[{lost}]"), ("--set", "fault.3.at_s=1")])


def test_a_study_sets_lists_of_faults(tmp_path: Path) -> None:
    file = tmp_path / "study.toml"
    file.write_text(
        '[study]\nname = "s"\nscenario = "mapping-rendezvous"\nrepeats = 1\n[grid]\n'
        'fault = [[], [{kind = "lost", vehicle = "any", at_s = [0, 3600]}]]\n',
        encoding="utf-8",
    )
    assert [len(one.scenario.fault) for one in load_study(str(file)).configurations] == [0, 1]


def test_copies_of_vehicles_may_fail_too() -> None:
    lost = 'fault=[{kind="lost",vehicle="AUV05",at_s=300}]'
    assert load("mapping-rendezvous", [("--set", "fleet.size=8"), ("--set", lost)]).fault[0].vehicle == "AUV05"


def test_every_key_is_explained() -> None:
    said = CliRunner().invoke(app, ["explain", "fault"]).output
    for key in ("kind", "vehicle", "at_s", "rate_per_h", "until_s", "factor", "sensor"):
        assert f"fault.{key}" in said
    assert "nobody hears it" in CliRunner().invoke(app, ["explain", "fault.kind"]).output


# What is refused ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("table", "key", "says"),
    [
        (
            'kind = "dead"\nvehicle = "Diver"\nat_s = 3',
            "kind",
            "allowed: lost, mute, deaf, slow, sensor, joins, biased, restarts, drains, package.module:Class; did you",
        ),
        (
            'kind = "lost"\nvehicle = "Divr"\nat_s = 3',
            "vehicle",
            "Boat, Diver, any, head of GROUP; did you mean 'Diver'",
        ),
        ('kind = "lost"\nvehicle = "head of Taem"\nat_s = 3', "vehicle", "did you mean 'head of Team'"),
        ('kind = "lost"\nat_s = 3', "vehicle", "missing"),
        ('kind = "lost"\nvehicle = "Diver"', "at_s", "or give rate_per_h"),
        ('kind = "lost"\nvehicle = "Diver"\nat_s = 3\nrate_per_h = 1', "rate_per_h", "leave one out"),
        ('kind = "lost"\nvehicle = "Diver"\nrate_per_h = 0', "rate_per_h", "greater than 0"),
        ('kind = "lost"\nvehicle = "Diver"\nat_s = -1', "at_s", "0 or more, or [earliest, latest]"),
        ('kind = "lost"\nvehicle = "Diver"\nat_s = [9, 3]', "at_s", "0 or more, or [earliest, latest]"),
        ('kind = "lost"\nvehicle = "Diver"\nat_s = [1, 2, 3]', "at_s", "0 or more, or [earliest, latest]"),
        ('kind = "lost"\nvehicle = "Diver"\nat_s = "soon"', "at_s", "0 or more, or [earliest, latest]"),
        ('kind = "lost"\nvehicle = "Diver"\nat_s = nan', "at_s", "0 or more, or [earliest, latest]"),
        ('kind = "lost"\nvehicle = "Diver"\nat_s = 30\nuntil_s = 30', "until_s", "must be above at_s = 30"),
        ('kind = "lost"\nvehicle = "Diver"\nat_s = [9, 30]\nuntil_s = 20', "until_s", "must be above at_s = [9, 30]"),
        ('kind = "lost"\nvehicle = "Diver"\nat_s = 3\nfactor = 0.5', "factor", "not used by kind lost, only by slow"),
        ('kind = "slow"\nvehicle = "Diver"\nat_s = 3\nfactor = 1.0', "factor", "less than 1"),
        ('kind = "slow"\nvehicle = "Diver"\nat_s = 3\nfactor = 0', "factor", "greater than 0"),
        ('kind = "mute"\nvehicle = "Diver"\nat_s = 3\nsensor = "mapping"', "sensor", "not used by kind mute"),
        ('kind = "sensor"\nvehicle = "Diver"\nat_s = 3\nsensor = "sonar"', "sensor", "allowed: mapping"),
        ('kind = "sensor"\nvehicle = "any"\nat_s = 3\nsensor = "maping"', "sensor", "did you mean 'mapping'"),
        ('kind = "sensor"\nvehicle = "Boat"\nat_s = 3', "vehicle", "has no sensor"),
        ('kind = "sensor"\nvehicle = "head of Team"\nat_s = 3', "vehicle", "has no sensor"),
        ('kind = "lost"\nvehicle = "Diver"\nat_s = 1200', "at_s", "must be below scenario.duration_s = 1200"),
        ('kind = "lost"\nvehicle = "Diver"\nat_s = [9, 1e9]', "at_s", "must be below scenario.duration_s = 1200"),
        ('kind = "joins"\nvehicle = "Diver"\nat_s = 0', "at_s", "must be above 0"),
        ('kind = "joins"\nvehicle = "Diver"\nat_s = [0, 20]', "at_s", "must be above 0"),
        ('kind = "joins"\nvehicle = "any"\nat_s = 3', "vehicle", "has to be named: Boat, Diver"),
        ('kind = "joins"\nvehicle = "head of Team"\nat_s = 3', "vehicle", "has to be named: Boat, Diver"),
        ('kind = "joins"\nvehicle = "Diver"\nrate_per_h = 3', "rate_per_h", "give at_s"),
        (JOINS + "until_s = 400", "until_s", "leave until_s out"),
        (LOST + "untill_s = 400", "untill_s", "did you mean 'until_s'"),
    ],
)
def test_a_wrong_key_is_one_message_with_its_line(table: str, key: str, says: str) -> None:
    text = with_faults(table)
    header = line_of(text, "[[fault]]")
    given = [number for number, line in enumerate(table.splitlines(), header + 1) if line.startswith(f"{key} =")]
    (said,) = refused(table)
    assert said.startswith(f"pond.toml:{given[0] if given else header}: fault.1.{key}")
    assert says in said


def test_the_head_of_a_group_that_has_none_is_refused() -> None:
    text = with_faults('kind = "lost"\nvehicle = "head of Team"\nat_s = 3').replace("  head = true\n", "")
    with pytest.raises(
        ConfigurationError, match=r'fault\.1\.vehicle = "head of Team": the group Team has no role with'
    ):
        scenario_from(Document.of_text(text, "pond.toml"))


@pytest.mark.parametrize(
    ("first", "second", "says"),
    [
        (LOST, LOST, "lost twice, here and by fault.1"),
        (LOST + "until_s = 400", LOST.replace("300.0", "[399, 500]"), "lost twice"),
        (LOST, LOST.replace("at_s = 300.0", "rate_per_h = 0.1"), "lost twice"),
        (JOINS, JOINS.replace("300.0", "500.0"), "joins twice, here and by fault.1"),
    ],
)
def test_a_vehicle_is_not_lost_again_before_it_is_back_and_joins_once(first: str, second: str, says: str) -> None:
    (said,) = refused(first, second)
    assert 'fault.2.vehicle = "Diver"' in said
    assert says in said


def test_a_vehicle_that_is_back_may_be_lost_again() -> None:
    assert len(read(LOST + "until_s = 400", LOST.replace("300.0", "[400, 500]")).fault) == 2
    assert len(read(LOST, LOST.replace("lost", "mute"), LOST.replace("lost", "deaf")).fault) == 3


def test_no_more_vehicles_are_drawn_than_there_are() -> None:
    """In the pond only the diver has a sensor or a job."""
    lost = LOST.replace("Diver", "any")
    assert len(read(lost, lost.replace("lost", "mute")).fault) == 2
    (said,) = refused(lost, lost)
    assert "fault.2.vehicle" in said
    assert said.endswith("are Diver")


def test_all_that_is_wrong_is_said_at_once() -> None:
    said = refused(LOST.replace("Diver", "Divr"), LOST + "factor = 0.5", 'kind = "sensor"\nvehicle = "Boat"\nat_s = 3')
    assert [line.split(": ")[1].split(" =")[0] for line in said] == [
        "fault.1.vehicle", "fault.2.factor", "fault.3.vehicle"
    ]  # fmt: skip


@pytest.mark.parametrize("junk", [5, "lost", {"kind": "lost"}, [5], [[]], [{}], [DATED]])
def test_junk_is_a_fault_of_the_file(junk: object) -> None:
    with pytest.raises(ConfigurationError, match="fault"):
        scenario_from(Document.of_text(tomli_w.dumps({"fault": junk}) + SMALL, "pond.toml"))


def test_validate_shows_them(tmp_path: Path) -> None:
    file = tmp_path / "pond.toml"
    file.write_text(with_faults(LOST + "factor = 0.5"), encoding="utf-8")
    done = CliRunner().invoke(app, ["validate", str(file)])
    assert done.exit_code == 2
    assert "fault.1.factor" in done.output
