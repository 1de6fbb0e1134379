"""Roles that require capabilities: what vehicles carry makes them able, and all know it from the start."""

from pathlib import Path

import pytest
from pydantic import Field

from exchange.acoustics.modems import modems
from missions.errors import ConfigurationError
from missions.files import shipped
from missions.mapping.sensors import SwathSettings
from missions.runs.knowledge import query
from missions.runs.results import Results, write_results
from missions.runs.run import run
from missions.runs.setup import resolved
from missions.runs.worlds import world_model
from missions.scenarios import load
from missions.scenarios.equipment import capabilities_of, equipment_of
from remoras.beliefs import Beliefs
from worldmodel import core_ontology_paths, read_tbox
from worldmodel.rdf.sparql import query as ask

SCENARIO = "mapping-inspection"
ROLES = {"Inspectors.InspectionHead", "Inspectors.InspectionMember"}
SURVEYORS = "SELECT ?v { ?v a rm:SurveyPlatform } ORDER BY ?v"


class Hydrophone(SwathSettings):
    """A plug-in that says of which class it is."""

    EQUIPMENT = "Sensor"
    gain_db: float = Field(0.0, description="gain")


def inspectors(name: str = SCENARIO, *settings: str) -> set[str]:
    """The vehicles that are able to play both roles of inspectors; nobody is able to play one of them alone."""
    found = set()
    for vehicle in load(name, [("--set", one) for one in settings]).vehicle:
        able = ROLES & set(vehicle.playable_roles or ())
        assert able in (set(), ROLES)
        if able:
            found.add(vehicle.name)
    return found


def without_sonar(folder: Path, vehicle: str = "AUV01") -> str:
    """The shipped scenario in which one vehicle has no sensor, and no role that a sensor is needed for."""
    text = shipped()[SCENARIO].read_text(encoding="utf-8")
    before, found, after = text.partition(f'name = "{vehicle}"')
    own, table, rest = after.partition("  [vehicle.sensor]\n  swath_m = 25.0\n  speed_limit_mps = 2.0\n")
    assert found
    assert table
    path = folder / "mine.toml"
    path.write_text(before + found + own + rest, encoding="utf-8")
    return str(path)


def test_a_sonar_taken_away_takes_the_role_with_it(tmp_path: Path) -> None:
    assert inspectors() == {"AUV00", "AUV01", "AUV02"}
    assert inspectors(without_sonar(tmp_path)) == {"AUV00", "AUV02"}


@pytest.mark.parametrize(
    ("equipment", "is_able"),
    [
        ("MappingSonar", True),
        ("SideScanSonar", True),
        ("MultibeamSonar", True),
        ("ImagingSonar", False),
        ("Camera", False),
    ],
)
def test_what_the_ontology_says_is_a_mapping_sonar_keeps_the_role(equipment: str, is_able: bool) -> None:
    assert ("AUV01" in inspectors(SCENARIO, f"vehicle.AUV01.sensor.equipment={equipment}")) is is_able


def test_a_plug_in_says_of_which_class_it_is() -> None:
    assert "AUV01" not in inspectors(SCENARIO, f"vehicle.AUV01.sensor.type={__name__}:Hydrophone")
    both = (f"vehicle.AUV01.sensor.type={__name__}:Hydrophone", "vehicle.AUV01.sensor.equipment=SideScanSonar")
    assert "AUV01" in inspectors(SCENARIO, *both)


def test_capabilities_follow_from_sensors_and_modems_together() -> None:
    """After the core ontology: a gateway has an acoustic and a radio modem, intervention needs both parts."""
    tbox = read_tbox(*core_ontology_paths())
    assert "CommunicationGateway" not in capabilities_of(tbox, "ASV", ("FSKModem",))
    assert "CommunicationGateway" in capabilities_of(tbox, "ASV", ("FSKModem", "RadioModem"))
    assert "InterventionPlatform" not in capabilities_of(tbox, "AUV", ("Manipulator",))
    assert {"InterventionPlatform", "InspectionPlatform", "Vehicle"} <= capabilities_of(
        tbox, "AUV", ("Manipulator", "Camera")
    )


def test_every_modem_profile_is_of_a_class_of_the_ontology() -> None:
    tbox = read_tbox(*core_ontology_paths())
    modem = tbox.class_named("AcousticModem").uid
    for profile in modems().values():
        assert tbox.is_a(tbox.class_named(profile.equipment).uid, modem), profile
        assert equipment_of({}, profile, {})[0] == ("modem", profile.equipment)


def test_equipment_is_common_knowledge(tmp_path: Path) -> None:
    setup = resolved(load(without_sonar(tmp_path)))
    for node in (0, 3):
        model = world_model(setup, node)
        assert not list(model.blocks())
        assert ask(model, SURVEYORS)[1] == [("AUV00",), ("AUV02",)]
        parts = "SELECT ?v ?p { ?v rm:hasPart ?p } ORDER BY ?v ?p"
        assert ask(model, parts)[1] == ask(model, "SELECT ?v ?p { ?p rm:partOf ?v } ORDER BY ?v ?p")[1]
        # a modem each, and the sonars of two
        assert len(ask(model, parts)[1]) == 4 + 2
        beliefs = Beliefs(model)
        assert beliefs.linked(("hasPart", "AUV00")) == ("AUV00.mapping", "AUV00.modem")
        assert beliefs.linked(("partOf", "AUV01.modem")) == ("AUV01",)
        assert beliefs.is_a("AUV02", "SurveyPlatform")
        assert not beliefs.is_a("AUV01", "SurveyPlatform")
        inferred = ask(model, "SELECT ?v { GRAPH run:conclusions { ?v a ?c } } ORDER BY ?v")[1]
        assert inferred == [("AUV00",), ("AUV02",)]


def test_a_run_tells_who_is_capable(tmp_path: Path) -> None:
    finished = run(load(SCENARIO, [("--set", "scenario.duration_s=20")]), 1)
    write_results(finished, tmp_path / "out")
    columns, rows = query(Results(tmp_path / "out"), SURVEYORS)
    assert {row[-1] for row in rows} == {"AUV00", "AUV01", "AUV02"}
    assert columns[-1] == "v"


def test_scenarios_that_ask_for_no_capability_have_no_equipment() -> None:
    setup = resolved(load("mapping-rendezvous"))
    assert setup.common_facts == ()
    assert not any("." in one.name and one.name.endswith("modem") for one in setup.instances)


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        (
            "group.Inspectors.role.InspectionHead.requires.capability=SurveyPlatfrom",
            'requires.capability) = "SurveyPlatfrom": allowed: CommunicationGateway, InspectionPlatform, '
            "InterventionPlatform, NavigationAid, SamplingPlatform, SurveyPlatform; did you mean 'SurveyPlatform'?",
        ),
        ("vehicle.AUV01.sensor.equipment=SideScan", "SideScanSonar, Sonar"),
        ("vehicle.AUV01.sensor.equipment=AUV", 'sensor.equipment) = "AUV": allowed: AcousticModem'),
    ],
)
def test_what_is_wrong_is_said_once(setting: str, expected: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        load(SCENARIO, [("--set", setting)])
    assert expected in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_a_capability_that_nobody_has_is_said_with_who_lacks_what() -> None:
    setting = "group.Inspectors.role.InspectionHead.requires.capability=CommunicationGateway"
    with pytest.raises(ConfigurationError, match="no vehicle meets it: ASV00 has nothing that makes it a "):
        load(SCENARIO, [("--set", setting)])
