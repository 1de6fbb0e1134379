"""Attacks on the exchange, one by one: what a single cause would do to the beliefs and the knowledge of vehicles."""

import random
from collections.abc import Callable, Iterator
from functools import partial

import pytest
from storm_vehicles import AREA, creates, maps, storm_of
from stress.exchange_stress import DOUBLED, HEARD, LOST, Fate, Storm, chances, damaged, late, replayed

from benchmarks.manager_fleet import AREA_DONE
from exchange.policies import POLICIES
from worldmodel import TYPE_UID

EVERY_POLICY = pytest.mark.parametrize("policy", sorted(POLICIES))


def busy(storm: Storm, frames: int, fates: Iterator[Fate]) -> None:
    """Every vehicle that lives maps a cell in each round."""
    for _ in range(frames):
        for life in storm.all_alive():
            maps(storm, life, len(life.parts) + 1000 * life.is_twin)
        storm.run_frames(1, fates)
        storm.check()


def spoils() -> Iterator[Fate]:
    """One to three bits flip in a fifth of the packets."""
    draws = random.Random(3)
    while True:
        n_flips = draws.randint(1, 3) if draws.random() < 0.2 else 0
        yield damaged(*(draws.randrange(1 << 16) for _ in range(n_flips)))


BEFALL: dict[str, Callable[[], Iterator[Fate]]] = {
    "lost and doubled": lambda: chances(1, (0.4, LOST), (0.2, DOUBLED)),
    "damaged": spoils,
    **{
        f"{slots:g} slots late": partial(chances, 2, (0.2, LOST), (0.3, replayed(slots)), (0.1, late(slots)))
        for slots in (1.0, 3.0, 4.0, 16.0)
    },
}


@EVERY_POLICY
@pytest.mark.parametrize("name", BEFALL)
def test_lost_late_doubled_and_damaged_packets_make_no_false_belief(policy: str, name: str):
    """A checksum of 32 bits lets no damage pass."""
    storm = storm_of(4, policy, payload_bytes=32, crc_bits=32 if name == "damaged" else 0)
    busy(storm, 12, BEFALL[name]())
    storm.calm(30)
    storm.check_agreement()
    storm.check_rest()


# Two of one number --------------------------------------------------------------------------------


@EVERY_POLICY
def test_two_that_use_one_number_are_noticed(policy: str):
    """Each of the others hears now one of them and now the other. All report it, and then believe nothing false."""
    storm = storm_of(4, policy)
    storm.run_frames(2)
    storm.add_twin(1)
    busy(storm, 20, chances(9, (0.3, LOST)))
    assert all(life.has_noticed for life in storm.all_alive())
    assert storm.false_beliefs() == []


@pytest.mark.parametrize("policy", ["ack-repeat", "m-ack-repeat", "mps-ack-repeat"])
def test_what_others_acknowledged_to_one_of_two_with_one_number_is_not_believed_once_the_other_is_heard(policy: str):
    """Of two that speak as 2, 1 hears the one repeat its cell, and 0 the other. 0 acknowledges; then 1 hears both."""
    storm = storm_of(3, policy, payload_bytes=24, offsets_s=(0.2, 0.0, 0.0))
    for _ in range(4):
        creates(storm, 2)  # it says these first
    storm.add_twin(2)
    [cell] = maps(storm, 1, 50)
    heard_by_twins, by_0, late_by_1, twin_by_1 = [LOST, HEARD], HEARD, late(1.0), [LOST, HEARD]
    storm.run(3, [*heard_by_twins, by_0, late_by_1, *twin_by_1])
    assert not storm.lives[0].manager.holds(cell)
    storm.run(0.45)
    assert storm.lives[1].manager.believes(0, cell)  # as it had to, until it hears what comes late
    storm.run(0.55)
    assert storm.lives[1].has_noticed
    assert storm.false_beliefs() == []
    storm.remove_twins()
    storm.die(2)  # else it would repeat the cell itself
    storm.run_frames(40)
    assert storm.lives[0].manager.holds(cell)


# Half a block -------------------------------------------------------------------------------------


def test_half_a_block_becomes_whole_when_its_origin_is_back():
    """Only the first part of a block comes through before its origin falls silent for long."""
    storm = storm_of(3, "ack", payload_bytes=24)
    maps(storm, 0, *range(8))
    storm.run(1)
    storm.die(0)
    storm.run_frames(200)
    storm.start(0, keeps=True)
    assert [len(storm.lives[node].manager.half_blocks()) for node in (1, 2)] == [1, 1]
    storm.calm(80)
    assert [len(storm.lives[node].manager.half_blocks()) for node in (1, 2)] == [0, 0]
    storm.check_agreement()
    storm.check_rest()


def test_what_waits_too_long_is_given_up_and_comes_again():
    """Vehicle 0 creates an area, of which vehicle 1 tells. Vehicle 2 never hears vehicle 0, until it has dropped what 1
    told: a frame lasts 6 s, and a block waits for 120 s. Vehicle 1 believed that 2 held it."""
    storm = storm_of(3, "ack")
    for life in storm.lives.values():
        life.manager.relaying.clear()
    uid = storm.lives[0].model.new_instance_uid()
    storm.record(0, (uid, TYPE_UID, AREA))
    storm.run_frames(1, [HEARD, LOST])
    storm.record(1, (uid, AREA_DONE, 1))
    for _ in range(40):
        storm.run(1, [HEARD, LOST])
        storm.run(2)
        storm.check()
    assert storm.lives[2].gave_up
    storm.calm(40)
    storm.check_agreement()
    storm.check_rest()
