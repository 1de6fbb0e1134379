"""Nine vehicles in three teams and four levels of groups, from files alone: rendezvous from the lowest level up."""

from __future__ import annotations

from pathlib import Path

import pytest
from flicker import undone
from recorded import flown

from missions.runs.run import Run
from missions.scenarios import shipped


def gathered_s(finished: Run) -> dict[str, float]:
    return {one.group: one.time_s for one in finished.milestones if one.name == "gathered"}


LEADS = {"west": "Chief", "middle": "Aide"}
LED_BY = """name = "Coordinator"
  played_by = "Squadron.{role}"

  [[group.role]]
  name = "North"
  job = \""""


def four_levels(folder: Path) -> Path:
    """The teams West and Middle within a squadron, that within a division, that and East within the fleet."""
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
within = "Division"
rally_point = "squadron rally"
succession = ["Aide"]

  [[group.role]]
  name = "Chief"
  extends = ["Leader"]
  played_by = "Division.Deputy"
  influences = ["Aide"]
  requires = { depth_m = 20.0 }

  [[group.role]]
  name = "Aide"
  minimum = 1
  maximum = 1
  founding = true
  influences = ["Chief"]
  requires = { depth_m = 20.0, social_layer = true }

[[group]]
name = "Division"
within = "Fleet"
rally_point = "division rally"
succession = ["Deputy"]

  [[group.role]]
  name = "Commander"
  extends = ["Leader"]
  played_by = "Fleet.Tactician"
  influences = ["Deputy"]
  requires = { depth_m = 20.0 }

  [[group.role]]
  name = "Deputy"
  minimum = 1
  maximum = 1
  founding = true
  influences = ["Commander"]
  requires = { depth_m = 20.0, social_layer = true }
"""
    text = source.read_text(encoding="utf-8").replace("organisations/three-teams.toml", "levels.toml")
    text += '\n[[rally_point]]\nname = "squadron rally"\nposition_m = [350.0, 500.0]\n'
    text += '\n[[rally_point]]\nname = "division rally"\nposition_m = [420.0, 530.0]\n'
    text = text.replace(
        '"Tactician.RendezVous" = 0.2',
        '"Tactician.RendezVous" = 0.2\n"Commander.RendezVous" = 0.2\n"Deputy.RendezVous" = 0.2\n'
        '"Chief.RendezVous" = 0.2\n"Aide.RendezVous" = 0.2',
    )
    (folder / "levels.toml").write_text(organisation, encoding="utf-8")
    (folder / "mine.toml").write_text(text, encoding="utf-8")
    return folder / "mine.toml"


@pytest.mark.slow
def test_members_of_several_levels_attend_the_lowest_rendezvous_first(tmp_path: Path) -> None:
    """Where a vehicle went to the meeting whose head had called last, 25 of 66 changes were undone."""
    finished = flown(str(four_levels(tmp_path)), "channel.per=0.4")
    assert finished.completed, finished.reason
    n_undone, n_changes = undone(finished.recorder.rows("activities"))
    assert n_undone <= 0.02 * n_changes
    met_s, below = gathered_s(finished), {"Division": "Squadron", "Fleet": "Division"}
    chosen = [row for row in finished.recorder.rows("decisions") if row[4] == "RendezVous" and row[12]]
    assert {row[2] for row in chosen} >= below.keys()
    squadron = finished.setup.agreement.organisation.members("Squadron")
    assert all(row[0] >= met_s[below[row[2]]] for row in chosen if row[1] in squadron and row[2] in below)
    organisation = finished.setup.agreement.organisation
    assert max(met_s["West"], met_s["Middle"]) <= met_s["Squadron"] <= met_s["Division"] <= met_s["Fleet"]
    (chief,), (commander,) = (organisation.heads(group) for group in ("Squadron", "Division"))
    given = {(row[6], row[3], row[9]) for row in finished.recorder.organisation if row[7] == "mission"}
    assert given == {
        ("ASV00", "Division", "Supervision"), (commander, "Squadron", "Supervision"), ("ASV00", "East", "AreaMapping"),
        (chief, "West", "AreaMapping"), (chief, "Middle", "AreaMapping"),
    }  # fmt: skip
