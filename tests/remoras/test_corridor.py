"""Head-on encounters in a corridor: where it is too narrow, the less satisfied vehicle passes."""

import itertools
import math
from collections.abc import Sequence

import crossings
import pytest
from crossings import Traveller, traveller

from remoras.behaviours import Approach, distance_m
from remoras.executive.decision import DecisionConstants
from remoras.executive.layer import ExecutiveLayer
from remoras.functional.guidance import Guidance
from remoras.motion.attraction import GuidanceTable
from remoras.motion.separation import Separation

END_M = 400.0
ROLE = ("Operational", "Cartographer")
"""Of the activity by which all are guided."""


def corridor(width_m: float, monkeypatch: pytest.MonkeyPatch) -> tuple[Traveller, Traveller]:
    """Two 200 m apart in the middle of a corridor, each on its way to where the other one is.

    They turn on the spot, as vehicles with thrusters do: a turning circle of 4 m would not fit a corridor of 4 m.
    """
    monkeypatch.setattr(crossings, "BOUNDS_M", (-END_M, -width_m / 2.0, END_M, width_m / 2.0))
    one = traveller(0, (-100.0, 0.0), (100.0, 0.0), turn_rate_radps=math.pi)
    return one, traveller(1, (100.0, 0.0), (-100.0, 0.0), turn_rate_radps=math.pi)


class Talkative:
    """A traveller that decides, and hears in every fourth second what the others signal."""

    def __init__(self, of: Traveller, satisfaction: float, constants: GuidanceTable, passes_on: bool) -> None:
        self.of, self.layer = of, of.functional
        self.layer.guidance = Guidance(self.layer.motion, of.data, crossings.BOUNDS_M, constants)
        self.executive = ExecutiveLayer(DecisionConstants(), of.data.name, (), {ROLE: {ROLE}}, passes_on)
        self.executive.adopt(self.layer.prepare([crossings.GOING]), [ROLE])
        self.executive.satisfaction[ROLE] = satisfaction
        self.executive.decide(self.layer.perceive(()), 0.0, 0.0)
        self.layer.perform(self.executive.decision.chosen)
        self.approach = Approach(of.data.transit_speed_mps)

    def decide(self, now_s: float) -> None:
        """What ``Vehicle.think`` does, with the advance of who goes somewhere."""
        to_go_m = distance_m(self.layer.motion, self.of.goal_m)
        guidance, perceptions = self.layer.guidance, self.layer.perceive(self.executive.decision.chosen)
        advance = self.approach.advance(to_go_m, now_s, performed=True) if to_go_m > 1.0 else None
        waits = guidance.withdraws or guidance.queues
        going = [*perceptions[:-1], perceptions[-1]._replace(advance=None if waits else advance)]
        self.executive.decide(going, now_s, 2.0)
        self.layer.heed(self.executive.pulls(now_s))
        self.executive.yields_to = guidance.yields_to
        self.executive.is_hindered = guidance.hindered_s > 0.0


def meet(
    fleet: Sequence[Traveller],
    satisfactions: Sequence[float],
    constants: GuidanceTable,
    until_s: int,
    passes_on: bool = True,
) -> tuple[float, str]:
    """Let equals move that hear each other's signals until one has arrived. Least distance (m), and who it is."""
    talkers = [
        Talkative(one, satisfaction, constants, passes_on)
        for one, satisfaction in zip(fleet, satisfactions, strict=True)
    ]
    watch = Separation(fleet, 5.0)
    closest_m = math.inf
    for now_s in range(1, until_s + 1):
        seen = watch.look()
        for talker, other in itertools.permutations(talkers, 2) if now_s % 4 == 0 else ():
            talker.layer.picture.peers.positions_m[other.of.data.name] = other.layer.motion.position_m
            for role, value in other.executive.signals():
                talker.executive.hear(role, other.of.data.name, role[1], value, float(now_s))
        for talker in talkers:
            talker.layer.picture.body.now_s = float(now_s)
            if now_s % 2 == 0:
                talker.decide(float(now_s))
            talker.layer.act(1.0, seen.get(talker.of.data.node, ()))
        closest_m = min([closest_m, *(math.hypot(near.dx_m, near.dy_m) for near in itertools.chain(*seen.values()))])
        for one in fleet:
            if distance_m(one.functional.motion, one.goal_m) <= 2.0:
                return closest_m, one.data.name
    return closest_m, ""


@pytest.mark.parametrize("satisfactions", [(-60.0, 0.0), (0.0, -60.0), (-128.0, -100.0), (0.0, 0.0)])
def test_in_a_narrow_corridor_the_less_satisfied_vehicle_passes(satisfactions, monkeypatch) -> None:
    """4 m are too narrow. The other one goes back before it; of two alike the first by name passes."""
    fleet = corridor(4.0, monkeypatch)
    closest_m, arrived = meet(fleet, list(satisfactions), GuidanceTable(), 1200)
    first = 0 if satisfactions[0] <= satisfactions[1] else 1
    other = fleet[1 - first].functional.motion
    assert arrived == fleet[first].data.name
    assert math.copysign(1.0, other.x_m) == math.copysign(1.0, fleet[first].goal_m[0])  # it never got by
    assert closest_m >= 5.0


@pytest.mark.parametrize("passes_on", [True, False])
def test_a_row_backs_out_only_if_the_signal_is_relayed(passes_on: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three in a row meet a fourth that is less satisfied than all of them."""
    monkeypatch.setattr(crossings, "BOUNDS_M", (-END_M, -2.0, END_M, 2.0))
    row = [
        traveller(number, (-60.0 - 15.0 * number, 0.0), (200.0, 0.0), turn_rate_radps=math.pi) for number in range(3)
    ]
    last = traveller(3, (40.0, 0.0), (-80.0, 0.0), turn_rate_radps=math.pi)
    closest_m, arrived = meet([*row, last], [0.0, 0.0, 0.0, -100.0], GuidanceTable(), 500, passes_on)
    assert closest_m >= 5.0
    assert (arrived == last.data.name) == passes_on
