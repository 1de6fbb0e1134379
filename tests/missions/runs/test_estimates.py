"""What is said before a mission of energy and time that cannot do the work."""

from dataclasses import dataclass, replace
from typing import Any

import pytest
from sample_vehicles import AUV

from missions.files import shipped
from missions.runs.estimates import _Part, cautions
from missions.runs.run import run
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.work import Outlook


def warned(scenario: str, *settings: str) -> list[str]:
    return [str(one) for one in cautions(resolved(load(scenario, [("--set", one) for one in settings])))]


def with_energy(scenario: str, energy_j: float) -> list[str]:
    return [f"vehicle.{one.name}.energy_j={energy_j}" for one in load(scenario).vehicle]


@dataclass(frozen=True)
class Far:
    name: str = "far"
    place_m: tuple[float, float] = (100.0, 0.0)


def test_the_energy_of_a_part_is_that_of_the_text() -> None:
    """50 s x 90 W + 600 s x 20 W + 125 s x 20 W = 19 kJ; 100 s of waiting at 10 W are 1 kJ more."""
    data = replace(
        AUV, start_m=(0.0, 0.0), transit_speed_mps=2.0, survey_speed_mps=1.0, hotel_w=10.0, drag_w_per_mps3=10.0
    )
    part, job = _Part(data, Outlook(0.0, data.start_m)), Far()
    part.take(job, Outlook(650.0, job.place_m))  # type: ignore[arg-type]
    assert part.energy_j(650.0) == pytest.approx(19e3)
    assert part.energy_j(750.0) == pytest.approx(20e3)


@pytest.mark.parametrize("scenario", shipped())
def test_shipped_scenarios_give_no_warning(scenario: str) -> None:
    assert warned(scenario) == []


@pytest.mark.parametrize("scenario", ["mapping-rendezvous", "mapping-patches", "pandora-inspection"])
@pytest.mark.parametrize("energy_j", [1.0, 30e3])
def test_every_vehicle_with_too_little_energy_is_named_with_figures(scenario: str, energy_j: float) -> None:
    found = warned(scenario, *with_energy(scenario, energy_j))
    assert [one.split(":")[0] for one in found] == [f"vehicle.{v.name}.energy_j" for v in load(scenario).vehicle]
    assert all(f"is {energy_j:g}, for " in one and " J: " in one for one in found)


def test_a_job_or_all_jobs_that_take_too_long_are_named_with_figures() -> None:
    """Each area of the rendezvous takes 1600 to 1800 s alone; the 13 patches together take three vehicles 2171 s."""
    alone, together = (warned(one, "scenario.duration_s=900.0") for one in ("mapping-rendezvous", "mapping-patches"))
    assert [one.split(":")[0] for one in alone] == ["job middle", "job left", "job right"]
    assert all("scenario.duration_s is 900" in one for one in alone)
    assert [one.split(" take ")[0] for one in together] == ["scenario.duration_s: is 900; all 13 jobs"]


def test_what_is_estimated_is_near_to_what_is_used() -> None:
    """Where all goes as planned, who has a part of the work uses what it is said to need, within a fifth."""
    settings = [("--set", one) for one in with_energy("mapping-rendezvous", 1.0)]
    found = {one.key.split(".")[1]: one.text for one in cautions(resolved(load("mapping-rendezvous", settings)))}
    finished = run(load("mapping-rendezvous", [("--set", "strategy.name=fixed-partition")]))
    used_j: dict[str, Any] = {row[1]: row[6] for row in finished.recorder.trajectories}
    for name in ("AUV00", "AUV01", "AUV02"):
        needed_j = float(found[name].split("about ")[1].split(" J")[0])
        assert used_j[name] == pytest.approx(needed_j, rel=0.2), name
