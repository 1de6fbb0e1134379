"""The radio: what becomes news, who has not heard what, and the walk of an item, on a fleet at rest.

The fleet is that of the shipped mapping mission at time 0. Packets are handed over by hand, in the slots of its
schedule; every vehicle acknowledges what it has heard itself.
"""

from collections.abc import Iterator

import pytest

from missions.runs.setup import assemble, resolved
from missions.scenarios import load
from remoras.fleet import Fleet
from remoras.radio import Signalling
from remoras.recorder import Recorder
from remoras.vehicle import Vehicle

SETUP = resolved(load("mapping-rendezvous"))
ROLE = "Operational.LeftWinger"
GIVEN = ("AUV01", "playsRole", ROLE)


@pytest.fixture
def fleet() -> Iterator[Fleet]:
    assembled = assemble(SETUP, seed=1)
    yield assembled
    assembled.close()


def named(fleet: Fleet, name: str) -> Vehicle:
    return next(vehicle for vehicle in fleet.vehicles if vehicle.name == name)


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


def rows(recorder: Recorder) -> list[tuple[str, str, str]]:
    """Vehicle, item and event of every step of an item."""
    return [(row[1], row[2], row[4]) for row in recorder.knowledge]


def test_a_role_given_out_is_unheard_until_its_player_is_known_to_hold_it(fleet: Fleet) -> None:
    giver = named(fleet, "AUV00")
    peers = giver.functional.picture.peers
    tell(giver, GIVEN, 0.0)
    assert peers.unheard["AUV01"] == {ROLE}
    exchange(fleet, 0, deaf=("AUV01",))
    assert peers.unheard["AUV01"] == {ROLE}
    exchange(fleet, 1)
    exchange(fleet, 2)
    assert "AUV01" not in peers.unheard


def test_an_item_walks_from_observed_to_acknowledged(fleet: Fleet) -> None:
    giver = named(fleet, "AUV00")
    tell(giver, GIVEN, 0.0)
    for frame in range(3):
        exchange(fleet, frame)
    events = rows(fleet.recorder)
    (item,) = {item for _, item, _ in events}
    assert events[0] == ("AUV00", item, "observed")
    assert {name for name, _, event in events if event == "received"} == {"ASV00", "AUV01", "AUV02"}
    assert ("AUV00", item, "acknowledged") in events


def test_what_a_peer_says_of_a_job_is_news(fleet: Fleet) -> None:
    """A role is not: a supervisor is content while the mission advances, not while its members talk."""
    speaker, listener = named(fleet, "AUV01"), named(fleet, "AUV00")
    news = listener.functional.picture.peers
    tell(speaker, ("AUV01", "playsRole", "Operational.Cartographer"), 0.0)
    exchange(fleet, 0)
    assert news.last_news_s < 0.0
    assert news.heard_s["AUV01"] > 0.0
    tell(speaker, ("left", "mappedCell", 7), 12.0)
    exchange(fleet, 2)
    assert news.last_news_s == news.heard_s["AUV01"]
    assert speaker.functional.picture.peers.last_news_s < 0.0  # its own work is no news to it


def test_positions_are_noted_whoever_says_them(fleet: Fleet) -> None:
    vehicle = named(fleet, "AUV00")
    model, beliefs = vehicle.beliefs.model, vehicle.beliefs
    for now_s, x_m in ((1.0, 0.0), (2.0, -5.0)):
        vehicle.radio.note([model.record([beliefs.fact("AUV00", "position", (x_m, 0.0))], now_s)])
    vehicle.radio.note([model.record([beliefs.fact("AUV00", "position", (99.0, 0.0))], 0.5)])  # older news
    peers = vehicle.functional.picture.peers
    assert peers.positions_m == {"AUV00": (-5.0, 0.0)}
    assert abs(peers.headings_rad["AUV00"]) == pytest.approx(3.14159, abs=1e-5)


def test_a_packet_that_makes_no_sense_is_an_event(fleet: Fleet) -> None:
    listener = named(fleet, "AUV00")
    heard = listener.radio.hear(b"\xff" * 40, 0.5 * fleet.schedule.start_s(1))
    assert heard.reception.fault is not None
    assert (heard.changes, heard.signals) == ((), ())
    assert [row[2] for row in fleet.recorder.faults] == ["bad packet", "another definition"]
    assert listener.functional.picture.peers.heard_s == {}


def test_signals_name_the_roles_that_they_address(fleet: Fleet) -> None:
    """In the shipped scenario a Performer's signals address the Coordinator."""
    sender, listener = named(fleet, "AUV01"), named(fleet, "AUV00")
    node, schedule = sender.data.node, fleet.schedule
    sent = sender.radio.speak([(("Operational", "Performer"), -40)], schedule.start_s(node))
    heard = listener.radio.hear(sent.data, 0.5 * (schedule.start_s(node) + schedule.start_s(node + 1)))
    influences = SETUP.agreement.organisation.groups["Operational"].role("Performer").influences
    assert heard.emitter == "AUV01"
    assert heard.signals == ((Signalling("Operational", "Performer", influences), -40),)
    assert fleet.recorder.satisfaction == [(schedule.start_s(node), "AUV01", "Operational", "Performer", -40)]
