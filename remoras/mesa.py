"""Missions as models of Mesa: ``mesa.batch_run``, ``DataCollector`` and SolaraViz work on them.

>>> model = MissionModel("mapping-rendezvous", per=0.3, seed=2)
>>> model.step()
>>> model.time_s, [agent.pos for agent in model.agents]
(0.0, [(0.0, 0.0), (0.0, 0.0), (10.0, 0.0), (0.0, 10.0)])
"""

from __future__ import annotations

from pathlib import Path
from statistics import fmean
from typing import Any

from mesa import Agent, DataCollector, Model

from missions.scenarios import Scenario
from remoras.api import Run, Settings, stepping
from remoras.fleet.fleet import release
from remoras.stepped import VehicleNow
from remoras.strategy import Strategy

MODEL_REPORTERS = ("time_s", "goal_fraction", "completed", "n_alive", "belief_age_s")
AGENT_REPORTERS = ("name", "x_m", "y_m", "speed_mps", "is_alive", "roles", "belief_age_s")


class VehicleAgent(Agent):  # type: ignore[misc]  # Mesa is untyped
    """A vehicle as seen from outside.

    Attributes:
        pos: x east, y north (m).
        belief_age_s: mean age (s) of the newest positions of all others that it knows.
    """

    def __init__(self, model: MissionModel, name: str) -> None:
        super().__init__(model)
        self.name = name

    def show(self, now: VehicleNow, belief_age_s: float) -> None:
        """Take over the state after a tick."""
        self.pos = self.x_m, self.y_m = now.x_m, now.y_m
        self.speed_mps, self.is_alive = now.speed_mps, now.is_alive
        self.roles = ", ".join(now.roles)
        self.belief_age_s = belief_age_s

    def step(self) -> None:
        """Be ready for the next motion tick, in which all vehicles move at once."""
        self.model.ready(self)


class MissionModel(Model):  # type: ignore[misc]  # Mesa is untyped
    """A run of ``remoras.stepping``, whose arguments and errors it has; a step is a motion tick of the scenario.

    Vehicles move at once, in the tick that the step of the last agent starts. So ``agents.do("step")`` and
    ``agents.shuffle_do("step")`` in any order give the run of ``remoras.run``. ``rng`` is another name of ``seed``.
    """

    # As a named parameter, ``seed`` would be set to None by ``batch_run`` of Mesa 3.5, whatever the caller gives.
    def __init__(
        self,
        scenario: str | Path | Scenario = "mapping-rendezvous",
        strategy: str | Strategy | None = None,
        policy: str | None = None,
        channel: str | None = None,
        network: str | None = None,
        per: float | None = None,
        set: Settings | None = None,
        rng: int | None = None,
        **kwargs: Any,
    ) -> None:
        seed = kwargs.pop("seed", 1 if rng is None else rng)
        if kwargs or rng not in (None, seed):
            wrong = next(iter(kwargs), "rng")
            raise TypeError(f"{wrong} is {kwargs.get(wrong, rng)!r}; allowed: the arguments of remoras.stepping")
        self.stepping = stepping(
            scenario, strategy=strategy, policy=policy, channel=channel, network=network, per=per, seed=seed, set=set
        )
        super().__init__(rng=seed)
        self._ready: frozenset[str] = frozenset()
        for name in self.stepping.state.vehicles:
            VehicleAgent(self, name)
        release(self)
        self.datacollector = DataCollector({n: n for n in MODEL_REPORTERS}, {n: n for n in AGENT_REPORTERS})
        self._show()

    def step(self) -> None:
        """Let all agents step and collect data; nothing after the end."""
        if self.running:
            self.agents.shuffle_do("step")
            self.datacollector.collect(self)

    def ready(self, agent: VehicleAgent) -> None:
        """Start the next motion tick once all agents are ready."""
        self._ready |= {agent.name}
        if self.running and len(self._ready) == len(self.agents):
            self._ready = frozenset()
            next(self.stepping)
            self._show()

    def _show(self) -> None:
        state = self.stepping.state
        self.time_s, self.goal_fraction, self.completed = state.time_s, state.goal_fraction, state.completed
        self.running = not state.is_over
        for agent in self.agents:
            ages_s = self.stepping.position_ages_s(agent.name).values()
            agent.show(state.vehicles[agent.name], fmean(ages_s) if ages_s else 0.0)

    @property
    def n_alive(self) -> int:
        """Number of vehicles in operation."""
        return sum(agent.is_alive for agent in self.agents)

    @property
    def belief_age_s(self) -> float:
        """Mean ``belief_age_s`` of the vehicles in operation; 0 without any."""
        return fmean([agent.belief_age_s for agent in self.agents if agent.is_alive] or [0.0])

    def run(self) -> Run:
        """Run the remaining ticks and return the finished run."""
        return self.stepping.run()
