"""Every strategy parameter has an effect: another value changes the tracks in the named case."""

from __future__ import annotations

import pytest
from sampling import sampled

from benchmarks.tuning import range_of, tunable, tuned
from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.fleet.fleet import Fleet
from remoras.strategies import parameters

LOSSES = ("mapping-patches", "channel.per=0.8")
ROOM = ("mapping-corridor", "channel.per=0.4")
"""A ground in which two vehicles may share a job."""
WORST = ("mapping-patches", "channel.per=0.9")
"""Members take up to 300 TDMA frames to acknowledge a job and 20 to accept one, and are not heard for 40."""
SLOW = ("mapping-patches", 'fault=[{kind="slow", vehicle="AUV02", at_s=300.0, factor=0.6}]')
"""The plan stops being a good one."""
WORST_AND_SLOW = (*WORST, SLOW[1])
"""The plan made before the dive has to be mended, by jobs that are told."""
SLOWEST = (*WORST, SLOW[1].replace("0.6", "0.15"))
"""A job is so late that another does it too, if it doubts."""
MUTE = ("mapping-patches", 'fault=[{kind="mute", vehicle="AUV00", at_s=60.0}]')
"""The head announces nothing that others hear."""
OWN_GAIN = (*LOSSES, "strategy.parameters.plans_for_all=false")
"""A discount weighs paths; in bids for a part of a plan it only settles conflicts."""
CASE_OF = {
    "discount_s": OWN_GAIN,
    "join_s": ROOM,
    "margin": SLOW,
    "contract-net.margin": LOSSES,
    "doubt_rounds": WORST_AND_SLOW,
    "status-broadcast.doubt_rounds": SLOWEST,
    "acknowledge_rounds": WORST,
    "plan-and-dispatch.acknowledge_rounds": WORST_AND_SLOW,
    "accept_rounds": WORST,
    "initiative_rounds": MUTE,
}
BEYOND = {"margin": 1.0}
"""A value beyond what is searched: who calls for work has none, so that giving it some gains more than 0.3."""
SEED = 1
TUNED = [
    (name, one.name)
    for name, strategy in tunable().items()
    if name not in ("remoras-planned", "cbba-plain")  # they have those of remoras and cbba, in the same code
    for one in tuned(strategy)
]
"""Strategies and their parameters."""


def fleet(strategy: str, case: tuple[str, ...], *settings: str) -> Fleet:
    scenario, *of_case = case
    keys = f"strategy.name={strategy}", *of_case, *settings
    return assemble(resolved(load(scenario, [("--set", key) for key in keys])), SEED)


def part(one: Fleet, other: Fleet) -> bool:
    """True once a vehicle of the one is elsewhere than in the other; both are stepped until then."""
    n = len(one.vehicles)
    while one.running and other.running:
        one.step()
        other.step()
        if one.recorder.trajectories[-n:] != other.recorder.trajectories[-n:]:
            return True
    return one.running != other.running


@pytest.mark.slow
@pytest.mark.parametrize(
    ("strategy", "parameter"),
    sampled(TUNED, *list({parameter: (strategy, parameter) for strategy, parameter in TUNED}.values())[::3]),
)
def test_each_strategy_parameter_changes_the_tracks(strategy: str, parameter: str) -> None:
    """One of these values, at least, gives other tracks than the default: the ends of its range, and one beyond."""
    default = next(one.default for one in parameters(tunable()[strategy]) if one.name == parameter)
    ends = [*(type(default)(end) for end in range_of(strategy, parameter)), BEYOND.get(parameter, default)]
    case = CASE_OF.get(f"{strategy}.{parameter}") or CASE_OF.get(parameter, LOSSES)
    settings = [f"strategy.parameters.{parameter}={str(end).lower()}" for end in ends if end != default]
    assert any(part(fleet(strategy, case), fleet(strategy, case, one)) for one in settings)
