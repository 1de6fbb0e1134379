"""A fleet at rest for statements and receptions: a shipped mission before the first packet.

In `mapping-rendezvous` ASV00 is MissionAdministrator of Coordination, AUV00 its Tactician and Coordinator of
Operational; AUV01 and AUV02 are Performers.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from missions.runs.assembly import assemble
from missions.runs.setup import Setup, resolved
from missions.scenarios import load
from remoras.authority import Ruling
from remoras.fleet.fleet import Fleet
from remoras.fleet.vehicle import Vehicle
from worldmodel import Block, merge

Said = tuple[str, str, Any]
"""Subject, attribute, value: by name."""


@cache
def setup_of(scenario: str, *settings: str) -> Setup:
    """A scenario with keys set, once for all tests."""
    return resolved(load(scenario, [("--set", one) for one in settings]))


@contextmanager
def fleet_at_rest(*settings: str, scenario: str = "mapping-rendezvous") -> Iterator[Fleet]:
    """The fleet, with keys of its scenario set."""
    fleet = assemble(setup_of(scenario, *settings), seed=1)
    try:
        yield fleet
    finally:
        fleet.close()


def named(fleet: Fleet, name: str) -> Vehicle:
    """A vehicle of it."""
    return next(vehicle for vehicle in fleet.vehicles if vehicle.name == name)


def stated(vehicle: Vehicle, *facts: Said, now_s: float = 1.0) -> Block:
    """Block of facts stated by the vehicle."""
    return vehicle.beliefs.model.record([vehicle.beliefs.fact(*fact) for fact in facts], now_s).block


def say(vehicle: Vehicle, *facts: Said, now_s: float = 1.0) -> Block:
    """The vehicle makes facts known and takes note of them itself."""
    change = vehicle.beliefs.model.record([vehicle.beliefs.fact(*fact) for fact in facts], now_s)
    vehicle.social.consider([change])
    return change.block


def hear(vehicle: Vehicle, *blocks: Block) -> list[Ruling]:
    """Let the vehicle receive blocks; return the outcomes at the end of the round."""
    rulings = []
    for block in blocks:
        rulings += vehicle.social.consider(merge(vehicle.beliefs.model, [block]).changes).rulings
    return rulings + vehicle.social.consult().rulings


def miss(vehicle: Vehicle, *names: str) -> None:
    """Let a vehicle take these alone for absent."""
    vehicle.social._membership.absent = frozenset(names)
