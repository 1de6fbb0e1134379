"""The seam of invariants: what must hold of a run, when it is looked at, and under which kinds of faults.

An invariant is a class without arguments; each run has an object of its own, which may keep what it has seen::

    class NobodyTurnsBack:
        \"\"\"No vehicle goes back to its start before the mission ends.\"\"\"

        name = "nobody-turns-back"
        moment = Moment.TICK
        not_under = frozenset({Danger.PRESENCE})

        def broken(self, scene: Scene) -> str | None:
            for vehicle in scene.fleet.vehicles:
                if ...:
                    return f"{vehicle.name} is back at {scene.now_s:g} s"
            return None

It sees everything and changes nothing. ``--invariant mine.py:NobodyTurnsBack`` adds it; a mission declares its own in
``invariants``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from typing import Any, NamedTuple, Protocol

from exchange.packets import Reception
from missions.runs.run import Run
from missions.runs.setup import Setup
from remoras.fleet import Fleet
from remoras.vehicle import Vehicle
from stress.lives import Aired, Life
from stress.schedule import Schedule
from stress.ways import NEARLY_CUT, Losses, losses_of, losses_there, packets_each, passes_on
from stress.witness import Flaw, Witness
from worldmodel import Change


class Moment(StrEnum):
    """When an invariant is looked at."""

    EVENT = "event"
    TICK = "tick"
    END = "end"


class Heard(NamedTuple):
    """A packet that a vehicle has heard: who, what was sent (None if it was forged or damaged), what came of it."""

    vehicle: Vehicle
    life: Life
    aired: Aired | None
    reception: Reception
    changes: tuple[Change, ...]
    own_s: float


@dataclass
class Scene:
    """What invariants see of a run.

    Attributes:
        setup: the scenario resolved; schedule: what befalls the fleet; fleet: as it is now.
        witness: what was recorded and given to whom.
        lives: present life of each vehicle, by name.
        effective: kinds of the schedule against which nothing in this scenario protects the fleet.
        forged: (vehicle, group or subject, what) of each act that a fault of the mind has forged.
        heard: of the moment EVENT: the packet.
        finished: of the moment END: the run; summary: its figures.
        rested: True if the exchange after the mission left nothing open; None where it did not go on.
    """

    setup: Setup
    schedule: Schedule
    fleet: Fleet
    witness: Witness
    lives: dict[str, Life]
    effective: frozenset[str]
    forged: list[tuple[str, str, str]] = field(default_factory=list)
    heard: Heard | None = None
    finished: Run | None = None
    summary: Mapping[str, Any] = field(default_factory=dict)
    rested: bool | None = None
    _judged: Heard | None = None
    _flaws: list[Flaw] | None = None

    @property
    def flaws(self) -> Sequence[Flaw]:
        """What is wrong with what came in with the packet; at the end with all that is in."""
        if self._judged is not self.heard or self._flaws is None:
            self._judged = self.heard
            if self.heard is None:
                self._flaws = [flaw for life in self.witness.all_alive() for flaw in self.witness.unfounded(life)]
            else:
                of, life = self.witness.flaw_of, self.heard.life
                self._flaws = [flaw for change in self.heard.changes if (flaw := of(life, change.block)) is not None]
        return self._flaws

    @property
    def now_s(self) -> float:
        """Time of the mission (s)."""
        return self.fleet.now_s

    @cached_property
    def is_selective(self) -> bool:
        """True if vehicles need not keep what all others know; features say so when vehicles are made."""
        of_its_own = any(vehicle.radio.noted for vehicle in self.fleet.vehicles)
        return of_its_own or self.setup.subjects is not None

    @property
    def is_silent(self) -> bool:
        """True if a strategy keeps somebody silent who could speak: the others wait for its word, as they should."""
        return any(vehicle.social.is_silent for vehicle in self.in_contact())

    @cached_property
    def has_cut_links(self) -> bool:
        """True if a link is nearly cut all the time: who told an item may never hear that it got through."""
        return max(self._losses_since.values(), default=0.0) >= NEARLY_CUT

    @cached_property
    def is_parted(self) -> bool:
        """True if news has no way between some of those in contact: all such ways have links that are nearly cut."""
        return self._has_no_way(self._losses_since)

    @cached_property
    def was_parted(self) -> bool:
        """True if that was so in the later half of the mission, in which those stand still who wait for others."""
        losses = self._losses_in(0.5 * self.fleet.ended_s, self.fleet.ended_s)
        return self._has_no_way(losses)

    @cached_property
    def _losses_since(self) -> Losses:
        """What each link loses after the mission."""
        return self._losses_in(self.fleet.ended_s, self.fleet.now_s)

    def _losses_in(self, from_s: float, until_s: float) -> Losses:
        """What each link loses all the time; on the channel acoustic in that time, where vehicles are in the end."""
        if losses := losses_of(self.setup.scenario):
            return losses
        motions = [vehicle.functional.motion for vehicle in self.fleet.vehicles]
        places_m = [(motion.x_m, motion.y_m) for motion in motions]
        return losses_there(self.setup.scenario, self.schedule.stress.seed, places_m, from_s, until_s)

    def _has_no_way(self, losses: Losses) -> bool:
        names = [vehicle.name for vehicle in self.in_contact()]
        return bool(losses) and math.isinf(packets_each(losses, passes_on(self.setup.scenario), names))

    def in_contact(self) -> list[Vehicle]:
        """Vehicles that are alive, hear and are heard."""
        fleet = self.fleet
        return [
            vehicle for vehicle, seen in zip(fleet.vehicles, fleet.view.vehicles, strict=True) if seen.is_in_contact
        ]


class Invariant(Protocol):
    """One thing that must hold."""

    @property
    def name(self) -> str:
        """By which it is called in tables."""

    @property
    def moment(self) -> Moment:
        """When it is looked at."""

    @property
    def not_under(self) -> frozenset[str]:
        """Kinds of faults under which it is not promised, unless something protects the packets."""

    def broken(self, scene: Scene) -> str | None:
        """What does not hold, in words; None if all is well."""
