"""Slot lists and ALOHA: nobody believes what is false, whoever sends when; free slots are found, lists are followed."""

import random

import pytest
from sampling import sampled
from turn_takers import Round, any_list

from exchange.policies import PAPER_POLICIES as POLICIES

ALL = sorted(POLICIES)
FOUR = ((0,), (1,), (2,), (3,))


def storm(sea: Round, n_frames: int, per: float, restarts: dict[int, tuple[int, bool]]) -> None:
    """Frames of a fleet whose vehicles observe now and then, and begin anew in the middle of a frame."""
    draws = sea.draws
    for frame in range(n_frames):
        for _ in range(2):
            if frame < 0.7 * n_frames and draws.random() < 0.5:
                sea.maps(draws.randrange(sea.n_nodes), draws.randrange(4000))

        def begin_anew(at: int = frame) -> None:
            if at in restarts:
                sea.restart(*restarts[at])

        sea.pass_frame(lambda sender, receiver: draws.random() < per, midway=begin_anew)
        assert sea.wrong() == []


def calm(sea: Round, n_frames: int = 80) -> None:
    """Nothing is lost, and of those who speak at once one is heard: all come to know the same."""
    for _ in range(n_frames):
        sea.pass_frame(is_fair=True)
        assert sea.wrong() == []
    assert len(set(sea.digests())) == 1
    assert [manager.n_open for manager in sea.managers] == [0] * sea.n_nodes


@pytest.mark.slow
@pytest.mark.parametrize("policy", ALL)
@pytest.mark.parametrize("seed", sampled(range(4), 0, 1))
@pytest.mark.parametrize("n_lists", [1, 2], ids=["one list", "two lists"])
def test_by_any_list_nobody_believes_what_is_false(policy: str, seed: int, n_lists: int) -> None:
    """And by two lists in use at once; restarts, with memory and without, fall in the middle of a frame."""
    draws = random.Random(seed)
    n_nodes, n_slots = draws.randint(2, 5), draws.randint(2, 7)
    n_slots = max(n_slots, n_nodes // 2 + 1)
    known = [any_list(draws, n_nodes, n_slots) for _ in range(n_lists)]
    sea = Round(n_nodes, policy, [known[node % n_lists] for node in range(n_nodes)], seed)
    storm(sea, 60, 0.4, {20: (1, False), 21: (0, True), 33: (1, True)})
    calm(sea)


@pytest.mark.slow
@pytest.mark.parametrize("policy", ALL)
@pytest.mark.parametrize("seed", range(2))
def test_in_aloha_nobody_believes_what_is_false(policy: str, seed: int) -> None:
    sea = Round(4, policy, seed=seed)
    storm(sea, 60, 0.5, {20: (1, False), 33: (2, True)})
    calm(sea)


@pytest.mark.parametrize("policy", ["ack", "m-ack", "mps-ack"])
def test_an_item_is_acknowledged_by_all_in_the_next_frame(policy: str) -> None:
    """In the order 2, 0, 1, 0 and without losses: told in a frame by 1, known to be held once 2 and 0 have spoken."""
    sea = Round(3, policy, [((2,), (0,), (1,), (0,))] * 3)
    sea.pass_frame()
    uid = sea.maps(1, 7)
    sea.pass_frame()
    assert sea.managers[1].n_open == 1
    sea.pass_frame()
    assert all(sea.managers[1].believes(peer, uid) for peer in (0, 2))
    assert sea.managers[1].n_open == 0


def test_one_of_two_packets_of_a_frame_is_no_acknowledgement_of_both() -> None:
    """Node 0 has two slots; node 1 loses what it says in the second, so it acknowledges neither until both came."""
    sea = Round(2, "ack", [((0,), (1,), (0,))] * 2)
    first = sea.maps(0, 1)
    spoken: list[int] = []

    def second_is_lost(sender: int, receiver: int) -> bool:
        spoken.append(sender)
        return sender == 0 and spoken.count(0) % 2 == 0

    for _ in range(4):
        sea.pass_frame(second_is_lost)
    assert sea.managers[1].holds(first)
    for _ in range(3):
        sea.pass_frame()
    assert [sent.n_acks for sent in sea.said if sent.slot % 3 == 1] == [0, 0, 0, 0, 0, 1, 1]


def test_one_without_a_slot_listens_a_frame_and_takes_the_first_in_which_it_heard_nobody() -> None:
    sea = Round(4, "ack", [((0,), (), (1,), (), (2,))] * 4)
    sea.dead.add(3)
    for _ in range(3):
        sea.pass_frame()
    sea.dead.clear()
    uid = sea.maps(3, 5)
    sea.pass_frame()
    assert sea.managers[3].turns.slots == ()
    sea.pass_frame()
    assert [slot % 5 for slot in sea.managers[3].turns.slots] == [1]
    assert sea.holders(uid) == [0, 1, 2, 3]
    assert (sea.collided, sea.unlisted) == (0, 0)


def test_two_who_join_at_once_take_one_slot_and_then_one_each() -> None:
    sea = Round(4, "ack", [((0,), (), (1,), ())] * 4)
    uids = [sea.maps(node, 5 + node) for node in (2, 3)]
    sea.pass_frame()
    sea.pass_frame()
    assert [[slot % 4 for slot in sea.managers[node].turns.slots] for node in (2, 3)] == [[1], [1]]
    assert sea.collided == 2
    for _ in range(8):
        sea.pass_frame()
    assert sorted(slot % 4 for node in (2, 3) for slot in sea.managers[node].turns.slots) == [1, 3]
    assert [sea.holders(uid) for uid in uids] == [[0, 1, 2, 3]] * 2


def test_two_lists_at_once_collide_and_are_counted() -> None:
    """0 and 1 have the list 0 1 2 3, the others 1 0 2 3: in two slots nobody has an owner that all agree on."""
    sea = Round(4, "ack", [FOUR, FOUR, ((1,), (0,), (2,), (3,)), ((1,), (0,), (2,), (3,))])
    for _ in range(5):
        sea.pass_frame()
    assert sea.collided == 0
    assert sea.unlisted == 5 * 2 * 2  # in each frame 2 and 3 hear 0 and 1 in each other's slot
    other = Round(4, "ack", [FOUR, ((1,), (0,), (2,), (3,)), FOUR, FOUR])
    for _ in range(5):
        other.pass_frame()
    assert other.collided == 5 * 2  # 0 and 1 speak at once in slot 0, unheard by 2 and 3; in slot 1 nobody speaks
