"""The radio on a fleet at rest: queued updates, undelivered items, and the path of an item.

The fleet is that of the shipped mapping mission at time 0. Packets are handed over by hand, in the slots of its
schedule; every vehicle acknowledges what it has heard itself.
"""

from collections.abc import Iterator

import pytest
from resting import named

from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.fleet.fleet import Fleet
from remoras.fleet.vehicle import Vehicle
from worldmodel import TYPE_UID, Block, merge

ROLE = "Operational.LeftWinger"
GIVEN = ("AUV01", "playsRole", ROLE)


def tell(vehicle: Vehicle, fact: tuple[str, str, object], now_s: float) -> None:
    """The vehicle concludes a fact and offers it to its peers."""
    change = vehicle.beliefs.model.record([vehicle.beliefs.fact(*fact)], now_s)
    vehicle.radio.tell(change, vehicle.social.addressed, now_s)


def exchange(fleet: Fleet, frame: int, deaf: tuple[str, ...] = ()) -> None:
    """Every vehicle speaks in its slot of a frame; all but the deaf hear it, half a slot later."""
    for sender in fleet.vehicles:
        opens_s = fleet.schedule.start_s(frame * fleet.schedule.n_nodes + sender.data.node)
        arrives_s = 0.5 * (opens_s + fleet.schedule.start_s(frame * fleet.schedule.n_nodes + sender.data.node + 1))
        sent = sender.radio.speak((), opens_s)
        for peer in fleet.vehicles:
            if peer is not sender and peer.name not in deaf:
                peer.radio.hear(sent.data, arrives_s)


def test_an_assigned_role_is_undelivered_until_its_player_acknowledges_it(fleet: Fleet) -> None:
    giver = named(fleet, "AUV00")
    peers = giver.functional.picture.peers
    tell(giver, GIVEN, 0.0)
    assert peers.unheard["AUV01"] == {ROLE}
    exchange(fleet, 0, deaf=("AUV01",))
    assert peers.unheard["AUV01"] == {ROLE}
    exchange(fleet, 1)
    exchange(fleet, 2)
    assert "AUV01" not in peers.unheard


def test_an_invalid_packet_is_recorded_as_an_event(fleet: Fleet) -> None:
    listener = named(fleet, "AUV00")
    heard = listener.radio.hear(b"\xff" * 40, 0.5 * fleet.schedule.start_s(1))
    assert heard.reception.fault is not None
    assert (heard.changes, heard.signals) == ((), ())
    assert [row[2] for row in fleet.recorder.faults] == ["bad packet", "another definition"]
    assert listener.functional.picture.peers.heard_s == {}


@pytest.fixture
def finders(monkeypatch: pytest.MonkeyPatch) -> Iterator[Fleet]:
    """The shipped mission, in which each vehicle may find one object, and waits for 30 s for what is not known."""
    setup = resolved(load("mapping-rendezvous", [("--set", "worldmodel.waiting_s=30")]))
    monkeypatch.setattr(type(setup.mission), "instances_found_per_vehicle", 1)
    assembled = assemble(resolved(setup.scenario), seed=1)
    yield assembled
    assembled.close()


def sent_without_announced_instance(fleet: Fleet, listener: Vehicle) -> Block:
    """AUV01 finds an object, keeps that to itself and says where it is; a listener hears the latter."""
    finder = named(fleet, "AUV01")
    model, tbox = finder.beliefs.model, finder.beliefs.model.tbox
    uid = model.new_instance_uid()
    model.record([(uid, TYPE_UID, tbox.class_named("ObjectOfInterest").uid)], 0.0, private=True)
    told = model.record([(uid, tbox.attribute_named("location").uid, (10.0, 20.0))], 0.0).block
    assert merge(listener.beliefs.model, [told], 1.0).changes == ()
    return told


def test_a_pending_block_and_its_discard_are_recorded_as_events(finders: Fleet) -> None:
    """It came at 1 s and waits for 30 s at most."""
    listener = named(finders, "AUV00")
    told = sent_without_announced_instance(finders, listener)
    node, uid = named(finders, "AUV01").data.node, told.facts[0].subject
    for now_s in (7.0, 14.0, 28.0):
        listener.radio.tidy(now_s)
    expected = [(7.0, "AUV00", "lacking", f"instance {uid} of AUV01; blocks that wait for it: 1")]
    assert finders.recorder.faults == expected
    assert listener.beliefs.model.arrivals.waiting
    listener.radio.tidy(35.0)
    (row,) = finders.recorder.faults[1:]
    assert row[:3] == (35.0, "AUV00", "dropped block: waited too long")
    assert not listener.beliefs.model.arrivals.waiting
    assert listener.beliefs.model.digest().get((node, 0)) is None


def test_facts_that_no_packet_carries_stay_private(fleet: Fleet) -> None:
    """An attribute without a priority, what is for the vehicle alone, and all where nobody speaks."""
    vehicle = named(fleet, "AUV01")
    tells, fact = vehicle.radio.tells, vehicle.beliefs.fact
    mapped, unlisted = fact("left", "mappedCell", 7), fact("AUV01", "claim", 3)
    assert tells([mapped])
    assert tells([unlisted, mapped])
    assert not tells([unlisted])
    assert not tells([mapped], is_sent=False)
    vehicle.radio.communicates = False
    assert not tells([mapped])


def test_private_items_have_own_numbers_and_leave_no_sequence_gap(fleet: Fleet) -> None:
    vehicle = named(fleet, "AUV01")
    before = len(fleet.recorder.items)
    node = vehicle.data.node
    for number, told in enumerate((True, False, True)):
        private = not vehicle.radio.tells([fact := vehicle.beliefs.fact("left", "mappedCell", number)], told)
        change = vehicle.beliefs.model.record([fact], 0.0, private)
        vehicle.radio.tell(change, vehicle.social.addressed, 0.0)
    assert [(row[0], row[7]) for row in fleet.recorder.items[before:]] == [
        (f"{node}-0", "told"), (f"{node}-p1", "kept"), (f"{node}-1", "told"),
    ]  # fmt: skip
