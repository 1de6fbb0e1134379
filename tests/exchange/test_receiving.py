"""What a manager makes of packets that contradict what it knows, come from the future, or from another life."""

from benchmarks.manager_fleet import (
    DURATION_S,
    MAPPED_CELL,
    N_BLOCKS,
    TBOX,
    ManagerFleet,
    bay,
    cells,
    instances,
    needs,
)
from exchange.manager.manager import ExchangeManager
from exchange.packets import Fragment
from exchange.policy.policies import POLICIES
from exchange.wire.codec import Codec, Widths
from worldmodel import Fault, FaultCode, Keeping, PropertyValue, WorldModel, merge


def packet_of(fleet: ManagerFleet, sender: int, *fragments: Fragment, frame: int = 0, epoch: int = 0) -> bytes:
    start_s = fleet.schedule.start_s(frame * fleet.n_nodes + sender)
    rows = [0] * fleet.n_nodes
    return fleet.codec.encode(sender, rows, fragments, frame=frame, epoch=epoch, slot_start_s=start_s)


def heard(fleet: ManagerFleet, receiver: int, *fragments: Fragment, frame: int = 0) -> tuple[Fault, ...]:
    """The faults that merging shows when a receiver hears node 0 say these in a frame."""
    arrives_s = fleet.schedule.start_s(frame * fleet.n_nodes) + 1.0
    reception = fleet.managers[receiver].receive(packet_of(fleet, 0, *fragments, frame=frame), arrives_s)
    assert reception.fault is None
    return merge(fleet.models[receiver], reception.blocks, arrives_s).faults


# One name, two contents ---------------------------------------------------------------------------


def test_whichever_content_comes_first_the_same_stays():
    one = Fragment(0, 0, 0.0, cells(2, 1))
    other = one._replace(facts=(PropertyValue(bay(2), MAPPED_CELL, 99.0),))
    hashes = set()
    for first, second in ((one, other), (other, one)):
        fleet = ManagerFleet(2)
        heard(fleet, 1, first)
        heard(fleet, 1, second, frame=1)
        hashes.add(fleet.models[1].state_hash())
    assert len(hashes) == 1


def test_a_part_with_other_content_makes_a_block_with_that_part():
    """Three parts of one cell each; the second comes once more with another cell."""
    parts = [Fragment(0, 0, 0.0, (fact,), index, 3) for index, fact in enumerate(cells(2, 3))]
    other = parts[1]._replace(facts=(PropertyValue(bay(2), MAPPED_CELL, 99.0),))
    fleet = ManagerFleet(2)
    assert heard(fleet, 1, *parts) == ()
    (fault,) = heard(fleet, 1, other, frame=1)
    assert fault.code is FaultCode.GUID_CONFLICT


# Facts from the future ----------------------------------------------------------------------------


def test_a_coarse_clock_makes_no_sound_fact_one_of_the_future():
    """Times are rounded to 10 s: what is observed at 8.2 s is of 10 s. It arrives at 9 s, without tolerance, and is
    sound; of 20 s nothing is. Slot 4 begins at 8 s."""
    fleet = ManagerFleet(2)
    codec = Codec(TBOX, len(instances(2)), 2, POLICIES["ack"], N_BLOCKS, DURATION_S, Widths(10.0))
    for time_s, is_refused in ((10.0, False), (20.0, True)):
        model = WorldModel(TBOX, 1, instances(2), 10.0, n_origins=2, keeping=Keeping(clock_tolerance_s=0.0))
        manager = ExchangeManager(1, model, codec, fleet.schedule, POLICIES["ack"], 512, needs(range(2)))
        fragment = Fragment(0, 0, time_s, cells(2, 1))
        data = codec.encode(0, [0, 0], [fragment], frame=2, slot_start_s=fleet.schedule.start_s(4))
        reception = manager.receive(data, 9.0)
        assert (reception.fault is not None) == is_refused
        assert (merge(model, reception.blocks, 9.0).faults, model.digest()) == (
            (),
            {} if is_refused else {(0, 0): (0, 0)},
        )
