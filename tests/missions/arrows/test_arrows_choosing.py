"""Elementary behaviours: what is chosen, what is left to others, and how far a leash lets a vehicle go."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from searching import Facts, mission

from missions.arrows.behaviours import HELD_S, Held
from missions.arrows.choosing import Choosing, Trail, lawnmower_track
from missions.arrows.contact import Leash, Reach, contact_range_m
from remoras.activities import Activity, ActivityType

SEA = mission()
REACH = Reach((600.0, -60.0), 400.0, 600.0, 120.0)
FREE = Reach((600.0, -60.0), 400.0, math.inf, 120.0)
CHOOSING = Choosing({0: 60.0}, {0: 60.0}, 1.5, 1.0, 150.0)


def chosen(at_m: tuple[float, float], *held: tuple[tuple[float, float], tuple[float, float]], repulsion: float = 1.0):
    choosing = Choosing({0: 60.0}, {0: 60.0}, 1.5, repulsion, 150.0)
    chart = SEA.chart()
    return choosing.choose(chart, held, Trail(choosing, chart.grid), at_m, Leash(FREE), 0.0)


def test_it_goes_where_something_is_to_be_found() -> None:
    """All that is likely lies around one place: it goes there from both sides; where all is alike, to what is near."""
    chart = SEA.chart()
    likely = (chart.grid.x_m - 900.0) ** 2 + (chart.grid.y_m - 600.0) ** 2 < 100.0**2
    chart.prior = np.where(likely, 0.2, 1e-6) * np.ones_like(SEA.prior)
    chart.prior[0] = 1.0 - chart.prior[1:].sum(axis=0)
    chart.add("contact", ())
    for at_m in ((700.0, 600.0), (1100.0, 600.0)):
        target_m = CHOOSING.choose(chart, (), Trail(CHOOSING, chart.grid), at_m, Leash(FREE), 0.0)
        assert target_m is not None
        assert math.dist(target_m, (900.0, 600.0)) < 160.0


def test_what_others_hold_is_left_to_them() -> None:
    alone = chosen((200.0, 300.0))
    other = chosen((200.0, 300.0), ((200.0, 300.0), alone))
    assert math.dist(alone, other) > 100.0
    assert chosen((200.0, 300.0), ((200.0, 300.0), alone), repulsion=0.0) == alone


def test_what_a_silent_vehicle_chose_long_ago_is_left_to_it_no_more() -> None:
    held, facts = Held(("AUV02",)), Facts({})
    facts.known["searchTarget", "AUV02"] = (500.0, 500.0)
    held.note(facts, 0.0)
    held.note(facts, 200.0)
    assert held.ways({"AUV02": (400.0, 500.0)}, 200.0) == [((400.0, 500.0), (500.0, 500.0))]
    assert held.ways({}, HELD_S + 1.0) == []
    facts.known["searchTarget", "AUV02"] = (100.0, 500.0)
    held.note(facts, HELD_S + 2.0)
    assert held.ways({}, HELD_S + 3.0) == [((100.0, 500.0), (100.0, 500.0))]


def test_what_was_just_looked_at_is_worth_nothing() -> None:
    chart, track = SEA.chart(), Trail(CHOOSING, SEA.grid)
    track.note((200.0, 300.0), 0.0)
    near = list(SEA.grid.near((200.0, 300.0), 60.0))
    assert (CHOOSING.information(chart, (), track, 30.0)[0][near] == 0.0).all()
    assert (CHOOSING.information(chart, (), track, 61.0)[0][near] > 0.0).all()


@given(st.floats(0.0, 1200.0), st.floats(0.0, 800.0), st.floats(0.0, 500.0))
def test_from_wherever_it_may_go_it_is_back_in_time(x_m: float, y_m: float, since_s: float) -> None:
    leash, at_m, speed_mps = Leash(REACH), (x_m, y_m), 1.5
    leash.update((600.0, -60.0), math.inf, 0.0)
    leash.update(at_m, math.inf, since_s)
    allowed = leash.allows(SEA.grid.x_m, SEA.grid.y_m, at_m, speed_mps, since_s)
    for cell in np.flatnonzero(allowed)[::7]:
        target_m = SEA.grid.centre_m(int(cell))
        there_s = since_s + math.dist(at_m, target_m) / speed_mps
        assert REACH.holds(target_m) or there_s + REACH.home_s(target_m, speed_mps) <= leash.due_s + 1e-6


def test_who_is_late_sets_out_for_contact() -> None:
    leash = Leash(REACH)
    leash.update((600.0, 0.0), math.inf, 0.0)
    far_m = 600.0, 800.0
    leash.update(far_m, math.inf, 1.0)
    way_s = REACH.home_s(far_m, 1.5)
    assert not leash.must_return(far_m, 1.5, 600.0 - way_s - 1.0)
    assert leash.must_return(far_m, 1.5, 600.0 - way_s)


def test_who_is_back_stays_until_it_hears_somebody_or_has_waited() -> None:
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


def test_contact_ends_where_the_channel_loses_more() -> None:
    """On the acoustic channel, the nearer the fainter; on one that knows no range, where it is cut off."""
    ranges_m = [
        contact_range_m(mission(f"channel.source_level_db={level}").scenario) for level in (112.0, 114.0, 120.0)
    ]
    assert ranges_m == sorted(ranges_m)
    assert ranges_m[0] < ranges_m[-1] < 1500.0
    for per in (0.0, 0.4, 0.9):
        assert contact_range_m(mission("channel.name=bernoulli", f"channel.per={per}").scenario) == 1500.0


@given(st.floats(50.0, 900.0), st.floats(50.0, 900.0), st.floats(20.0, 120.0))
def test_lanes_leave_nothing_out(width_m: float, height_m: float, apart_m: float) -> None:
    points_m = lawnmower_track(0.0, 0.0, width_m, height_m, apart_m)
    across = sorted({y for _, y in points_m} if width_m >= height_m else {x for x, _ in points_m})
    edges = [0.0, *across, min(width_m, height_m) if width_m != height_m else height_m]
    assert across[0] <= apart_m / 2.0 + 1e-6
    assert edges[-1] - across[-1] <= apart_m / 2.0 + 1e-6
    assert all(after - before <= apart_m + 1e-6 for before, after in pairwise(across))


@pytest.mark.parametrize("search", ["elementary", "lawnmower", "central"])
def test_each_search_is_carried_out_by_a_behaviour(search: str) -> None:
    of = mission(f"mission.search={search}")
    data = of._database[of.searchers[0]]
    behaviour = of.behaviour_for(Activity("Searching", ActivityType.GUIDANCE, ("search area",)), data)
    assert (
        type(behaviour).__name__ == {"elementary": "Searching", "lawnmower": "Sweeping", "central": "Obeying"}[search]
    )
