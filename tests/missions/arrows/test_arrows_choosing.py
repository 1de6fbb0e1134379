"""Target selection: preferred cells, avoidance of cells chosen by others, limits of the return into contact."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from searching import Facts, mission

from missions.arrows import target_selection
from missions.arrows.behaviours import HELD_S, Held
from missions.arrows.target_selection import Choosing, Find, Hearers, Leash, Leg, Reach, Return, Trail, goes_on
from remoras.picture import Peers

SEA = mission()
REACH = Reach((600.0, -60.0), 400.0, 600.0, 120.0)
CHOOSING = Choosing({0: 60.0}, {0: 60.0}, 1.5, 1.0, 150.0)


def chosen(at_m: tuple[float, float], *held: tuple[tuple[float, float], tuple[float, float]], repulsion: float = 1.0):
    choosing = Choosing({0: 60.0}, {0: 60.0}, 1.5, repulsion, 150.0)
    chart = SEA.chart()
    leg = choosing.choose(chart, held, Trail(choosing, chart.grid), at_m, None, 0.0)
    assert leg is not None
    return leg.target_m


def test_leg_leads_to_likely_cells_or_else_to_the_nearest() -> None:
    """All probability is near one place, which is approached from both sides; uniform probability gives near cells."""
    chart = SEA.chart()
    likely = (chart.grid.x_m - 900.0) ** 2 + (chart.grid.y_m - 600.0) ** 2 < 100.0**2
    chart.prior = np.where(likely, 0.2, 1e-6) * np.ones_like(SEA.chart().prior)
    chart.prior[0] = 1.0 - chart.prior[1:].sum(axis=0)
    chart.add("contact", ())
    for at_m in ((700.0, 600.0), (1100.0, 600.0)):
        leg = CHOOSING.choose(chart, (), Trail(CHOOSING, chart.grid), at_m, None, 0.0)
        assert leg is not None
        assert math.dist(leg.target_m, (900.0, 600.0)) < 160.0


def test_leg_avoids_cells_that_others_have_chosen() -> None:
    alone = chosen((200.0, 300.0))
    other = chosen((200.0, 300.0), ((200.0, 300.0), alone))
    assert math.dist(alone, other) > 100.0
    assert chosen((200.0, 300.0), ((200.0, 300.0), alone), repulsion=0.0) == alone


def test_choice_of_a_silent_vehicle_expires() -> None:
    held, facts = Held(("AUV02",)), Facts({})
    facts.known["searchTarget", "AUV02"] = (500.0, 500.0)
    held.note(facts, 0.0)
    held.note(facts, 200.0)
    assert held.ways({"AUV02": (400.0, 500.0)}, 200.0) == [((400.0, 500.0), (500.0, 500.0))]
    assert held.ways({}, HELD_S + 1.0) == []
    facts.known["searchTarget", "AUV02"] = (100.0, 500.0)
    held.note(facts, HELD_S + 2.0)
    assert held.ways({}, HELD_S + 3.0) == [((100.0, 500.0), (100.0, 500.0))]


def test_cells_just_searched_have_no_information_for_a_while() -> None:
    chart, track = SEA.chart(), Trail(CHOOSING, SEA.grid)
    track.note((200.0, 300.0), 0.0)
    near = list(SEA.grid.near((200.0, 300.0), 60.0))
    assert (CHOOSING.information(chart, (), track, 30.0)[0][near] == 0.0).all()
    assert (CHOOSING.information(chart, (), track, 61.0)[0][near] > 0.0).all()


@settings(max_examples=10, deadline=None)
@given(st.floats(-100.0, 1300.0), st.floats(-100.0, 900.0), st.sampled_from((15.0, 60.0, 150.0)), st.integers(0, 99))
def test_choice_equals_that_among_all_routes(x_m: float, y_m: float, range_m: float, seed: int) -> None:
    """Routes that are not summed, by a bound of their information, could not win."""
    chart, choosing = SEA.chart(), Choosing({0: range_m, 1: 40.0}, {0: 60.0, 1: 60.0}, 1.5, 1.0, 150.0)
    shares = np.random.default_rng(seed).random(chart.prior.shape) ** 8.0 + 1e-6
    chart.prior = shares / shares.sum(axis=0)
    chart.add("contact", ())
    asked = chart, (), Trail(choosing, chart.grid), (x_m, y_m), None, 0.0
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(target_selection, "_most_along", lambda *of: np.full(len(of[-1]), math.inf))
        among_all = choosing.choose(*asked)
    assert choosing.choose(*asked) == among_all


@given(st.floats(0.0, 1200.0), st.floats(0.0, 800.0), st.floats(0.0, 500.0))
def test_every_allowed_target_leaves_time_to_return(x_m: float, y_m: float, since_s: float) -> None:
    leash, at_m, speed_mps = Leash(REACH), (x_m, y_m), 1.5
    leash.update((600.0, -60.0), math.inf, 0.0)
    leash.update(at_m, math.inf, since_s)
    allowed = leash.allows(SEA.grid.x_m, SEA.grid.y_m, at_m, speed_mps, since_s)
    for cell in np.flatnonzero(allowed)[::7]:
        target_m = SEA.grid.centre_m(int(cell))
        there_s = since_s + math.dist(at_m, target_m) / speed_mps
        assert REACH.holds(target_m) or there_s + REACH.home_s(target_m, speed_mps) <= leash.due_s + 1e-6


def test_find_counts_as_received_after_two_packets_of_the_camera() -> None:
    hearers, facts, peers = Hearers({"AUV03": 1.5}, 80.0), Facts({}), Peers()
    facts.add("one", (100.0, 100.0))
    for at_s, is_told in ((10.0, False), (10.0, False), (20.0, True)):  # one packet may come through from afar
        peers.heard_s = {"AUV03": at_s, "ASV00": 30.0}
        hearers.note(facts, peers)
        assert hearers.untold_m(facts) == ([] if is_told else [(100.0, 100.0)])
    facts.add("two", (500.0, 100.0))
    assert hearers.untold_m(facts) == [(500.0, 100.0)]
    facts.add("two, by another name", (510.0, 100.0))
    facts.known["identity", "two, by another name"] = "rock"
    assert hearers.untold_m(facts) == []


def test_camera_is_busy_for_way_and_stay_at_each_reported_find() -> None:
    """At 60 s it received finds 300 and 600 m ahead: for each 200 s of travel at 1.5 m/s, and 80 s of stay."""
    hearers, facts, peers = Hearers({"AUV03": 1.5}, 80.0), Facts({}), Peers()
    for name, east_m in (("far", 700.0), ("near", 400.0)):
        facts.add(name, (east_m, 100.0))
    for at_s in (50.0, 60.0):
        peers.heard_s = {"AUV03": at_s}
        hearers.note(facts, peers)
    peers.positions_m["AUV03"] = (100.0, 100.0)
    assert hearers.busy_until_s(facts, peers) == pytest.approx(60.0 + 2.0 * (200.0 + 80.0))
    facts.known["identity", "near"] = "rock"
    assert hearers.busy_until_s(facts, peers) == pytest.approx(60.0 + 400.0 + 80.0)


LEGS = st.builds(Leg, st.just((600.0, 700.0)), st.floats(0.0, 2.0), st.floats(1.0, 900.0))
FINDS = st.lists(st.builds(Find, st.floats(0.0, 1.0), st.floats(80.0, 600.0)), max_size=8)
TIMES = st.floats(0.0, 3600.0)


@given(LEGS, FINDS, FINDS, st.floats(0.0, 900.0), TIMES, TIMES)
def test_more_unreported_finds_never_delay_the_return(
    leg: Leg, finds: list[Find], more: list[Find], home_s: float, left_s: float, busy_s: float
) -> None:
    """From a leg that ends as far from contact as it began."""

    def on(finds: list[Find], busy_s: float) -> bool:
        back = Return(home_s, 2.0 * home_s)
        return goes_on(leg, finds, 300.0, back, back, left_s, busy_s)

    assert on([], busy_s)  # with nothing to tell it never does
    assert on(finds, left_s)  # nor where nobody has time to identify it
    if on([*finds, *more], busy_s):
        assert on(finds, busy_s)


def test_vehicle_at_the_rally_point_waits_for_contact_or_a_time_limit() -> None:
    leash = Leash(REACH)
    leash.update((600.0, 0.0), 0.0, 0.0)
    leash.update((600.0, 800.0), 0.0, 100.0)
    leash.update((600.0, 0.0), 50.0, 200.0)
    assert not leash.has_greeted
    leash.update((600.0, 0.0), 50.0, 319.0)
    assert not leash.has_greeted
    leash.update((600.0, 0.0), 50.0, 320.0)
    assert leash.has_greeted
    leash.update((600.0, 800.0), 50.0, 400.0)
    leash.update((600.0, 0.0), 405.0, 500.0)
    assert not leash.has_greeted
    leash.update((600.0, 0.0), 501.0, 502.0)
    assert leash.has_greeted
