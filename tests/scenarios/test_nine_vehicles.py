"""Nine vehicles from files alone, in three teams within a fleet."""

from __future__ import annotations

import pytest

from missions.runs.run import Run, run
from missions.scenarios import load

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
