"""Groups from templates and parents, in a file of their own: what they come to, and what is refused, with its place."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from small_mission import SMALL

from missions.document import Document
from missions.errors import ConfigurationError
from missions.runs.results import manifest
from missions.runs.run import run
from missions.runs.setup import resolved as set_up
from missions.scenarios import load, shipped
from missions.scenarios.loading import scenario_from
from missions.scenarios.organisation import specified
from missions.scenarios.parts import database_of, groups_of, mission_class
from missions.scenarios.scenario import Scenario
from remoras.organisation import Subgroups

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


def faults(file: Path) -> list[str]:
    with pytest.raises(ConfigurationError) as caught:
        set_up(load(str(file)))
    return str(caught.value).splitlines()


def line_of(file: Path, text: str) -> int:
    lines = file.read_text(encoding="utf-8").splitlines()
    return next(number for number, line in enumerate(lines, 1) if text in line)


# Templates and parents ----------------------------------------------------------------------------


def test_instances_have_the_roles_of_their_template_and_keys_of_their_own() -> None:
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
    assert groups["Fleet"].subgroups == (Subgroups("Team", 3, 3),)


def test_the_later_parent_wins_and_own_keys_win_over_all() -> None:
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


def test_templates_extend_templates_and_abstract_roles_are_no_roles() -> None:
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


def test_a_role_may_extend_the_role_of_its_name_in_the_library() -> None:
    raw = {
        "role": [{"name": "Hand", "minimum": 2}],
        "group": [{"name": "G", "role": [{"name": "Hand", "extends": ["Hand"]}]}],
    }
    assert specified(raw).raw["group"][0]["role"] == [{"name": "Hand", "minimum": 2}]


def test_a_flat_scenario_is_left_as_it_is() -> None:
    raw = Document.of_text(SMALL, "pond.toml").raw
    assert specified(raw).raw is raw


def test_the_manifest_lists_whole_groups_and_repeats_the_run() -> None:
    loaded = load("mapping-nine-teams", [("--set", "scenario.duration_s=60")])
    finished = run(loaded, seed=2)
    again = scenario_from(Document.of_text(manifest(finished)["scenario"], "manifest.json"))
    assert again == loaded
    assert run(again, seed=2).recorder.organisation == finished.recorder.organisation != []


def test_the_organisation_is_a_key_that_may_be_set(tmp_path: Path) -> None:
    file = written(tmp_path)
    other = ORGANISATION.read_text(encoding="utf-8").replace('name = "East"', 'name = "Eastern"')
    (tmp_path / "other.toml").write_text(other, encoding="utf-8")
    loaded = load(str(file), [("--set", "organisation=other.toml"), ("--set", "group.Eastern.succession=[]")])
    assert [group.name for group in loaded.group] == ["Fleet", "West", "Middle", "Eastern"]
    assert loaded.group[-1].succession == ()


# Who is able --------------------------------------------------------------------------------------


def able(scenario: Scenario, role: str) -> list[str]:
    group, _, name = role.partition(".")
    database = database_of(scenario, mission_class(scenario.scenario.mission))
    return [data.name for data in database.able_to_play(group, name)]


def test_who_lists_no_roles_is_able_to_play_those_whose_requirements_it_meets() -> None:
    loaded = load("mapping-nine-teams")
    assert "ASV00" not in able(loaded, "West.Performer")  # depth
    assert "AUV07" not in able(loaded, "West.Coordinator")  # social layer
    assert "AUV07" in able(loaded, "West.Performer")
    assert "ASV00" not in able(loaded, "East.Cartographer")  # sensor
    assert "ASV00" in able(loaded, "Fleet.MissionAdministrator")


@pytest.mark.parametrize(
    ("requires", "meets"),
    [
        ("speed_mps = 2.57", True),
        ("speed_mps = 2.58", False),
        ("depth_m = 100", True),
        ("depth_m = 100.1", False),
        ("endurance_s = 50700", True),  # AUV02: 5.0e6 J / (40 + 15 * 1.575^3) W = 50707 s
        ("endurance_s = 52800", False),
        ('sensor = "mapping"', True),
        ('sensor = "camera"', False),
    ],
)
def test_a_requirement_holds_up_to_its_limit(requires: str, meets: bool) -> None:
    text = shipped()["mapping-rendezvous"].read_text(encoding="utf-8")
    text = text.replace('name = "Cartographer"\n', f'name = "Cartographer"\n  requires = {{ {requires} }}\n')
    document = Document.of_text(text, "mine.toml")
    if meets:
        assert able(scenario_from(document), "Operational.Cartographer") == ["AUV00", "AUV01", "AUV02"]
        return
    with pytest.raises(ConfigurationError, match=r"group\.Operational\.role\.Cartographer\.requires") as caught:
        scenario_from(document)
    assert "no vehicle meets it: " in str(caught.value)


def test_who_lists_a_role_must_meet_its_requirements_too(tmp_path: Path) -> None:
    listed = 'name = "AUV03"', 'name = "AUV03"\nplayable_roles = ["West.Performer", "South", "Coordinator"]'
    shallow = ("--set", "vehicle.AUV03.depth_m=10"), ("--set", "vehicle.AUV03.depth_limit_m=10")
    loaded = load(str(written(tmp_path, of_scenario=(listed,))))
    assert next(v for v in loaded.vehicle if v.name == "AUV03").playable_roles == (
        "West.Performer", "West.South", "Middle.South", "East.South",
        "West.Coordinator", "Middle.Coordinator", "East.Coordinator",
    )  # fmt: skip
    again = load(str(written(tmp_path, of_scenario=(listed,))), shallow)  # every one of them requires 20 m
    assert next(v for v in again.vehicle if v.name == "AUV03").playable_roles == ()


def test_a_vehicle_too_many_is_a_reserve(tmp_path: Path) -> None:
    """With room for two in each team there is nothing for the ninth and the eighth vehicle to found."""
    file = written(tmp_path, ('name = "Performer"\n  minimum = 1', 'name = "Performer"\n  minimum = 1\n  maximum = 1'))
    organisation = set_up(load(str(file))).agreement.organisation
    reserves = [f"AUV{n:02d}" for n in range(8) if not organisation.roles_of(f"AUV{n:02d}")]
    assert len(reserves) == 2


# Bad input ----------------------------------------------------------------------------------------

IN_ORGANISATION = [
    # (replaced, by, where it points, what is said)
    (
        "minimum = 1\nmaximum = 1\nrequires = { sensor",
        'extends = ["Second"]\nminimum = 1\nmaximum = 1\nrequires = { sensor',
        'extends = ["Second"]',
        'role.Surveyor.extends = "Second": allowed: Surveyor, Leader',
    ),
    (
        'extends = ["Leader"]\n  played_by',
        'extends = ["Leeder"]\n  played_by',
        'extends = ["Leeder"]',
        "did you mean 'Leader'?",
    ),
    (
        'template = "Team"\nrally_point = "west',
        'template = "Taem"\nrally_point = "west',
        '"Taem"',
        "group.West.template",
    ),
    (
        "minimum = 1\nmaximum = 1\nrequires = { sensor",
        "minimum = 2\nmaximum = 1\nrequires = { sensor",
        "minimum = 2",
        "role.Surveyor.minimum = 2: allowed: 0 to maximum = 1 (for West.North)",
    ),
    (
        'played_by = "Fleet.Tactician"',
        'played_by = "Fleet.Tactican"',
        'played_by = "Fleet.Tactican"',
        "did you mean 'Fleet.Tactician'?",
    ),
    (
        "maximum = 1\nhead = true",
        "head = true",
        'name = "Coordinator"',
        "Coordinator.maximum: missing; allowed: 1, since a group has one head",
    ),
    (
        'played_by = "Fleet.Tactician"',
        'played_by = "Fleet.Tactician"\n  incompatible = ["Fleet.Tactician"]',
        'incompatible = ["Fleet.Tactician"]',
        "its holder has to play both: West.Coordinator is played by Fleet.Tactician",
    ),
    (
        "requires = { social_layer = true, depth_m = 20.0 }",
        'requires = { social_layer = true, depth_m = 20.0 }\n  played_by = "West.Coordinator"',
        'played_by = "West.Coordinator"',
        "a cycle: Fleet.Tactician is played by West.Coordinator is played by Fleet.Tactician",
    ),
    (
        "requires = { social_layer = true, depth_m = 20.0 }",
        "requires = { depth_m = 200.0 }",
        "requires = { depth_m = 200.0 }",
        "no vehicle meets it: ASV00 has depth_m 0, not 200; AUV00 has depth_m 100, not 200",
    ),
    ('within = "Fleet"', 'within = "Fleat"', 'within = "Fleat"', "did you mean 'Fleet'?"),
    (
        'mission = "Supervision"',
        'mission = "Supervision"\nwithin = "West"',
        'within = "West"',
        "a cycle: Fleet is within West is within Fleet",
    ),
    (
        "  minimum = 3\n  maximum = 3\n\n  [[group.role]]",
        "  minimum = 4\n  maximum = 4\n\n  [[group.role]]",
        "minimum = 4",
        "group.Fleet.subgroup.1.minimum = 4: 3 groups of template Team are within Fleet: West, Middle, East",
    ),
    (
        'influences = ["Tactician"]',
        'influences = ["Tactician"]\n  incompatible = ["Tacticians"]',
        'incompatible = ["Tacticians"]',
        "did you mean 'Tactician'?",
    ),
    (
        'influences = ["Coordinator"]',
        'influences = ["Coordinator"]\n  authority = ["Cartografer"]',
        'authority = ["Cartografer"]',
        "did you mean 'Cartographer'?",
    ),
    (
        'rally_point = "east',
        'rally_pont = "east',
        'rally_pont = "east',
        "unknown key, allowed here: name, template, within",
    ),
    (
        'influences = ["Coordinator"]',
        'influense = ["Coordinator"]',
        'influense = ["Coordinator"]',
        "group_template.Team.role.Performer.influense",
    ),
]


@pytest.mark.parametrize(("old", "new", "place", "said"), IN_ORGANISATION)
def test_a_fault_of_an_organisation_names_its_file_its_line_and_what_is_allowed(
    tmp_path: Path, old: str, new: str, place: str, said: str
) -> None:
    found = faults(written(tmp_path, (old, new)))
    file = tmp_path / "organisations" / "three-teams.toml"
    of_it = [text for text in found if said in text]
    assert of_it, found
    assert of_it[0].startswith(f"{file}:{line_of(file, place)}: ")
    assert len(of_it) == 1, "said once, however many groups have it"


def test_cycles_of_parents_are_told_whole(tmp_path: Path) -> None:
    file = written(
        tmp_path,
        ('name = "Surveyor"', 'name = "Surveyor"\nextends = ["Leader"]'),
        ('name = "Leader"', 'name = "Leader"\nextends = ["Surveyor"]'),
        ('name = "Team"\n', 'name = "Team"\nextends = ["Team"]\n'),
    )
    text = "\n".join(faults(file))
    assert "a cycle: Leader extends Surveyor extends Leader; allowed: parents that do not extend it themselves" in text
    assert "a cycle: Team extends Team" in text


def test_a_role_of_a_template_that_extends_itself_is_a_cycle(tmp_path: Path) -> None:
    file = written(tmp_path, ('name = "Cartographer"', 'name = "Cartographer"\n  extends = ["Cartographer"]'))
    assert "a cycle: Cartographer extends Cartographer" in "\n".join(faults(file))


def test_groups_stand_in_one_of_the_two_files(tmp_path: Path) -> None:
    more = '[[group]]\nname = "Other"\nrally_point = "west rally"\nrole = []\n\n[[vehicle]]\nname = "ASV00"'
    (text,) = faults(written(tmp_path, of_scenario=(('[[vehicle]]\nname = "ASV00"', more),)))
    assert text.startswith(f"{tmp_path / TEAMS.name}:")
    assert "group: given beside organisation" in text


def test_a_file_that_is_not_there_and_tables_that_are_no_organisation_are_told(tmp_path: Path) -> None:
    file = written(tmp_path, of_scenario=(("three-teams.toml", "two-teams.toml"),))
    (text,) = faults(file)  # and nothing of roles that are missing for want of the file
    assert "organisation = " in text
    assert "there is no file" in text
    file = written(tmp_path, ("# Roles that others", "[[vehicle]]\nname = 'X'\n\n# Roles that others"))
    (text,) = faults(file)
    assert "vehicle: unknown in an organisation file; allowed: group, group_template, role" in text


def test_a_group_without_a_template_of_that_name_says_so() -> None:
    text = SMALL.replace('name = "Team"\n', 'name = "Team"\ntemplate = "Crew"\n')
    with pytest.raises(ConfigurationError, match=r'group\.Team\.template = "Crew": allowed: none'):
        scenario_from(Document.of_text(text, "pond.toml"))


def test_nobody_is_left_to_lead_where_two_heads_exclude_each_other(tmp_path: Path) -> None:
    """Both are led by the one vehicle that is able to: no founding gives both a head."""
    text = SMALL.replace("[[vehicle]]", OTHER + "[[vehicle]]", 1).replace('"Skipper"]', '"Skipper", "Mate"]')
    with pytest.raises(ConfigurationError, match="nobody came to play it before the mission"):
        set_up(scenario_from(Document.of_text(text, "pond.toml")))


OTHER = """\
[[group]]
name = "Crew"
rally_point = "jetty"
mission = "AreaMapping"

  [[group.role]]
  name = "Mate"
  minimum = 1
  maximum = 1
  head = true
  founding = true
  incompatible = ["Team.Skipper"]

