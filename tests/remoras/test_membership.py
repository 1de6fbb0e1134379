"""Membership by lease, and the succession of leaders: pure functions of received packets."""

import random
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st
from samples import auv, database

from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.organisation.leadership import FURTHEST, N_TERMS, Claim, next_term, read_claim, successor
from remoras.organisation.membership import Changes, Lease, Membership, absent_peers

PEERS = ("AUV01", "AUV02", "AUV03")
LEASE_S, FRAME_S = 100.0, 10.0
heard = st.dictionaries(st.sampled_from(PEERS), st.floats(0.0, 500.0))


@given(heard, st.floats(0.0, 500.0), st.floats(0.0, 500.0))
def test_a_peer_received_within_the_lease_is_present(heard_s: dict[str, float], now_s: float, since_s: float) -> None:
    heard_s = {name: min(time_s, now_s) for name, time_s in heard_s.items()}
    absent = absent_peers(PEERS, heard_s, min(since_s, now_s), now_s, LEASE_S)
    assert all(now_s - heard_s.get(name, 0.0) >= LEASE_S for name in absent)


def test_a_vehicle_receiving_nothing_declares_no_peer_absent_before_isolation() -> None:
    """Leases of 100 s end at 120, 130 and 140 s; a quarter of a lease after 40 s, the last word, judgement ends."""
    seen = Membership("AUV00", ("AUV00", *PEERS), Lease(LEASE_S, FRAME_S))
    heard_s = {"AUV01": 20.0, "AUV02": 30.0, "AUV03": 40.0}
    for frame in range(1, 14):
        assert seen.look_around(10.0 * frame, heard_s) == Changes()
    assert seen.look_around(140.0, heard_s) == Changes(absent=PEERS)
    assert seen.cut_off
    assert seen.look_around(150.0, {**heard_s, "AUV02": 145.0}) == Changes(present=("AUV02",))
    assert not seen.cut_off


# Accrual ------------------------------------------------------------------------------------------

LONG = Lease(40 * FRAME_S, FRAME_S, 1e-6)


def looks(lease: Lease, heard: Callable[[int, str], bool], n_frames: int) -> dict[str, int]:
    """In which frame each peer is absent first."""
    seen, heard_s, first = Membership("AUV00", ("AUV00", *PEERS), lease), dict[str, float](), dict[str, int]()
    for frame in range(1, n_frames + 1):
        now_s = frame * FRAME_S
        heard_s |= {name: now_s for name in PEERS if heard(frame, name)}
        for name in seen.look_around(now_s, heard_s, max(heard_s.values(), default=0.0)).absent:
            first.setdefault(name, frame)
    return first


def test_a_silent_peer_is_absent_by_the_longest_lease_and_earlier_on_good_links() -> None:
    """The last word of AUV02 is of frame 100, until then of so many in five; frames of 10 s: 200 s are 20 of them."""
    noticed = list[dict[str, int]]()
    for n in (5, 3, 2, 1):
        noticed.append(looks(LONG, lambda frame, name, n=n: name != "AUV02" or (frame <= 100 and frame % 5 < n), 150))
    assert noticed == [{"AUV02": 120}, {"AUV02": 120}, {"AUV02": 127}, {"AUV02": 140}]


def test_a_long_absence_does_not_lengthen_later_leases() -> None:
    """AUV02 is away from frame 50 to 100, and for good from 150 on."""
    there = {"AUV02": lambda frame: frame <= 50 or 100 < frame <= 150}
    seen, absent_since = Membership("AUV00", ("AUV00", *PEERS), LONG), list[int]()
    heard_s = dict[str, float]()
    for frame in range(1, 201):
        heard_s |= {name: frame * FRAME_S for name in PEERS if name not in there or there[name](frame)}
        if "AUV02" in seen.look_around(frame * FRAME_S, heard_s, frame * FRAME_S).absent:
            absent_since.append(frame)
    assert absent_since == [70, 170]


@pytest.mark.parametrize("per", [0.2, 0.4, 0.6])
def test_packet_loss_alone_rarely_makes_a_peer_absent(per: float) -> None:
    """1e-6 for each silence; in 60,000 frames of three links that is less than once in ten such runs."""
    stream = random.Random(1)
    assert looks(LONG, lambda frame, name: stream.random() >= per, 60_000) == {}


# Succession ---------------------------------------------------------------------------------------

TEAM = Group(
    "Team",
    (
        RoleSpecification("Head", 1, 1, head=True, founding=True),
        RoleSpecification("Mate", founding=True),
        RoleSpecification("Hand", founding=True),
        RoleSpecification("Digger", job="pit"),
    ),
    succession=("Mate", "Hand"),
)


def organised(**roles: str) -> Organisation:
    return Organisation.of([TEAM], [RoleAssignment("Team", role, name) for name, role in roles.items()])


def test_succession_ranks_by_role_ability_energy_and_name() -> None:
    able = ("Head", "Mate", "Hand")
    fleet = database(
        auv("AUV01", playable_roles=able, energy_j=1.0e6),
        auv("AUV02", playable_roles=able, energy_j=2.0e6),
        auv("AUV03", playable_roles=(*able, "Digger"), energy_j=1.0e6),
        auv("AUV04", playable_roles=able, energy_j=2.0e6),
        auv("AUV05", playable_roles=("Mate",), energy_j=9.0e6),
        auv("AUV06", playable_roles=able, energy_j=9.0e6, social_layer=False),
    )
    hands = {f"AUV0{n}": "Hand" for n in range(1, 5)}
    everybody = organised(**{**hands, "AUV01": "Mate"}, AUV05="Mate", AUV06="Mate")
    assert successor(TEAM, everybody, fleet) == "AUV01"  # the only Mate that is able to lead
    assert successor(TEAM, organised(**hands), fleet) == "AUV03"  # the only one that can dig
    assert successor(TEAM, organised(**hands), fleet, {"AUV03"}) == "AUV02"  # energy, then the name
    assert successor(TEAM, organised(AUV05="Mate", AUV06="Mate"), fleet) is None


# Terms --------------------------------------------------------------------------------------------

KNOWN = st.integers(1, 3 * N_TERMS)


@given(KNOWN, st.integers(1 - N_TERMS // 2, FURTHEST))
def test_term_numbers_wrap_around(term: int, ahead: int) -> None:
    """Each is read as the nearest to the greatest known, unless that is from before the first."""
    claim = read_claim(Claim((term + ahead) % N_TERMS, -3), Claim(term, 0))
    assert claim == (Claim(term + ahead, -3) if term + ahead > 0 else None)


@given(KNOWN, st.integers(FURTHEST + 1, N_TERMS // 2 - 1))
def test_a_claim_whose_term_leaps_is_invalid(term: int, ahead: int) -> None:
    assert read_claim(Claim((term + ahead) % N_TERMS, -3), Claim(term, 0)) is None


def test_no_term_number_blocks_later_claims() -> None:
    """After any claim that is read, the next one is greater and is read alike by who has heard of neither."""
    for term in range(1, FURTHEST):
        claim = read_claim(Claim(term, 0), None)
        following = Claim(next_term(claim), -9)
        assert read_claim(following, claim) == read_claim(following, None) == Claim(term + 1, -9)
