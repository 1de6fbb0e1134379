"""What each kind of the link makes of packets on a sea that loses none."""

from collections import Counter

import pytest

from exchange.acoustics.channel import Arrival
from exchange.schedule import TdmaSchedule
from stress.schedule import Schedule, StressFault, StressTable
from stress.sea import RoughSea

NAMES = ("A", "B", "C")
SLOTS = TdmaSchedule(3, 1.0, 0.5)
DATA = bytes(range(32))


class Still:
    """Everybody hears everything at once."""

    def transmit(self, slot: int, sender: int, data: bytes, now_s: float, positions_m: object) -> list[Arrival]:
        return [Arrival(node, now_s + 1.0, data) for node in range(3) if node != sender]


def sea(fault: StressFault, happened: Counter[str] | None = None) -> RoughSea:
    about = StressTable(
        version=1, scenario="", strategy="", vehicles=NAMES, seed=5, heal_s=1000.0, bound_s=2000.0, must_finish=False
    )
    forge = lambda data, slot, draw: b"forged"  # noqa: E731
    counted, nodes = Counter[str]() if happened is None else happened, {name: node for node, name in enumerate(NAMES)}
    return RoughSea(Still(), Schedule(stress=about, fault=(fault,)), SLOTS, forge, counted, nodes)


def heard(fault: StressFault, n: int = 600, sender: int = 0) -> list[list[Arrival]]:
    """Arrivals of packets of one sender, slot by slot, at time 0."""
    rough = sea(fault)
    return [rough.transmit(3 * frame + sender, sender, DATA, 0.0, []) for frame in range(n)]


def link(kind: str, **keys: object) -> StressFault:
    return StressFault(kind=kind, at_s=0.0, until_s=100.0, **keys)  # type: ignore[arg-type]


def test_a_share_is_lost_of_the_link_that_is_meant() -> None:
    found = heard(link("loss", vehicle="A", peer="B", share=0.3))
    n_b, n_c = (sum(one.receiver == node for arrivals in found for one in arrivals) for node in (1, 2))
    assert n_c == 600
    assert 0.63 * 600 < n_b < 0.77 * 600  # 3.7 standard deviations of a binomial of 600 and 0.7 are 0.07
    assert heard(link("loss", vehicle="B"), sender=0) == heard(link("loss", vehicle="B", share=0.5), sender=0)


def test_bursts_lose_all_of_some_spells() -> None:
    found = heard(link("bursts", vehicle="A", peer="B", share=0.5, slots=30))
    got = [any(one.receiver == 1 for one in arrivals) for arrivals in found]
    spells = [set(got[start : start + 10]) for start in range(0, 600, 10)]
    assert all(len(spell) == 1 for spell in spells)
    assert {True} in spells
    assert {False} in spells


@pytest.mark.parametrize("one_way", [False, True])
def test_a_partition_cuts_one_way_or_both(one_way: bool) -> None:
    fault = link("partition", vehicle="A", one_way=one_way)
    assert heard(fault, 1)[0] == []
    assert [one.receiver for one in heard(fault, 1, sender=1)[0]] == ([0, 2] if one_way else [2])


def test_packets_come_twice_late_and_back_to_their_sender() -> None:
    assert [(one.receiver, one.time_s) for one in heard(link("twice", slots=2), 1)[0]] == [
        (1, 1.0), (1, 4.0), (2, 1.0), (2, 4.0),
    ]  # fmt: skip
    assert [(one.receiver, one.time_s) for one in heard(link("late", slots=2), 1)[0]] == [(1, 4.0), (2, 4.0)]
    echoed = heard(link("echo", vehicle="A", slots=2), 1)[0]
    assert [(one.receiver, one.time_s) for one in echoed] == [(0, 4.0), (1, 1.0), (2, 1.0)]


@pytest.mark.parametrize("bits", [1, 2, 8])
def test_so_many_bits_are_flipped(bits: int) -> None:
    for arrivals in heard(link("bits", bits=bits), 50):
        for one in arrivals:
            turned = int.from_bytes(one.data, "big") ^ int.from_bytes(DATA, "big")
            assert turned.bit_count() == bits


def test_packets_are_cut_and_forged() -> None:
    cut = [one.data for arrivals in heard(link("cut"), 50) for one in arrivals]
    assert all(DATA.startswith(data) and len(data) < len(DATA) for data in cut)
    assert len(set(cut)) > 10
    assert {one.data for arrivals in heard(link("forged"), 5) for one in arrivals} == {b"forged"}


def test_nothing_befalls_packets_after_it_is_over_or_on_a_calm_sea() -> None:
    happened: Counter[str] = Counter()
    rough = sea(link("loss"), happened)
    assert rough.transmit(0, 0, DATA, 99.0, []) == []
    assert happened == {"loss": 2}
    assert len(rough.transmit(0, 0, DATA, 100.0, [])) == 2
    rough.is_calm = True
    assert len(rough.transmit(0, 0, DATA, 50.0, [])) == 2
    assert happened == {"loss": 2}
