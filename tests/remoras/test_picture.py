"""The picture that behaviours look at: where peers are and which way they go, as far as heard."""

import math

from hypothesis import given
from hypothesis import strategies as st

from remoras.picture import Groups, Peers, Picture
from remoras.radio import note_position

places = st.tuples(st.integers(-1000, 1000).map(float), st.integers(-1000, 1000).map(float))


def test_a_first_position_says_nothing_of_a_heading() -> None:
    peers = Peers()
    note_position(peers, "A", (1.0, 2.0))
    assert peers.positions_m == {"A": (1.0, 2.0)}
    assert peers.headings == {}


def test_the_heading_is_from_the_last_position_to_this_one() -> None:
    """A unit vector: (x east, y north)."""
    peers = Peers()
    east, north, west = (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)
    for place, heading in [((0.0, 0.0), None), ((5.0, 0.0), east), ((5.0, 9.0), north), ((4.0, 9.0), west)]:
        note_position(peers, "A", place)
        assert peers.headings.get("A") == heading
    assert peers.headings.get("B") is None


def test_who_stays_where_it_was_keeps_its_heading() -> None:
    peers = Peers()
    for place in [(0.0, 0.0), (0.0, 1.0), (0.0, 1.0)]:
        note_position(peers, "A", place)
    assert peers.headings == {"A": (0.0, 1.0)}


@given(st.lists(st.tuples(st.sampled_from("AB"), places), max_size=12))
def test_each_vehicle_has_its_own_last_position_and_heading(seen: list[tuple[str, tuple[float, float]]]) -> None:
    """As each would have alone: what is heard of one says nothing of another."""
    together = Peers()
    for name, place in seen:
        note_position(together, name, place)
    for name in "AB":
        alone = Peers()
        for place in (place for other, place in seen if other == name):
            note_position(alone, name, place)
        assert together.positions_m.get(name) == alone.positions_m.get(name)
        assert together.headings.get(name) == alone.headings.get(name)


def test_at_the_start_nothing_was_heard_or_found_and_nobody_is_near() -> None:
    picture = Picture()
    assert picture.body.last_yield_s == picture.peers.last_news_s == -math.inf
    assert picture.body.contacts_m == ()
    assert (picture.body.battery, picture.body.outside_m) == (1.0, 0.0)
    assert picture.frame_s == math.inf  # nobody speaks


def test_two_vehicles_share_no_part() -> None:
    one, other = Picture(), Picture()
    note_position(one.peers, "A", (0.0, 0.0))
    one.peers.heard_s["A"] = 3.0
    one.groups.gathered.add("Team")
    assert (other.peers, other.groups) == (Peers(), Groups())
