"""A corridor: two that meet head on pass where there is room; where there is none, the less satisfied one passes."""

import math

import crossings
import pytest
from crossings import Traveller, travel, traveller

from remoras.attraction import GuidanceConstants, Pulls
from remoras.behaviours import Approach, distance_m
from remoras.executive.satisfaction import DecisionConstants, call, evolved, signal_of
from remoras.functional.guidance import Guidance
from remoras.separation import Separation

END_M = 400.0


def corridor(width_m: float, monkeypatch: pytest.MonkeyPatch) -> tuple[Traveller, Traveller]:
    """Two 200 m apart in the middle of a corridor, each on its way to where the other one is.

    They turn on the spot, as vehicles with thrusters do: a turning circle of 4 m would not fit a corridor of 4 m.
    """
    monkeypatch.setattr(crossings, "BOUNDS_M", (-END_M, -width_m / 2.0, END_M, width_m / 2.0))
    one = traveller(0, (-100.0, 0.0), (100.0, 0.0), turn_rate_radps=math.pi)
    return one, traveller(1, (100.0, 0.0), (-100.0, 0.0), turn_rate_radps=math.pi)


@pytest.mark.parametrize("width_m", [40.0, 20.0, 14.0, 10.0, 8.0, 6.0])
def test_where_there_is_room_they_pass_within_the_walls(width_m: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """6 m are just enough: 5 m and the tenth of it that is kept in addition."""
    fleet = corridor(width_m, monkeypatch)
    farthest_m = 0.0
    for one in fleet:
        move = one.functional.act

        def act(dt_s: float, neighbours: object, one: Traveller = one, move: object = move) -> None:
            nonlocal farthest_m
            move(dt_s, neighbours)  # type: ignore[operator]
            farthest_m = max(farthest_m, abs(one.functional.motion.y_m))

        one.functional.act = act  # type: ignore[assignment, method-assign]
    found = travel(fleet)
    assert (found.n_arrived, found.n_conflicts) == (2, 0)
    assert found.longest_time <= 1.25
    assert farthest_m <= width_m / 2.0 + 0.01


def meet(
    fleet: tuple[Traveller, Traveller], satisfactions: list[float], constants: GuidanceConstants, until_s: int
) -> float:
    """Let two move that hear each other's signals; satisfactions follow their advance. Least distance (m)."""
    decision = DecisionConstants()
    approaches = [Approach(one.data.transit_speed_mps) for one in fleet]
    watch = Separation(fleet, 5.0)
    for one in fleet:
        layer = one.functional
        layer.guidance = Guidance(layer.motion, one.data, crossings.BOUNDS_M, constants)
    closest_m = math.inf
    for now_s in range(1, until_s + 1):
        seen = watch.look()
        signals = [call(signal_of(satisfaction), 0.0, decision) for satisfaction in satisfactions]
        for number, one in enumerate(fleet):
            other = fleet[1 - number]
            one.functional.picture.peers.positions_m[other.data.name] = other.functional.motion.position_m
            one.functional.heed(Pulls(signals[number], {}, {other.data.name: signals[1 - number]}))
        for number, one in enumerate(fleet):
            one.functional.act(1.0, seen.get(one.data.node, ()))
            to_go_m = distance_m(one.functional.motion, one.goal_m)
            if to_go_m > 1.0:
                advance = approaches[number].advance(to_go_m, float(now_s), performed=True)
                advance = None if one.functional.guidance.withdraws else advance  # as ``perceive`` has it
                satisfactions[number] = evolved(satisfactions[number], advance, 1.0, decision)
        closest_m = min(closest_m, math.dist(*(one.functional.motion.position_m for one in fleet)))
    return closest_m


@pytest.mark.parametrize("satisfactions", [(-60.0, 0.0), (0.0, -60.0), (100.0, 127.0), (-128.0, -100.0), (0.0, 0.0)])
def test_in_one_too_narrow_the_less_satisfied_one_passes(
    satisfactions: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """4 m are too narrow. The other one goes back before it; of two alike the first by name passes."""
    fleet = corridor(4.0, monkeypatch)
    closest_m = meet(fleet, list(satisfactions), GuidanceConstants(), 1200)
    first = 0 if satisfactions[0] <= satisfactions[1] else 1
    passed, other = fleet[first].functional.motion, fleet[1 - first].functional.motion
    assert distance_m(passed, fleet[first].goal_m) <= 2.0
    assert math.copysign(1.0, other.x_m) == math.copysign(1.0, fleet[first].goal_m[0])  # it never got by
    assert closest_m >= 5.0


def test_without_repulsion_they_stand_nose_to_nose(monkeypatch: pytest.MonkeyPatch) -> None:
    fleet = corridor(4.0, monkeypatch)
    assert meet(fleet, [-60.0, 0.0], GuidanceConstants(repulsion=0.0), 1200) >= 5.0
    assert all(abs(one.functional.motion.x_m) < 10.0 for one in fleet)


def test_a_call_that_is_answered_draws_the_vehicle_to_the_one_that_calls(monkeypatch: pytest.MonkeyPatch) -> None:
    """It heads for (100, 0); the one that calls is heard at (0, 40), and seen well clear of the way."""
    tracks = []
    for weight in (0.0, 1.0):
        one, other = corridor(200.0, monkeypatch)
        layer, motion = one.functional, one.functional.motion
        constants = GuidanceConstants(attraction=weight)
        layer.guidance = Guidance(motion, one.data, crossings.BOUNDS_M, constants)
        layer.picture.peers.positions_m[other.data.name] = (-70.0, 40.0)
        layer.heed(Pulls(0.0, {other.data.name: 1.0}, {}))
        still = crossings.traveller(1, (-70.0, 40.0), (-70.0, 40.0))
        watch = Separation([one, still], 5.0)
        for _ in range(10):
            layer.act(1.0, watch.look().get(0, ()))
        tracks.append(motion.y_m)
    assert tracks[0] == 0.0
    assert tracks[1] > 5.0
