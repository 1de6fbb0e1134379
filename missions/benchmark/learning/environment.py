"""Environment: the fleet of a suite's runs as a PettingZoo ``ParallelEnv``, one step for each TDMA frame."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from pettingzoo import ParallelEnv

from exchange.acoustics.loss import EPISODES, uniform
from missions.benchmark.learning.lockstep import Lockstep
from missions.benchmark.learning.observing import (
    JOB,
    MOST_JOBS,
    MOST_PEERS,
    N_ACTIONS,
    OWN,
    PEER,
    Sight,
    action_of,
    unasked,
)
from missions.benchmark.running import Bounds
from missions.benchmark.suite import DEV, Suite
from missions.errors import OutputError
from missions.runs.setup import Setup, resolved
from missions.runs.underway import Underway
from missions.scenarios import Scenario
from missions.scenarios.parts import database_of, groups_of, mission_class
from remoras.plugins import named_object

TRUTH = ("x_m", "y_m", "speed_mps", "used_j", "is_alive")
"""What ``state`` says of each vehicle, behind the time and the share of the goal that is reached."""


class FleetEnv(ParallelEnv):  # type: ignore[misc]  # PettingZoo's classes have no types of ours
    """The fleet of a suite's runs.

    An agent is a vehicle that divides jobs. A step is the end of a TDMA frame, at which all of them are asked what to
    state. Where one has nothing to decide, its observation is all 0 and allows action 0 alone. An agent is terminated
    once its vehicle is lost for good, and all are once the mission is complete; they are truncated once its time is
    over. ``infos`` say whether the action of the step was refused, and at the end ``completed`` and ``efficiency``.

    Args:
        suite: with the cells of one of its splits.

    Attributes:
        bound_s: time that nobody beats in the run (s); lockstep: what steps it.
    """

    def __init__(self, suite: Suite) -> None:
        about = suite.about
        self.suite = suite
        self.metadata = {"name": about.name, "render_modes": []}
        self.render_mode = None
        self._study = suite.study(("remoras",))
        self._bounds = Bounds(named_object(about.bound))
        self.lockstep = Lockstep()
        self._setup_of = cache(self._resolved)
        able = set[str]()
        for scenario in {of.source: of.scenario for of in self._study.configurations}.values():
            database = database_of(scenario, mission_class(scenario.scenario.mission))
            for group in groups_of(scenario):
                for role in group.roles:
                    able |= {data.name for data in database.able_to_play(group.name, role.name) if role.job}
        self.possible_agents = sorted(able)
        self.agents: list[str] = []
        self._seed = self._episode = 0
        space = spaces.Dict(
            {
                "own": spaces.Box(-np.inf, np.inf, (len(OWN),), np.float64),
                "jobs": spaces.Box(-np.inf, np.inf, (MOST_JOBS, len(JOB)), np.float64),
                "peers": spaces.Box(-np.inf, np.inf, (MOST_PEERS, len(PEER)), np.float64),
                "action_mask": spaces.Box(0, 1, (N_ACTIONS,), np.int8),
            }
        )
        n_state = 2 + len(TRUTH) * max(len(of.scenario.vehicle) for of in self._study.configurations)
        self.state_space = spaces.Box(-np.inf, np.inf, (n_state,), np.float64)
        self.observation_spaces = dict.fromkeys(self.possible_agents, space)
        self.action_spaces = {agent: spaces.Discrete(N_ACTIONS) for agent in self.possible_agents}

    @property
    def underway(self) -> Underway:
        """The run: its tables, its goal, and once it is over the finished run."""
        return self.lockstep.underway

    def scenario_of(self, label: str) -> Scenario:
        """The scenario of a cell, under a shipped strategy."""
        return self._study.configurations[[cell.label for cell in self.suite.cells].index(label)].scenario

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """Arrays of ``missions.benchmark.learning.observing``, the same for all agents."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Numbers of actions; ``sample(mask=...)`` takes the ``action_mask`` of an observation."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[dict[str, Sight], dict[str, dict[str, Any]]]:
        """Begin a run of the suite.

        Args:
            seed: of the draws of cells and repeats; without it the next draw.
            options: ``cell``, the name of a cell, and ``repeat``, the number of one, instead of a draw.

        Raises:
            OutputError: there is no such cell or repeat.
        """
        if seed is not None:
            self._seed, self._episode = seed, 0
        cell, repeat = self._drawn(options or {})
        self._episode += 1
        number, _ = self.suite.place(cell, repeat, 0, 1)
        configuration = self._study.configurations[number]
        run_seed = self.suite.seed(repeat)
        self.bound_s = self._bounds.bound_s(number, configuration.scenario, run_seed)
        self.lockstep.begin(self._setup_of(number), run_seed)
        self._now_s = 0.0
        self.agents = [agent for agent in self.possible_agents if agent in self.lockstep.groups]
        self._seen = self._observations()
        return dict(self._seen), {agent: {"refused": False} for agent in self.agents}

    def step(
        self, actions: Mapping[str, Any]
    ) -> tuple[dict[str, Sight], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Let the agents state what their actions say, and the run go on to the end of the next TDMA frame.

        Args:
            actions: by agent; who is missing states nothing.

        Returns:
            Observations, rewards, whether each agent is terminated, or truncated, and what is said beside.
        """
        if not self.agents:
            return {}, {}, {}, {}, {}
        agents, lockstep = self.agents, self.lockstep
        infos: dict[str, dict[str, Any]] = {
            agent: {"refused": action_of(actions.get(agent, 0), self._seen[agent]["action_mask"]) is None}
            for agent in agents
        }
        lockstep.go_on(actions)
        underway = lockstep.underway
        dt_s, self._now_s = underway.now_s - self._now_s, underway.now_s
        reward = -(1.0 - underway.goal_fraction) * dt_s / self.bound_s if self.suite.split == DEV else 0.0
        is_over, completed = not underway.is_running, lockstep.fleet.completed
        lost = {vehicle.name for vehicle in lockstep.fleet.vehicles if vehicle.condition.lost_for_good}
        lost |= {vehicle.name for vehicle in lockstep.fleet.vehicles if vehicle.functional.exhausted}
        if is_over:
            time_s = lockstep.fleet.ended_s if completed else self.suite.about.limit_s
            for info in infos.values():
                info.update(completed=completed, efficiency=self.bound_s / time_s)
        self._seen = self._observations()
        terminated = {agent: (is_over and completed) or agent in lost for agent in agents}
        truncated = dict.fromkeys(agents, is_over and not completed)
        self.agents = [agent for agent in agents if not (terminated[agent] or truncated[agent])]
        return dict(self._seen), dict.fromkeys(agents, reward), terminated, truncated, infos

    def state(self) -> npt.NDArray[np.float64]:
        """The truth, for training: time, share of the goal, and ``TRUTH`` of each vehicle in the order of the nodes.

        Raises:
            OutputError: the split is one to be judged by.
        """
        if self.suite.split != DEV:
            raise OutputError(f"state() of split {self.suite.split}: it has the truth; allowed: split {DEV}")
        underway = self.lockstep.underway
        found = np.zeros(self.state_space.shape)
        rows = [
            value
            for vehicle in self.lockstep.fleet.vehicles
            for value in (
                *vehicle.functional.motion.position_m, vehicle.functional.motion.speed_mps,
                vehicle.functional.motion.energy_j, vehicle.is_alive,
            )
        ]  # fmt: skip
        found[: 2 + len(rows)] = [underway.now_s, underway.goal_fraction, *rows]
        return found

    def close(self) -> None:
        """Let go of the run."""
        self.lockstep.close()
        self.agents = []

    def _resolved(self, number: int) -> Setup:
        return resolved(self._study.configurations[number].scenario, self.lockstep.strategy)

    def _observations(self) -> dict[str, Sight]:
        asked = self.lockstep.asked
        return {agent: asked.get(agent) or unasked() for agent in self.agents}

    def _drawn(self, options: Mapping[str, Any]) -> tuple[int, int]:
        """Number of a cell and of a repeat."""
        suite, labels = self.suite, [cell.label for cell in self.suite.cells]
        n = len(labels) * suite.repeats
        cell, repeat = divmod(math.floor(n * uniform(self._seed, EPISODES, self._episode, 0, 1)), suite.repeats)
        if (named := options.get("cell")) is not None:
            if named not in labels:
                raise OutputError(f"cell = {named!r}; allowed: one of {suite.about.name}, such as {labels[0]!r}")
            cell = labels.index(named)
        if (number := options.get("repeat")) is not None:
            if number not in range(suite.repeats):
                raise OutputError(f"repeat = {number!r}; allowed: 0 to {suite.repeats - 1}")
            repeat = int(number)
        return cell, repeat
