"""Cycles of waits, against the definition of a blocked set."""

from collections.abc import Mapping
from itertools import combinations

from hypothesis import given
from hypothesis import strategies as st

from remoras.deadlock import PeerWait, deadlocks

NAMES = "ABCDE"
PEERS = st.frozensets(st.sampled_from(NAMES), min_size=1)
WAITS = st.dictionaries(st.sampled_from(NAMES), st.builds(PeerWait, st.floats(0.0, 9.0), PEERS, st.integers(1, 3)))


def without_own(waits: Mapping[str, PeerWait]) -> dict[str, PeerWait]:
    return {name: wait._replace(peers=wait.peers - {name}) for name, wait in waits.items()}


def in_cycles(waits: Mapping[str, PeerWait], free: frozenset[str]) -> set[str]:
    """Vehicles that wait, over others, for themselves, within the largest set that no vehicle outside releases."""
    sets = [set(names) for n in range(len(waits) + 1) for names in combinations(waits, n)]
    can_go = free | waits.keys()
    blocked = set().union(*(s for s in sets if all(len(waits[a].peers & can_go - s) < waits[a].n_peers for a in s)))
    reached = {name: waits[name].peers & blocked for name in blocked}
    for _ in NAMES:
        reached = {name: peers.union(*(reached[peer] for peer in peers)) for name, peers in reached.items()}
    return {name for name in blocked if name in reached[name]}


@given(WAITS, st.frozensets(st.sampled_from(NAMES)), st.randoms())
def test_vehicles_of_cycles_are_blocked_and_wait_for_themselves(waits, others, draw) -> None:
    waits, free = without_own(waits), others - waits.keys()
    found = deadlocks(waits, free)
    names = [name for _, cycle in found for name in cycle]
    assert set(names) == in_cycles(waits, free)
    assert len(set(names)) == len(names)
    assert all(since_s == max(waits[name].since_s for name in cycle) for since_s, cycle in found)
    shuffled = draw.sample(sorted(waits), len(waits))
    assert deadlocks({name: waits[name] for name in shuffled}, free) == found


@given(WAITS, st.frozensets(st.sampled_from(NAMES)))
def test_free_vehicle_that_could_help_all_ends_every_deadlock(waits, others) -> None:
    waits, free = without_own(waits), others - waits.keys()
    helped = {name: wait._replace(peers=wait.peers | {"X"}, n_peers=1) for name, wait in waits.items()}
    assert deadlocks(helped, free | {"X"}) == []
