"""Thirteen vehicles in seven groups of four levels: how long a lost head is missed, and whether the living are."""

from __future__ import annotations

from pathlib import Path

import pytest
from sampling import sampled

from missions.runs.run import Run, run
from missions.runs.summary import summary
from missions.scenarios import load, shipped

WITHIN = {"Wing": "Fleet", "East": "Fleet", "Flight": "Wing", "Middle": "Wing", "West": "Flight", "Far": "Flight"}
LEADING = {"Fleet": ("Admiral", "Tactician"), "Wing": ("Captain", "Officer"), "Flight": ("Chief", "Pilot")}
"""Groups of groups, each with the role of its head and the role that the heads of its subgroups play."""
TEAMS = {"West": 100.0, "Middle": 350.0, "East": 600.0, "Far": 850.0}
"""Groups that map, and where the two areas of each begin (m)."""
CORNERS = "[[{0}, {1}], [{0}, {3}], [{2}, {3}], [{2}, {1}]]"
POINT = '\n[[rally_point]]\nname = "{} rally"\nposition_m = [{}, {}]\n'


def four_levels(folder: Path) -> Path:
    """The ground of mapping-nine-teams, one team wider, for four vehicles more."""
    source = shipped()["mapping-nine-teams"]
    base = (source.parent / "organisations" / "three-teams.toml").read_text("utf-8").split('[[group]]\nname = "Fleet"')
    template = base[0].replace('within = "Fleet"\n', "").replace('  played_by = "Fleet.Tactician"\n', "")
    (folder / "levels.toml").write_text(template + "".join([*map(_of_groups, LEADING), *map(_team, TEAMS)]), "utf-8")

    text = source.read_text("utf-8").replace("organisations/three-teams.toml", "levels.toml")
    text = text.replace("1000.0", "1200.0").split("[[area]]")[0]
    heads = "".join(f'"{role}.RendezVous" = 0.2\n' for role in ("Captain", "Officer", "Chief", "Pilot", "Admiral"))
    text = text.replace('"MissionAdministrator.RendezVous" = 0.3\n', heads)
    for name, west_m in TEAMS.items():
        for half, south_m in (("south", 100.0), ("north", 250.0)):
            corners = CORNERS.format(west_m, south_m, west_m + 250.0, south_m + 150.0)
            text += f'\n[[area]]\nname = "{name} {half}"\ncorners_m = {corners}\n'
        text += POINT.format(name, west_m + 125.0, 450.0)
    for north, name in enumerate(LEADING):
        text += POINT.format(name, 475.0, 650.0 - 50.0 * north)
    for slot in range(13):
        text += _vehicle(slot)
    (folder / "mine.toml").write_text(text, "utf-8")
    return folder / "mine.toml"


def _above(name: str) -> str:
    """What the head of a group within another plays there."""
    return f'  played_by = "{WITHIN[name]}.{LEADING[WITHIN[name]][1]}"\n' if name in WITHIN else ""


def _of_groups(name: str) -> str:
    head, other = LEADING[name]
    place = f'within = "{WITHIN[name]}"' if name in WITHIN else 'mission = "Supervision"'
    dives = ", depth_m = 20.0" if name in WITHIN else ""
    return f"""
[[group]]
name = "{name}"
rally_point = "{name} rally"
{place}
succession = ["{other}"]

  [[group.role]]
  name = "{head}"
  extends = ["Leader"]
  influences = ["{other}"]
  requires = {{ social_layer = true{dives} }}
{_above(name)}
  [[group.role]]
  name = "{other}"
  minimum = 2
  maximum = 2
  founding = true
  influences = ["{head}"]
  requires = {{ social_layer = true, depth_m = 20.0 }}
"""


def _team(name: str) -> str:
    halves = "".join(
        f'\n  [[group.role]]\n  name = "{half.title()}"\n  job = "{name} {half}"\n' for half in ("south", "north")
    )
    return f"""
[[group]]
name = "{name}"
template = "Team"
within = "{WITHIN[name]}"
rally_point = "{name} rally"

  [[group.role]]
  name = "Coordinator"
{_above(name)}{halves}"""


def _vehicle(slot: int) -> str:
    """One surface vehicle, and twelve that dive."""
    kind, name = ("AUV", f"AUV{slot - 1:02d}") if slot else ("ASV", "ASV00")
    dives = f"depth_m = {16.0 + 4.0 * slot}\ndepth_limit_m = 100.0\n" if slot else ""
    sensor = "\n  [vehicle.sensor]\n  swath_m = 25.0\n  speed_limit_mps = 2.0\n" if slot else ""
    return f"""
[[vehicle]]
name = "{name}"
vehicle_type = "{kind}"
slot = {slot}
start_m = [{20.0 * (slot % 4)}, {20.0 * (slot // 4)}]
transit_speed_mps = 2.57
survey_speed_mps = 1.54
energy_j = 2.0e7
hotel_w = 40.0
drag_w_per_mps3 = 15.0
{dives}{sensor}"""


CASES = {
    f"{lost} {per}": (lost, per, most_s)
    for lost in ("ASV00", "AUV00", "AUV02")
    for per, most_s in ((0.0, 300.0), (0.4, 600.0))
}
"""Who is lost, who leads one group, two, or one of groups, at which PER, and for how long that may show (s)."""


def sailed(folder: Path, per: float, *settings: str) -> Run:
    return run(load(str(four_levels(folder)), [("--set", one) for one in (f"channel.per={per}", *settings)]), seed=1)


def absent(finished: Run) -> set[str]:
    """Whom anybody has taken for absent."""
    return {peer for _, _, peer, event in finished.recorder.membership if event == "absent"}


@pytest.mark.slow
@pytest.mark.parametrize("per", [0.0, 0.4])
def test_all_levels_meet_and_nobody_is_taken_for_absent(tmp_path: Path, per: float) -> None:
    finished = sailed(tmp_path, per)
    assert finished.completed, finished.reason
    assert {one.group for one in finished.milestones if one.name == "gathered"} == {*LEADING, *TEAMS}
    assert absent(finished) == set()
    assert summary(finished)["malformed_s"] == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("case", sampled(CASES, "ASV00 0.4"))
def test_a_lost_head_is_succeeded_within_minutes_though_a_frame_takes_24_s(tmp_path: Path, case: str) -> None:
    lost, per, most_s = CASES[case]
    finished = sailed(tmp_path, per, f'fault=[{{kind="lost",vehicle="{lost}",at_s=300}}]')
    assert finished.completed, finished.reason
    assert absent(finished) == {lost}
    assert 0.0 < summary(finished)["malformed_s"] <= most_s
