"""Elementary behaviours: what is chosen, what is left to others, and how far a leash lets a vehicle go."""

import math
import random
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from searching import Facts, mission

import missions.arrows.choosing as choosing_module
from missions.arrows.behaviours import HELD_S, Held
from missions.arrows.choosing import Choosing, Leg, Trail, goes_on, lawnmower_track
from missions.arrows.contact import Leash, Reach, contact_range_m
from missions.arrows.grid import contact_code
from remoras.activities import Activity, ActivityType

SEA = mission()
REACH = Reach((600.0, -60.0), 400.0, 600.0, 120.0)
FREE = Reach((600.0, -60.0), 400.0, math.inf, 120.0)
CHOOSING = Choosing({0: 60.0}, {0: 60.0}, 1.5, 1.0, 150.0)


def chosen(at_m: tuple[float, float], *held: tuple[tuple[float, float], tuple[float, float]], repulsion: float = 1.0):
    choosing = Choosing({0: 60.0}, {0: 60.0}, 1.5, repulsion, 150.0)
    chart = SEA.chart()
    leg = choosing.choose(chart, held, Trail(choosing, chart.grid), at_m, Leash(FREE), 0.0)
    assert leg is not None
    return leg.target_m


def test_it_goes_where_something_is_to_be_found() -> None:
    """All that is likely lies around one place: it goes there from both sides; where all is alike, to what is near."""
    chart = SEA.chart()
    likely = (chart.grid.x_m - 900.0) ** 2 + (chart.grid.y_m - 600.0) ** 2 < 100.0**2
    chart.prior = np.where(likely, 0.2, 1e-6) * np.ones_like(SEA.prior)
    chart.prior[0] = 1.0 - chart.prior[1:].sum(axis=0)
    chart.add("contact", ())
    for at_m in ((700.0, 600.0), (1100.0, 600.0)):
        leg = CHOOSING.choose(chart, (), Trail(CHOOSING, chart.grid), at_m, Leash(FREE), 0.0)
        assert leg is not None
        assert math.dist(leg.target_m, (900.0, 600.0)) < 160.0


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


def test_who_has_heard_twice_lately_who_acts_on_it_is_in_contact_wherever_it_is() -> None:
    leash, far_m = Leash(REACH), (600.0, 800.0)
    leash.update(far_m, 100.0, 100.0, 100.0)
    assert not leash.is_in_contact(100.0)  # one packet may come through from afar
    leash.update(far_m, 130.0, 130.0, 100.0)  # somebody else
    assert not leash.is_in_contact(130.0)
    leash.update(far_m, 140.0, 140.0, 140.0)
    assert leash.is_in_contact(150.0)
    assert not leash.is_in_contact(161.0)


LEGS = st.builds(
    Leg, st.tuples(st.floats(0.0, 1200.0), st.floats(0.0, 800.0)), st.floats(0.0, 50.0), st.floats(1.0, 900.0)
)
PLACES = st.tuples(st.floats(0.0, 1200.0), st.floats(0.0, 800.0))


@given(LEGS, PLACES, st.floats(0.0, 50.0), st.floats(0.0, 50.0), st.floats(0.0, 3600.0))
def test_the_more_it_has_to_tell_the_sooner_it_comes_back(
    leg: Leg, at_m: tuple[float, float], untold_bits: float, more_bits: float, left_s: float
) -> None:
    def on(leg: Leg, untold_bits: float, left_s: float) -> bool:
        return goes_on(leg, untold_bits, REACH, at_m, 1.5, left_s)

    assert on(leg, 0.0, left_s)  # with nothing to tell it never does
    assert on(leg, untold_bits, REACH.home_s(at_m, 1.5))  # nor where it would be too late
    if on(leg, untold_bits + more_bits, left_s):
        assert on(leg, untold_bits, left_s)
    if on(leg, untold_bits, left_s):
        assert on(leg._replace(bits=leg.bits + more_bits), untold_bits, left_s)


def test_what_is_found_late_is_told_while_there_is_time() -> None:
    """At 1 bit per 100 s, 500 s from contact: it turns back when what it holds outweighs that, and before the end."""
    at_m, leg = (600.0, 1090.0), Leg((600.0, 1090.0), 1.0, 100.0)
    reach = Reach((600.0, -60.0), 400.0, math.inf, 120.0)
    turns = [left_s for left_s in range(3000, 0, -100) if not goes_on(leg, 8.0, reach, at_m, 1.5, left_s)]
    assert reach.home_s(at_m, 1.5) == 500.0
    assert turns == [1300, 1200, 1100, 1000, 900, 800, 700, 600]


def test_what_was_found_is_left_to_who_identifies_it() -> None:
    chart, cell = SEA.chart(), 200
    chart.add("contact", [contact_code(0, 0, cell)])
    track = Trail(CHOOSING, SEA.grid)
    assert CHOOSING.information(chart, (), track, 0.0)[0][cell] > 0.0
    leaving = replace(CHOOSING, leaves_finds=True).information(chart, (), track, 0.0)[0]
    assert leaving[cell] == 0.0
    assert (leaving[:cell] > 0.0).all()
    assert mission().identifiers == ("AUV03",)


def told_by(n_legs: int, seed: int, monkeypatch: pytest.MonkeyPatch) -> float:
    """Bits per second over eight legs on a map with hills at random, where looks find nothing."""
    monkeypatch.setattr(choosing_module, "N_LEGS", n_legs)
    rng, chart = random.Random(seed), SEA.chart()
    hills = np.zeros(chart.grid.n_cells)
    for _ in range(6):
        x_m, y_m = rng.uniform(0.0, 1200.0), rng.uniform(0.0, 800.0)
        hills += np.exp(-((chart.grid.x_m - x_m) ** 2 + (chart.grid.y_m - y_m) ** 2) / 90.0**2)
    chart.prior = np.vstack([np.zeros_like(hills), *(0.02 * hills + 1e-5 for _ in SEA.prior[1:])])
    chart.prior[0] = 1.0 - chart.prior[1:].sum(axis=0)
    chart.add("contact", ())
    at_m, now_s, bits, track = (600.0, 0.0), 0.0, 0.0, Trail(replace(CHOOSING, again_s={0: math.inf}), chart.grid)
    for _ in range(8):
        leg = CHOOSING.choose(chart, (), track, at_m, Leash(FREE), now_s)
        assert leg is not None
        for part in range(41):
            share = part / 40.0
            track.note(
                (at_m[0] + share * (leg.target_m[0] - at_m[0]), at_m[1] + share * (leg.target_m[1] - at_m[1])), 0.0
            )
        at_m, now_s, bits = leg.target_m, now_s + leg.takes_s, bits + leg.bits
    return bits / now_s


def test_a_route_tells_more_than_one_target_after_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    ratios = [told_by(3, seed, monkeypatch) / told_by(1, seed, monkeypatch) for seed in range(4)]
    assert sum(ratios) / len(ratios) > 1.05


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
