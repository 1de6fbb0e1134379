"""Groups from templates and parents, abilities by equipment, invalid organisations."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from pydantic import Field

from missions.document import Document
from missions.errors import ConfigurationError
from missions.mapping.sensors import SwathSettings
from missions.runs.setup import resolved, world_model
from missions.runs.setup import resolved as set_up
from missions.scenarios import load, shipped
from missions.scenarios.fleet import database_of
from missions.scenarios.loading import scenario_from
from missions.scenarios.organisation import groups_of, specified
from missions.scenarios.parts import mission_class
from missions.scenarios.scenario import Scenario
from remoras.beliefs import Beliefs
from remoras.organisation import Subgroups
from worldmodel.rdf.sparql import query as ask

TEAMS = shipped()["mapping-nine-teams"]
ORGANISATION = TEAMS.parent / "organisations" / "three-teams.toml"


def written(folder: Path, *changes: tuple[str, str], of_scenario: tuple[tuple[str, str], ...] = ()) -> Path:
    """The scenario of three teams with some text changed, in the organisation file or in its own."""
    texts = {ORGANISATION: changes, TEAMS: of_scenario}
    for source, replaced in texts.items():
        text = source.read_text(encoding="utf-8")
        for old, new in replaced:
            assert old in text, old
            text = text.replace(old, new, 1)
        file = folder / source.relative_to(TEAMS.parent)
        file.parent.mkdir(exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return folder / TEAMS.name


def test_organisation_file_of_an_option_is_relative_to_the_current_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "own.toml").write_bytes(ORGANISATION.read_bytes())
    monkeypatch.chdir(tmp_path)
    load("mapping-nine-teams", [("--set", "organisation=own.toml")])
    with pytest.raises(ConfigurationError, match=r"there is no file none\.toml"):
        load("mapping-nine-teams", [("--set", "organisation=none.toml")])


def faults(file: Path) -> list[str]:
    with pytest.raises(ConfigurationError) as caught:
        set_up(load(str(file)))
    return str(caught.value).splitlines()


def line_of(file: Path, text: str) -> int:
    lines = file.read_text(encoding="utf-8").splitlines()
    return next(number for number, line in enumerate(lines, 1) if text in line)


# Templates and parents ----------------------------------------------------------------------------


def test_groups_of_a_template_have_its_roles_and_their_own_keys() -> None:
    groups = {group.name: group for group in groups_of(load("mapping-nine-teams"))}
    assert list(groups) == ["Fleet", "West", "Middle", "East"]
    for name in ("West", "Middle", "East"):
        group = groups[name]
        assert [role.name for role in group.roles] == ["Coordinator", "Performer", "Cartographer", "North", "South"]
        assert (group.within, group.templates, group.rally_point) == ("Fleet", ("Team",), f"{name.lower()} rally")
        north = group.role("North")
        assert north is not None
        assert (north.minimum, north.maximum, north.job) == (1, 1, f"{name.lower()} north")  # the first two inherited
        coordinator = group.role("Coordinator")
        assert coordinator is not None
        assert coordinator.head
        assert coordinator.played_by == ("Fleet", "Tactician")
    assert groups["Fleet"].subgroups == (Subgroups(template="Team", minimum=3, maximum=3),)


def test_later_parents_override_earlier_and_own_keys_override_all() -> None:
    raw = {
        "role": [
            {"name": "A", "minimum": 1, "maximum": 1, "job": "a", "requires": {"depth_m": 5.0, "speed_mps": 1.0}},
            {"name": "B", "extends": ["A"], "minimum": 2, "requires": {"depth_m": 9.0}},
            {"name": "C", "minimum": 3, "influences": ["X"]},
        ],
        "group": [{"name": "G", "role": [{"name": "R", "extends": ["B", "C"], "maximum": 7}]}],
    }
    found = specified(raw)
    assert found.faults == ()
    assert found.raw["group"][0]["role"] == [
        {
            "name": "R",
            "minimum": 3,
            "maximum": 7,
            "job": "a",
            "requires": {"depth_m": 9.0, "speed_mps": 1.0},
            "influences": ["X"],
        }
    ]


def test_templates_extend_templates_without_their_abstract_roles() -> None:
    raw = {
        "group_template": [
            {"name": "Base", "rally_point": "here", "role": [{"name": "Any", "abstract": True, "minimum": 2}]},
            {"name": "Team", "extends": ["Base"], "role": [{"name": "Hand", "extends": ["Any"]}]},
        ],
        "group": [{"name": "One", "template": "Team"}, {"name": "Two", "template": "Team", "rally_point": "there"}],
    }
    one, two = specified(raw).raw["group"]
    assert one == {"name": "One", "template": "Team", "rally_point": "here", "role": [{"name": "Hand", "minimum": 2}]}
    assert two == {**one, "name": "Two", "rally_point": "there"}


# Who is able --------------------------------------------------------------------------------------


def able(scenario: Scenario, role: str) -> list[str]:
    group, _, name = role.partition(".")
    database = database_of(scenario, mission_class(scenario.scenario.mission))
    return [data.name for data in database.able_to_play(group, name)]


@pytest.mark.parametrize(
    ("requires", "meets"),
    [
        ("speed_mps = 2.57", True),
        ("speed_mps = 2.58", False),
        ("depth_m = 100.1", False),
        ("endurance_s = 52800", False),
        ('sensor = "mapping"', True),
        ('sensor = "camera"', False),
    ],
)
def test_requirement_is_met_up_to_its_limit(requires: str, meets: bool) -> None:
    text = shipped()["mapping-rendezvous"].read_text(encoding="utf-8")
    text = text.replace('name = "Cartographer"\n', f'name = "Cartographer"\n  requires = {{ {requires} }}\n')
    document = Document.of_text(text, "mine.toml")
    if meets:
        assert able(scenario_from(document), "Operational.Cartographer") == ["AUV00", "AUV01", "AUV02"]
        return
    with pytest.raises(ConfigurationError, match=r"group\.Operational\.role\.Cartographer\.requires") as caught:
        scenario_from(document)
    assert "no vehicle meets it: " in str(caught.value)


# Bad input ----------------------------------------------------------------------------------------

IN_ORGANISATION = [  # replaced, by, where it points, what is said
    ("minimum = 1\nmaximum = 1\nrequires = { sensor",
     'extends = ["Second"]\nminimum = 1\nmaximum = 1\nrequires = { sensor', 'extends = ["Second"]',
     'role.Surveyor.extends = "Second": allowed: Surveyor, Leader'),
    ('played_by = "Fleet.Tactician"', 'played_by = "Fleet.Tactican"', 'played_by = "Fleet.Tactican"',
     "did you mean 'Fleet.Tactician'?"),
    ("maximum = 1\nhead = true", "head = true", 'name = "Coordinator"',
     "Coordinator.maximum: missing; allowed: 1, since a group has one head"),
    ('played_by = "Fleet.Tactician"', 'played_by = "Fleet.Tactician"\n  incompatible = ["Fleet.Tactician"]',
     'incompatible = ["Fleet.Tactician"]',
     "its holder has to play both: West.Coordinator is played by Fleet.Tactician"),
    ("requires = { social_layer = true, depth_m = 20.0 }",
     'requires = { social_layer = true, depth_m = 20.0 }\n  played_by = "West.Coordinator"',
     'played_by = "West.Coordinator"',
     "a cycle: Fleet.Tactician is played by West.Coordinator is played by Fleet.Tactician"),
    ("requires = { social_layer = true, depth_m = 20.0 }", "requires = { depth_m = 200.0 }",
     "requires = { depth_m = 200.0 }",
     "no vehicle meets it: ASV00 has depth_m 0, not 200; AUV00 has depth_m 100, not 200"),
    ("  minimum = 3\n  maximum = 3\n\n  [[group.role]]", "  minimum = 4\n  maximum = 4\n\n  [[group.role]]",
     "minimum = 4",
     "group.Fleet.subgroup.1.minimum = 4: 3 groups of template Team are within Fleet: West, Middle, East"),
    ('rally_point = "east', 'rally_pont = "east', 'rally_pont = "east',
     "unknown key, allowed here: name, template, within"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "place", "said"), IN_ORGANISATION)
def test_fault_of_an_organisation_has_file_line_and_allowed_values(
    tmp_path: Path, old: str, new: str, place: str, said: str
) -> None:
    found = faults(written(tmp_path, (old, new)))
    file = tmp_path / "organisations" / "three-teams.toml"
    of_it = [text for text in found if said in text]
    assert of_it, found
    assert of_it[0].startswith(f"{file}:{line_of(file, place)}: ")
    assert len(of_it) == 1, "said once, however many groups have it"


def test_cycles_of_parents_are_named_completely(tmp_path: Path) -> None:
    file = written(
        tmp_path,
        ('name = "Surveyor"', 'name = "Surveyor"\nextends = ["Leader"]'),
        ('name = "Leader"', 'name = "Leader"\nextends = ["Surveyor"]'),
        ('name = "Team"\n', 'name = "Team"\nextends = ["Team"]\n'),
    )
    text = "\n".join(faults(file))
    assert "a cycle: Leader extends Surveyor extends Leader; allowed: parents that do not extend it themselves" in text
    assert "a cycle: Team extends Team" in text


BESIDE = '[[group]]\nname = "Other"\nrally_point = "west rally"\nrole = []\n\n[[vehicle]]\nname = "ASV00"'


@pytest.mark.parametrize(("of_scenario", "old", "new", "said"), [
    (True, '[[vehicle]]\nname = "ASV00"', BESIDE, r"^[^:]*/nine-teams\.toml:.*group: given beside organisation"),
    (True, "three-teams.toml", "two-teams.toml", "organisation = .*there is no file"),  # and nothing of missing roles
    (False, "# Roles that others", "[[vehicle]]\nname = 'X'\n\n# Roles that others",
     "vehicle: unknown in an organisation file; allowed: group, group_template, role"),
    (False, 'name = "Leader"', 'name = "Leader"\nabstract = "yes"',
     'role.Leader.abstract = "yes": input should be a valid boolean'),
])  # fmt: skip
def test_invalid_organisation_is_refused_in_one_line(
    tmp_path: Path, of_scenario: bool, old: str, new: str, said: str
) -> None:
    file = written(tmp_path, of_scenario=((old, new),)) if of_scenario else written(tmp_path, (old, new))
    (text,) = faults(file)
    assert re.search(said, text), text


SCENARIO = "mapping-inspection"
ROLES = {"Inspectors.InspectionHead", "Inspectors.InspectionMember"}
SURVEYORS = "SELECT ?v { ?v a rm:SurveyPlatform } ORDER BY ?v"


class Hydrophone(SwathSettings):
    """Plug-in that declares its equipment class."""

    EQUIPMENT = "Sensor"
    gain_db: float = Field(0.0, description="gain")


def inspectors(name: str = SCENARIO, *settings: str) -> set[str]:
    """Vehicles able to play both roles of inspectors; none is able to play only one."""
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


@pytest.mark.parametrize(("equipment", "is_able"), [
    ("MappingSonar", True), ("SideScanSonar", True), ("MultibeamSonar", True), ("ImagingSonar", False),
    ("Camera", False),
])  # fmt: skip
def test_equipment_below_mapping_sonar_in_the_ontology_meets_the_role(equipment: str, is_able: bool) -> None:
    assert ("AUV01" in inspectors(SCENARIO, f"vehicle.AUV01.sensor.equipment={equipment}")) is is_able


def test_sensor_plugin_needs_its_equipment_class_for_the_role() -> None:
    assert "AUV01" not in inspectors(SCENARIO, f"vehicle.AUV01.sensor.type={__name__}:Hydrophone")
    both = (f"vehicle.AUV01.sensor.type={__name__}:Hydrophone", "vehicle.AUV01.sensor.equipment=SideScanSonar")
    assert "AUV01" in inspectors(SCENARIO, *both)


def test_equipment_is_known_to_all_vehicles(tmp_path: Path) -> None:
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
