"""The bid table: a join, so that vehicles which received the same bids agree."""

from hypothesis import given
from hypothesis import strategies as st
from samples import auv, database

from remoras.strategies.contract_net import Sayings
from remoras.strategies.negotiator import Claims, RoleClaim

FLEET = database(*(auv(f"AUV{n:02d}", playable_roles=("Scout", "Sweeper")) for n in range(3)), auv("AUV03"))
ROLES = ("Scout", "Sweeper")
News = tuple[str, str, RoleClaim]
news = st.lists(
    st.tuples(
        st.sampled_from(ROLES), st.sampled_from(FLEET.names), st.builds(RoleClaim, st.integers(0, 3), st.integers(0, 3))
    ),
    max_size=12,
)


def table(*heard: list[News]) -> Claims:
    made = Claims("Team")
    made.meet(FLEET, FLEET)
    for role, vehicle, claim in (one for some in heard for one in some):
        made.take(role, vehicle, claim)
    return made


def content(claims: Claims) -> tuple[object, ...]:
    """All that can be asked of a table."""
    latest = [claims.of(role, vehicle) for role in ROLES for vehicle in FLEET]
    beaten = [claims.beats(role, v, strength) for role in ROLES for v in FLEET for strength in range(5)]
    return latest, [claims.winner(role) for role in ROLES], beaten


@given(news)
def test_a_repeated_bid_changes_nothing(heard: list[News]) -> None:
    once = table(heard)
    before = content(once)
    assert not any(once.take(*one) for one in heard)
    assert content(once) == before


@given(news, st.randoms(use_true_random=False))
def test_the_winner_does_not_depend_on_the_order_of_bids(heard: list[News], random: object) -> None:
    shuffled = list(heard)
    random.shuffle(shuffled)  # type: ignore[attr-defined]
    assert content(table(shuffled)) == content(table(heard))


def test_the_strongest_bid_wins_and_ties_go_to_the_lower_node() -> None:
    claims = table(
        [("Scout", "AUV02", RoleClaim(1, 5)), ("Scout", "AUV01", RoleClaim(9, 5)), ("Scout", "AUV00", RoleClaim(9, 4))]
    )
    assert claims.winner("Scout") == "AUV01"
    assert not claims.beats("Scout", "AUV02", 5)
    assert claims.beats("Scout", "AUV00", 5)
    assert claims.winner("Sweeper") is None


def test_bids_of_departed_or_unable_vehicles_are_ignored() -> None:
    claims = table(
        [("Scout", "AUV00", RoleClaim(1, 5)), ("Scout", "AUV01", RoleClaim(1, 1)), ("Scout", "AUV03", RoleClaim(1, 9))]
    )
    assert claims.winner("Scout") == "AUV00"  # AUV03 is not able to
    claims.meet(("AUV01", "AUV03"), FLEET)
    assert claims.winner("Scout") == "AUV01"


times_s = st.lists(st.tuples(st.booleans(), st.integers(0, 9)), max_size=8)


def sayings(heard: list[tuple[bool, int]]) -> Sayings:
    made = Sayings()
    for held, time_s in heard:
        (made.held_s if held else made.left_s).add(time_s)
    return made


@given(times_s, st.randoms(use_true_random=False))
def test_holder_and_start_time_do_not_depend_on_reception_order(heard, random) -> None:
    shuffled = list(heard)
    random.shuffle(shuffled)
    assert sayings(shuffled).claim() == sayings(heard).claim()
