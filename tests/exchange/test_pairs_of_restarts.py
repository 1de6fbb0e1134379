"""Two vehicles begin anew, one after the other, while some links carry nothing in one direction.

Only so may a vehicle relay what a third one still holds true of an earlier life: at random this hardly ever comes.
"""

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from storm_vehicles import maps, storm_of
from stress.exchange_stress import HEARD, LOST, Storm

N_NODES = 4
POLICIES_TRIED = ("m-ack", "mps-ack", "mps-ack-repeat")
Links = frozenset[tuple[int, int]]


@st.composite
def phases(draw: st.DrawFn) -> list[tuple[int | None, int, Links]]:
    """Who begins anew, for how many slots, and the links that are cut: all to the first of the two, some from it."""
    first, second = draw(st.permutations(range(N_NODES)))[:2]
    others = [node for node in range(N_NODES) if node != first]
    some = st.frozensets(st.sampled_from([(first, node) for node in others]), max_size=2)
    cut = frozenset((node, first) for node in others) | draw(some)
    more = cut | draw(some)
    slots = st.integers(1, 4 * N_NODES)
    return [(None, 6 * N_NODES, frozenset()), (first, draw(slots), cut), (second, draw(slots), more), (None, 12, more)]


DEAF = frozenset({(1, 0), (2, 0), (3, 0)})
KNOWN = [
    (None, 24, frozenset()),
    (0, 4, DEAF | {(0, 1)}),
    (2, 4, DEAF | {(0, 1), (0, 2)}),
    (None, 12, DEAF | {(0, 1), (0, 2)}),
]
"""Node 1 never hears that 0 has begun anew; 2 passes on, in its next life, what 1 says of 0."""


def run(storm: Storm, phases: list[tuple[int | None, int, Links]]) -> None:
    """Let the phases pass; what is believed is held after each slot against what each peer holds itself."""
    slot = 0
    maps(storm, 3, 17)
    for begins, slots, cut in phases:
        if begins is not None:
            storm.restart(begins)
        for _ in range(slots):
            sender = slot % N_NODES
            fates = [LOST if (sender, node) in cut else HEARD for node in range(N_NODES) if node != sender]
            storm.run(1, fates)
            storm.check()
            slot += 1
    storm.calm(10)
    storm.check_agreement(of_all=False)


@pytest.mark.parametrize("policy", POLICIES_TRIED)
@settings(max_examples=40)
@given(phases())
@example(KNOWN)
def test_nobody_believes_what_an_earlier_life_of_a_peer_held(policy: str, phases) -> None:
    run(storm_of(N_NODES, policy), phases)
