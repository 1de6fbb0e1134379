"""Altruism changes the motion of vehicles in field missions only if its cause is present."""

import pytest
from varied import Varied, tracks

OFF = "decision.weight_external=0.0"
CALM = "decision.tedium_per_s=0.0"
"""Waiting makes none dissatisfied, so none calls."""
FULL = ("vehicle.AUV03.sensor.corer.battery_j=1e6", "vehicle.AUV04.sensor.auger.battery_j=1e6")
"""Nobody needs energy."""
PLAIN = tuple(f"line.line {number}.escorted=false" for number in (2, 5, 7, 10))
"""No line takes an escort, so nobody waits for one."""
CAUSES = {
    "resupply-field": (1500.0, (FULL,)),
    "escort-lines": (900.0, (PLAIN,)),
    "recovery-field": (900.0, (("lifts.vehicles=1",),)),
    "ferry-passage": (500.0, ((CALM, "decision.dismay_per_s=0.0"),)),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CAUSES)
def test_altruism_changes_tracks_only_if_its_cause_is_present(name: str) -> None:
    duration_s, causes = CAUSES[name]
    flown, short = Varied(name, "own.toml").flown, f"scenario.duration_s={duration_s}"
    if name != "ferry-passage":  # in which rows meet later
        assert tracks(flown(1, short)) != tracks(flown(1, short, OFF))
    for cause in causes:
        assert tracks(flown(1, short, *cause)) == tracks(flown(1, short, *cause, OFF))
