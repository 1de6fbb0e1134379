"""Packets of real missions, in every form that a fleet may give them, and what was true while they were sent."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import NamedTuple

from exchange.acoustics.channel import Arrival, Channel
from exchange.manager import ExchangeManager
from exchange.packets import ItemUid
from missions.runs.assembly import assemble, channel_of
from missions.runs.setup import Setup, resolved
from missions.scenarios import load
from remoras import Observation, SensorSettings
from remoras.fleet import Fleet
from worldmodel import Block, WorldModel

VICTIM = 3
"""Node that hears bad packets; no form lets it begin anew."""
SEED = 5
NOTES = """
@prefix rm: <https://w3id.org/remoras/marine#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
rm:note a owl:DatatypeProperty ; rdfs:label "note"@en ; rdfs:comment "What somebody noted."@en ;
    rdfs:domain rm:Vehicle ; rdfs:range xsd:string ; rm:maxBytes 24 .
"""
KEY = "00112233445566778899aabbccddeeff"
SALT = bytes(8)
"""Of all packets under the key: those of one fleet are played to the victim of another."""


class DiarySettings(SensorSettings):
    """A crew that notes something again and again."""

    def make(self, data):  # type: ignore[no-untyped-def]
        return _Diary(data.name)


class _Diary:
    table = None

    def __init__(self, vehicle: str) -> None:
        self._vehicle = vehicle

    def sense(self, pose, world, now_s):  # type: ignore[no-untyped-def]
        if now_s % 20.0:
            return []
        return [Observation(facts=((self._vehicle, "note", f"Rümpfe um {now_s:g} s"[:20]),))]


@dataclass(frozen=True)
class Form:
    """A mission whose packets have a form of their own.

    Attributes:
        name: of the form; scenario: that is run; settings: KEY=VALUE; {folder} stands for one with key and vocabulary.
        restarts: AUV00 begins anew with its memory, AUV01 without.
    """

    name: str
    scenario: str
    settings: tuple[str, ...]
    restarts: bool = False

    @property
    def is_protected(self) -> bool:
        """True if no damaged packet may be taken: one in 2**32 passes a checksum of 32 bits, or a key."""
        return any(one.startswith(("communication.crc_bits=32", "communication.key_file")) for one in self.settings)


def _of(*settings: str, policy: str = "ack", per: float = 0.2, duration_s: float = 600.0) -> tuple[str, ...]:
    about = f"communication.policy={policy}", f"channel.per={per}", f"scenario.duration_s={duration_s}"
    return (*about, *settings)


CHECKED, SEALED = "communication.crc_bits=32", "communication.key_file='{folder}/fleet.key'"
COARSE = "communication.coarse_above=1"
TEXTS = (
    "worldmodel.ontology=['{folder}/notes.ttl']",
    "communication.needs.note=5",
    "vehicle.AUV01.sensor=[{{swath_m=25.0, speed_limit_mps=2.0}}, "
    "{{type='tests.tools.mission_packets:DiarySettings'}}]",
)
FORMS = (
    Form("plain", "mapping-rendezvous", _of()),
    Form("matrices, crc 16", "mapping-rendezvous", _of("communication.crc_bits=16", policy="mps-ack-repeat")),
    Form("crc 32", "mapping-rendezvous", _of(CHECKED, policy="m-ack")),
    Form("key", "mapping-rendezvous", _of(SEALED, policy="ack-repeat")),
    Form("restarts", "mapping-rendezvous", _of(policy="mps-ack"), restarts=True),
    Form("restarts, crc 32", "mapping-rendezvous", _of(CHECKED, policy="mps-ack-repeat"), restarts=True),
    Form("texts", "mapping-rendezvous", _of(*TEXTS)),
    Form("texts, key", "mapping-rendezvous", _of(*TEXTS, SEALED, policy="m-ack-repeat")),
    Form("objects, coarse", "mapping-objects", _of(COARSE)),
    Form("objects, coarse, crc 32", "mapping-objects", _of(COARSE, CHECKED, policy="m-ack")),
    Form("aloha, crc 32", "mapping-rendezvous", _of(CHECKED, "communication.mac=aloha", policy="mps-ack-repeat")),
)


class _Life(NamedTuple):
    """A vehicle from when it is switched on: its model, and since when it holds each item (s)."""

    manager: ExchangeManager
    model: WorldModel
    since_s: dict[ItemUid, float]


class Sent(NamedTuple):
    """A packet: by whom, and when it is complete where it is heard (s)."""

    sender: int
    arrives_s: float
    data: bytes


@dataclass
class Traffic:
    """What a mission said, and what was true meanwhile.

    Attributes:
        setup: of the mission; sent: all its packets; heard: those that reached the victim, by time.
        lives: of each node, one behind the other; known: all blocks that anybody had.
    """

    setup: Setup
    sent: list[Sent] = field(default_factory=list)
    heard: list[Sent] = field(default_factory=list)
    lives: dict[int, list[_Life]] = field(default_factory=dict)
    known: set[Block] = field(default_factory=set)

    def victim(self) -> tuple[WorldModel, ExchangeManager]:
        """A vehicle that has heard nothing yet."""
        vehicle = assemble(self.setup, SEED, salt=SALT).vehicles[VICTIM]
        return vehicle.beliefs.model, vehicle.radio.manager

    def held(self, node: int, uid: ItemUid, now_s: float) -> bool:
        """True if a vehicle held an item by a time, in any of its lives."""
        return any(life.since_s.get(uid, now_s + 1.0) <= now_s for life in self.lives[node])

    def note(self, fleet: Fleet, now_s: float) -> None:
        """Note what vehicles hold that they did not hold before."""
        for vehicle in fleet.vehicles:
            manager, lives = vehicle.radio.manager, self.lives.setdefault(vehicle.data.node, [])
            if not lives or lives[-1].manager is not manager:
                lives.append(_Life(manager, vehicle.beliefs.model, {}))
            ledger, since_s = manager._ledger, lives[-1].since_s
            for column in range(len(since_s), len(ledger)):
                since_s[ledger.uids[column]] = now_s


class _Tapped:
    """A channel that notes what is sent."""

    def __init__(self, channel: Channel, traffic: Traffic) -> None:
        self._channel = channel
        self._traffic = traffic
        self.fleet: Fleet | None = None

    def transmit(
        self, slot: int, sender: int, data: bytes, now_s: float, positions_m: Sequence[tuple[float, float]]
    ) -> list[Arrival]:
        traffic, arrivals = self._traffic, self._channel.transmit(slot, sender, data, now_s, positions_m)
        assert self.fleet is not None
        traffic.note(self.fleet, now_s)
        if sender != VICTIM:
            traffic.sent.append(Sent(sender, now_s + traffic.setup.schedule.packet_s, data))
            traffic.heard += [Sent(sender, one.time_s, data) for one in arrivals if one.receiver == VICTIM]
        return arrivals


@cache
def _folder() -> Path:
    """Where the key and the vocabulary of texts are."""
    folder = Path(tempfile.mkdtemp(prefix="packets-"))
    (folder / "fleet.key").write_text(KEY, encoding="ascii")
    (folder / "fleet.key").chmod(0o600)
    (folder / "notes.ttl").write_text(NOTES, encoding="utf-8")
    return folder


@cache
def traffic_of(form: Form) -> Traffic:
    """What the mission of a form says in ten minutes."""
    settings = [("--set", one.format(folder=_folder()) if "{" in one else one) for one in form.settings]
    if form.restarts:
        struck = "{kind='restarts', vehicle='%s', at_s=%g, until_s=%g, memory='%s'}"
        faults = struck % ("AUV00", 150.0, 180.0, "kept"), struck % ("AUV01", 300.0, 330.0, "lost")
        settings.append(("--set", f"fault=[{', '.join(faults)}]"))
    setup = resolved(load(form.scenario, settings))
    traffic = Traffic(setup)
    tapped = _Tapped(channel_of(setup, SEED), traffic)
    fleet = tapped.fleet = assemble(setup, SEED, tapped, SALT)
    fleet.run()
    traffic.note(fleet, fleet.now_s)
    traffic.heard.sort(key=lambda one: one.arrives_s)
    for life in (life for lives in traffic.lives.values() for life in lives):
        model = life.model
        traffic.known.update(model.blocks(), model.arrivals.waiting.values(), model.arrivals.refused.values())
    fleet.close()
    return traffic
