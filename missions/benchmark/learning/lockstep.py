"""Lockstep: a run in which all vehicles wait at the end of a TDMA frame for what each is to state.

A negotiator is asked and answers at once; who steps a run from outside gives all answers together. So the rounds of
consultation of a frame are all begun, and each waits in its negotiator; once the answers are there, each goes on where
it would have been asked. Until then no vehicle has stated anything in this frame, and none would have heard it before
its next slot: what vehicles know is the same as in a run that does not wait. Rows that a round has written are taken
out again until it goes on, so the tables are the same, too.

A round, and the run itself, waits as a *greenlet*: a function that may pause deep within its calls.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from typing import Any

from greenlet import getcurrent, greenlet

from missions.benchmark.learning.observing import Observer, Sight
from missions.benchmark.learning.policies import DECLARATION
from missions.runs.setup import Setup
from missions.runs.underway import Underway
from remoras.collecting import rare_collections
from remoras.errors import PluginError
from remoras.events import Joined, Part
from remoras.fleet import Fleet
from remoras.organisation import Group
from remoras.recorder import Row
from remoras.strategies.founding import common_roles, founded
from remoras.strategy import Move, Negotiator, Situation
from remoras.vehicle import Vehicle


class WaitingNegotiator:
    """One vehicle that states what it is told from outside.

    Args:
        me: name of the vehicle.
        group: whose jobs are divided.
        lockstep: of the run.
    """

    def __init__(self, me: str, group: Group, lockstep: Lockstep) -> None:
        self._observer = Observer(me, group)
        self._me = me
        self._lockstep = lockstep

    def negotiate(self, situation: Situation) -> Move:
        """What the action that came from outside states."""
        seen = self._observer.observation(situation)
        action = self._lockstep.wait(self._me, seen)
        return self._observer.move(action, seen["action_mask"], situation)


class WaitingStrategy:
    """The strategy of a run whose vehicles are told from outside what to state.

    Args:
        lockstep: of the run.
    """

    name = "learning"
    form = staticmethod(founded)
    adapt = staticmethod(common_roles)

    def __init__(self, lockstep: Lockstep) -> None:
        self._lockstep = lockstep
        part = Part(vehicle=partial(WaitingVehicle, lockstep), join=lockstep.join)
        self.declaration = replace(DECLARATION, part=part)

    def negotiator(self, me: str, group: Group) -> Negotiator | None:
        """What ``me`` states in ``group``.

        Raises:
            PluginError: it divides the jobs of another group, too.
        """
        if self._lockstep.groups.setdefault(me, group.name) != group.name:
            of = f"{self._lockstep.groups[me]} and {group.name}"
            raise PluginError(f"{me} divides the jobs of {of}; allowed to learn on: one group for each vehicle")
        return WaitingNegotiator(me, group, self._lockstep)


class WaitingVehicle(Vehicle):
    """A vehicle whose rounds of consultation wait for those of the others."""

    def __init__(self, lockstep: Lockstep, *given: Any) -> None:
        super().__init__(*given)
        self._lockstep = lockstep

    def consult(self, now_s: float) -> bool:
        """End of a TDMA frame, as that of any vehicle; it returns once the answers are there."""
        return self._lockstep.consult(self, now_s)

    def consult_by_itself(self, now_s: float) -> bool:
        """End of a TDMA frame, as soon as it is asked."""
        return super().consult(now_s)


class Lockstep:
    """Runs, one after another, each of which stands still at the ends of its TDMA frames.

    Attributes:
        strategy: to be named by their setups.
        groups: by vehicle that divides jobs, the group; asked: what each knows of those that wait for an action.
        fleet, underway: of the run.
    """

    def __init__(self) -> None:
        self.strategy = WaitingStrategy(self)
        self.groups: dict[str, str] = {}
        self.asked: dict[str, Sight] = {}
        self.fleet: Fleet
        self.underway: Underway
        self._actions: Mapping[str, object] = {}
        self._rounds: dict[str, greenlet] = {}
        self._ended: dict[str, bool] = {}
        self._new_rows: list[list[Row]] = []
        self._written: dict[str, list[tuple[list[Row], list[Row]]]] = {}
        self._collected_rarely = ExitStack()
        self._outside = getcurrent()
        self._run: greenlet | None = None

    def begin(self, setup: Setup, seed: int) -> None:
        """Begin a run and let it go on to where somebody is asked; of the run before the vehicles are let go.

        Args:
            setup: the scenario resolved, under the strategy of this.
            seed: root of its draws.

        Raises:
            PluginError: clocks are off, so they do not consult together.
        """
        self.close()
        self.groups = {}
        self.underway = Underway(setup, seed)
        if self.fleet.clocks:
            name = setup.scenario.scenario.name
            raise PluginError(f"{name}: vehicles do not consult together; allowed to learn on: no clocks")
        self._new_rows = [self.fleet.recorder.rows(name).new for name in self.fleet.recorder.tables]
        self._run = greenlet(self._go)
        self._collected_rarely.enter_context(rare_collections())
        self.go_on({})

    def go_on(self, actions: Mapping[str, object]) -> None:
        """Let the run go on to the next end of a frame at which somebody is asked, or to its end.

        Args:
            actions: of vehicles that wait, by name; who is missing states nothing.
        """
        assert self._run is not None
        self._actions, self._outside = actions, getcurrent()
        self.asked = {}
        self._run.switch()
        if not self.underway.is_running:
            self._collected_rarely.close()

    def close(self) -> None:
        """Let go of the vehicles of the run, if there is one."""
        self._collected_rarely.close()
        if self._run is None:
            return
        for waiting in (*self._rounds.values(), self._run):
            if waiting:
                waiting.throw()
        self._rounds, self._run, self.asked = {}, None, {}
        self.underway.close()

    def _go(self) -> None:
        while self.underway.is_running:
            self.underway.step()

    # Within the run ------------------------------------------------------------------------------

    def join(self, fleet: Joined) -> None:
        """Know the fleet of the run."""
        assert isinstance(fleet, Fleet)
        self.fleet = fleet

    def wait(self, vehicle: str, seen: Sight) -> object:
        """The action of a vehicle, once it is there; called within its round."""
        self.asked[vehicle] = seen
        parent = getcurrent().parent
        assert parent is not None
        parent.switch()
        return self._actions.get(vehicle, 0)

    def consult(self, vehicle: WaitingVehicle, now_s: float) -> bool:
        """The round of a vehicle; the first of a frame begins those of all and waits for the answers."""
        if not self._rounds:
            for other in self.fleet.vehicles:
                self._begin(other, now_s)
            if self.asked:
                self._outside.switch()
        round_ = self._rounds.pop(vehicle.name)
        for new, rows in self._written.pop(vehicle.name):
            new.extend(rows)
        return self._ended.pop(vehicle.name) if round_.dead else bool(round_.switch())

    def _begin(self, vehicle: Vehicle, now_s: float) -> None:
        """Begin the round of a vehicle, and take out what it has written until it waits, or is over."""
        assert isinstance(vehicle, WaitingVehicle)
        before = [len(new) for new in self._new_rows]
        round_ = self._rounds[vehicle.name] = greenlet(vehicle.consult_by_itself)
        self._ended[vehicle.name] = bool(round_.switch(now_s))
        written = self._written[vehicle.name] = []
        for new, n in zip(self._new_rows, before, strict=True):
            if len(new) > n:
                written.append((new, new[n:]))
                del new[n:]