"""


def test_a_file_without_a_group_and_no_name_of_a_file_are_told_alone(tmp_path: Path) -> None:
    file = written(tmp_path)
    (tmp_path / "empty.toml").write_text("", encoding="utf-8")
    for given, allowed in (('"empty.toml"', "there is no [[group]] in"), ("3", "a text: the name of a TOML file")):
        text = re.sub("^organisation = .*$", f"organisation = {given}", file.read_text("utf-8"), flags=re.M)
        (tmp_path / "other.toml").write_text(text, encoding="utf-8")
        (fault,) = faults(tmp_path / "other.toml")
        assert fault.startswith(f"{tmp_path / 'other.toml'}:")
        assert f"organisation = {given}: {allowed}" in fault


def test_a_role_is_not_incompatible_with_itself(tmp_path: Path) -> None:
    for own in ("Cartographer", "West.Cartographer"):
        new = f'name = "Cartographer"\n  incompatible = ["{own}"]'
        text = "\n".join(faults(written(tmp_path, ('name = "Cartographer"', new))))
        assert f'Team.role.Cartographer.incompatible = "{own}": allowed: other roles than itself' in text


def test_abstract_is_true_or_false(tmp_path: Path) -> None:
    for name, key in (("Leader", "role.Leader"), ("Cartographer", "group_template.Team.role.Cartographer")):
        (text,) = faults(written(tmp_path, (f'name = "{name}"', f'name = "{name}"\nabstract = "yes"')))
        assert f'{key}.abstract = "yes": true or false' in text
