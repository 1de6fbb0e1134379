"""Nine vehicles from files alone: in one group, in three teams within a fleet, and in three levels of groups."""

from __future__ import annotations

from pathlib import Path

import pytest

from missions.runs.run import Run, run
from missions.scenarios import load, shipped

TEAMS = ("West", "Middle", "East")


@pytest.fixture(scope="module")
def in_teams() -> Run:
    return run(load("mapping-nine-teams", [("--set", "channel.per=0.2")]), seed=3)


def members(finished: Run) -> dict[str, set[str]]:
    """Who founded which group."""
    organisation = finished.setup.agreement.organisation
    return {group: set(organisation.members(group)) for group in organisation.groups}


def gathered_s(finished: Run) -> dict[str, float]:
    return {one.group: one.time_s for one in finished.milestones if one.name == "gathered"}


def test_the_plan_of_a_team_stays_in_the_team(in_teams: Run) -> None:
    founded = members(in_teams)
    for _, vehicle, group, role, event in in_teams.recorder.roles:
        if event == "assigned" and group in TEAMS:
            assert vehicle in founded[group], f"{vehicle} plays {role} of {group}"
    worked = {
        (row[2], row[3]) for row in in_teams.recorder.roles if row[4] == "active" and row[3] in ("North", "South")
    }
    assert worked == {(team, role) for team in TEAMS for role in ("North", "South")}


def test_the_fleet_meets_after_its_teams(in_teams: Run) -> None:
    assert in_teams.completed, in_teams.reason
    met_s = gathered_s(in_teams)
    assert set(met_s) == {"Fleet", *TEAMS}
    assert met_s["Fleet"] == max(met_s.values())


LEADS = {"west": "Chief", "middle": "Aide"}
LED_BY = """name = "Coordinator"
  played_by = "Squadron.{role}"

  [[group.role]]
  name = "North"
  job = \""""


def three_levels(folder: Path) -> Path:
    """The teams West and Middle within a squadron, that and East within the fleet."""
    source = shipped()["mapping-nine-teams"]
    organisation = (source.parent / "organisations" / "three-teams.toml").read_text(encoding="utf-8")
    for old, new in (
        ("  [[group.subgroup]]\n  template = \"Team\"\n  minimum = 3\n  maximum = 3\n\n", ""),
        ('name = "Tactician"\n  minimum = 3\n  maximum = 3', 'name = "Tactician"\n  minimum = 2\n  maximum = 2'),
        ('name = "West"\ntemplate = "Team"\n', 'name = "West"\ntemplate = "Team"\nwithin = "Squadron"\n'),
        ('name = "Middle"\ntemplate = "Team"\n', 'name = "Middle"\ntemplate = "Team"\nwithin = "Squadron"\n'),
        *(('name = "North"\n  job = "' + team, LED_BY.format(role=role) + team) for team, role in LEADS.items()),
    ):  # fmt: skip
        assert old in organisation, old
        organisation = organisation.replace(old, new, 1)
    organisation += """
[[group]]
name = "Squadron"
within = "Fleet"
rally_point = "squadron rally"
succession = ["Aide"]

  [[group.role]]
  name = "Chief"
  extends = ["Leader"]
  played_by = "Fleet.Tactician"
  influences = ["Aide"]
  requires = { depth_m = 20.0 }

  [[group.role]]
  name = "Aide"
  minimum = 1
  maximum = 1
  founding = true
  influences = ["Chief"]
  requires = { depth_m = 20.0, social_layer = true }
"""
    text = source.read_text(encoding="utf-8").replace("organisations/three-teams.toml", "levels.toml")
    text += '\n[[rally_point]]\nname = "squadron rally"\nposition_m = [350.0, 500.0]\n'
    text = text.replace(
        '"Tactician.RendezVous" = 0.2',
        '"Tactician.RendezVous" = 0.1\n"Chief.RendezVous" = 0.2\n"Aide.RendezVous" = 0.2',
    )
    (folder / "levels.toml").write_text(organisation, encoding="utf-8")
    (folder / "mine.toml").write_text(text, encoding="utf-8")
    return folder / "mine.toml"


def test_meetings_go_from_the_bottom_up_to_any_depth(tmp_path: Path) -> None:
    """The Fleet's head gives the Squadron supervision, whose head gives its teams their areas."""
    finished = run(load(str(three_levels(tmp_path))), seed=1)
    assert finished.completed, finished.reason
    met_s = gathered_s(finished)
    assert max(met_s["West"], met_s["Middle"]) <= met_s["Squadron"]
    assert max(met_s["Squadron"], met_s["East"]) <= met_s["Fleet"]
    chief = finished.setup.agreement.organisation.heads("Squadron")[0]
    given = {(row[6], row[3], row[9]) for row in finished.recorder.organisation if row[7] == "mission"}
    assert given == {
        ("ASV00", "Squadron", "Supervision"), ("ASV00", "East", "AreaMapping"),
        (chief, "West", "AreaMapping"), (chief, "Middle", "AreaMapping"),
    }  # fmt: skip
