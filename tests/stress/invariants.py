"""The interface of invariants: conditions on a run, their moments, and kinds of faults under which they may fail."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations, permutations
from typing import Any, ClassVar, NamedTuple

import networkx as nx
from stress.reference_record import Incarnation, ReferenceRecord, SentPacket
from stress.schedules import NEARLY_CUT, Schedule

from exchange.packets import Reception
from missions.runs.run import Run
from missions.runs.setup import Setup
from remoras.fleet.fleet import Fleet
from remoras.fleet.vehicle import Vehicle
from worldmodel import Change

EVENT, TICK, END = "event", "tick", "end"


class Invariant:
    """One condition; each run has its own object, which may record observations and changes nothing.

    Attributes:
        name: of the invariant; moment: when it is checked.
        not_under: kinds of faults under which it is not promised, unless something protects the packets.
    """

    name: ClassVar[str]
    moment: ClassVar[str] = END
    not_under: ClassVar[frozenset[str]] = frozenset()

    def broken(self, scene: Scene) -> str | None:
        """Describe the violation; None if the condition holds."""
        return None


class Heard(NamedTuple):
    """A received packet; ``aired`` is None if it was forged or damaged."""

    vehicle: Vehicle
    life: Incarnation
    aired: SentPacket | None
    reception: Reception
    changes: tuple[Change, ...]
    own_s: float


@dataclass
class Scene:
    """A run as invariants see it.

    Attributes:
        effective: kinds of faults against which nothing in this scenario protects the fleet.
        forged: (vehicle, group or subject, kind) of each forged statement.
        carried: see ``FaultyChannel``; heard: the packet of a moment EVENT; finished, summary: the run of a moment END.
        rested: True if the exchange after the mission left nothing open; None where it did not go on.
    """

    setup: Setup
    schedule: Schedule
    fleet: Fleet
    effective: frozenset[str]
    carried: Sequence[tuple[float, int, frozenset[int]]] = ()
    reference: ReferenceRecord = field(default_factory=ReferenceRecord)
    lives: dict[str, Incarnation] = field(default_factory=dict)
    forged: list[tuple[str, str, str]] = field(default_factory=list)
    heard: Heard | None = None
    finished: Run | None = None
    summary: Mapping[str, Any] = field(default_factory=dict)
    rested: bool | None = None

    @property
    def now_s(self) -> float:
        """Time of the mission (s)."""
        return self.fleet.now_s

    @cached_property
    def is_selective(self) -> bool:
        """True if vehicles need not store all items; features declare this when vehicles are made."""
        of_its_own = any(vehicle.radio.needs is not None for vehicle in self.fleet.vehicles)
        return of_its_own or self.setup.subjects is not None

    @property
    def is_silent(self) -> bool:
        """True if the strategy keeps a vehicle silent that could send."""
        return any(vehicle.social.is_silent for vehicle in self.in_contact())

    @cached_property
    def has_cut_links(self) -> bool:
        """True if a link is nearly cut after the mission: a sender may never receive an acknowledgement."""
        return bool(self._cut(self.fleet.ended_s, self.fleet.now_s))

    @cached_property
    def is_parted(self) -> bool:
        """True if no usable path joins some vehicles in contact after the mission."""
        return self._has_no_way(self.fleet.ended_s, self.fleet.now_s)

    @cached_property
    def was_parted(self) -> bool:
        """True if that was so in the later half of the mission, in which waiting vehicles stand still."""
        return self._has_no_way(0.5 * self.fleet.ended_s, self.fleet.ended_s)

    def _cut(self, from_s: float, until_s: float) -> set[tuple[int, int]]:
        """Links between vehicles in contact that lost nearly all packets of a time."""
        sent = [one for one in self.carried if from_s <= one[0] <= until_s]
        found = set()
        for sender, receiver in permutations([vehicle.data.node for vehicle in self.in_contact()], 2):
            heard = [receiver in receivers for _, node, receivers in sent if node == sender]
            if sum(heard) < (1.0 - NEARLY_CUT) * len(heard):
                found.add((sender, receiver))
        return found

    def _has_no_way(self, from_s: float, until_s: float) -> bool:
        """True if nearly cut links separate vehicles even with relaying."""
        cut, communication = self._cut(from_s, until_s), self.setup.scenario.communication
        if not (self.setup.policy.repeat or bool(getattr(communication, "relaying", True))):
            return bool(cut)
        pairs = combinations(sorted(vehicle.data.node for vehicle in self.in_contact()), 2)
        graph = nx.Graph(pair for pair in pairs if cut.isdisjoint({pair, pair[::-1]}))
        return bool(cut) and not (len(graph) == len(self.in_contact()) and nx.is_connected(graph))

    def in_contact(self) -> list[Vehicle]:
        """Live vehicles with working receiver and transmitter."""
        pairs = zip(self.fleet.vehicles, self.fleet.view.vehicles, strict=True)
        return [vehicle for vehicle, seen in pairs if seen.is_in_contact]
