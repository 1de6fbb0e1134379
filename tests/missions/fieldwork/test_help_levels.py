"""Factor ``help``: what waiting vehicles gain by calls and by auctions, whatever the strategy."""

import pytest
from recorded import flown, said
from sampling import sampled

AUCTION = "strategy.parameters.help=auction"
ESCORTED = tuple(f'line."line {n}".escorted=true' for n in (1, 3, 4, 6))
"""Eight lines of fourteen need an escort."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "strategy", ["plan-and-dispatch", *(pytest.param(n, marks=pytest.mark.thorough) for n in ("contract-net", "cbba"))]
)
@pytest.mark.parametrize("level", ["calls", "auction"])
def test_help_ends_the_recovery_sooner(strategy: str, level: str) -> None:
    named = f"strategy.name={strategy}"
    alone = flown("recovery-field", named)
    helped = flown("recovery-field", named, f"strategy.parameters.help={level}")
    assert helped.completed
    assert helped.end_s < alone.end_s


def test_an_awarded_vehicle_leaves_its_own_work_to_help() -> None:
    """Each vehicle that reports that it helps, while sites are left to survey, was awarded by the holder."""
    finished = flown("recovery-field", "strategy.name=contract-net", AUCTION, "scenario.duration_s=700")
    awards = {(vehicle, role): time_s for time_s, _, vehicle, role in reversed(said(finished, "isToHelp"))}
    helped = [(vehicle, lift, time_s) for time_s, vehicle, _, lift in said(finished, "helps")]
    assert helped
    for vehicle, lift, time_s in helped:
        assert awards[vehicle, f"Crew.Lifter of {lift}"] <= time_s


@pytest.mark.slow
@pytest.mark.parametrize("level", sampled(["calls", "auction"], "auction"))
def test_vehicles_that_take_jobs_on_their_own_are_escorted(level: str) -> None:
    """Peers know the holder of a line that needs an escort; each vehicle holds one and waits at first."""
    of_help = f"strategy.parameters.help={level}"
    assert flown("escort-lines", "strategy.name=cbba", of_help, *ESCORTED, "scenario.duration_s=3600").completed
