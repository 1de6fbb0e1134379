"""Invalid sites, loads, lines and contacts: refused with file, line, key, value and allowed values."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from sample_vehicles import AUV
from varied import Varied

from missions.errors import ConfigurationError
from missions.fieldwork.mission import RecoveryMission
from missions.meeting import JobMission, StayJob
from missions.scenarios import load
from missions.scenarios.parts import mission_class
from remoras.errors import PlanningError

ESCORT, FERRY = Varied("escort-lines", "lines.toml"), Varied("ferry-passage", "reef.toml")
HUNT, RECOVERY = Varied("minehunting-contacts", "contacts.toml"), Varied("recovery-field", "field.toml")
RESUPPLY = Varied("resupply-field", "field.toml")


def test_fleet_unable_to_do_the_jobs_is_refused(tmp_path: Path) -> None:
    lone, blind = ESCORT.raw(), HUNT.raw()
    del lone["vehicle"][1:]
    for vehicle in blind["vehicle"]:
        vehicle.pop("sensor", None)
    for of, tables, says in (
        (ESCORT, lone, r"lines\.toml:\d+: line\.line 2\.escorted = true: takes two vehicles, and there is one"),
        (HUNT, blind, r"contacts\.toml:\d+: contact = 12: no vehicle could detect one"),
    ):
        with pytest.raises(ConfigurationError, match=says):
            load(str(of.written(tmp_path, tables)))


class Crowded(RecoveryMission):
    """Each lift takes more vehicles than there are."""

    def jobs_of(self, scenario: Any) -> list[Any]:
        return [replace(job, n_vehicles=9) if hasattr(job, "n_vehicles") else job for job in super().jobs_of(scenario)]


def test_job_of_more_vehicles_than_the_fleet_has_is_refused() -> None:
    with pytest.raises(ConfigurationError, match=r'job = "lift 1": the job takes 9 vehicles at once, the fleet has 4'):
        load("recovery-field", [("--set", f"scenario.mission={__name__}:Crowded")])


def test_stay_of_one_vehicle_is_no_behaviour_for_a_job_of_several() -> None:
    """One vehicle would complete it alone, unnoticed."""

    @dataclass(frozen=True)
    class Pair(StayJob):
        n_vehicles: int = 2

    mission = RecoveryMission.from_scenario(load("recovery-field"))
    with pytest.raises(PlanningError, match="'buoy' takes 2 vehicles at once"):
        JobMission.behaviour_at(mission, Pair("buoy", (0.0, 0.0), 60.0), AUV)


@pytest.mark.parametrize(("of", "jobs"), [
    (ESCORT, {"line": 14}), (RECOVERY, {"site": 12, "lift": 4}), (RESUPPLY, {"site": 18, "hole": 8}), (FERRY, {}),
    (HUNT, {}),
])  # fmt: skip
def test_each_job_has_a_role_which_is_added_once(tmp_path: Path, of: Varied, jobs: dict[str, int]) -> None:
    once = load(str(of.written(tmp_path, of.raw())))
    assert mission_class(once.scenario.mission).completed(once) == once
    roles = {role.name: role for role in once.group[0].role}
    found = {role.job for role in roles.values() if role.job is not None}
    assert not jobs or found == {f"{kind} {n}" for kind, most in jobs.items() for n in range(1, most + 1)}
    if of is FERRY:
        assert "Carrier of load 1" in roles["Hand"].influences
        assert {"Carrier of load 2", "Hand", "Leader"} <= set(roles["Carrier of load 1"].influences)
