"""Fleet of a benchmark suite as a PettingZoo ``ParallelEnv``: one agent per vehicle.

A step is one TDMA frame. All vehicles that divide jobs are queried together at its end: their consultation rounds
start, and each pauses as a *greenlet* where its negotiator is called. There is no reception in between, so pauses do
not change the run.

An observation depends on one ``Situation``: the knowledge of the vehicle itself. A row of ``jobs`` is a role with a
job, in the order of job names; a row of ``peers`` is another vehicle that can play such a role, in node order. Missing
rows and unknown jobs are 0. Action 0 sends nothing, ``TAKE + n`` takes the job of row n, ``LEAVE + n`` releases it,
``AGAIN + n`` repeats the claim to it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from greenlet import getcurrent, greenlet
from gymnasium import spaces
from pettingzoo import ParallelEnv

from exchange.channel.loss import EPISODES, uniform
from missions.benchmark.running import Bounds
from missions.benchmark.suite import suite_named
from missions.errors import OutputError
from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios.fleet import database_of
from missions.scenarios.organisation import groups_of
from missions.scenarios.parts import mission_class
from remoras.authority import Authority
from remoras.fleet.fleet import Fleet
from remoras.fleet.vehicle import Vehicle
from remoras.organisation import Group, RoleSpecification
from remoras.plugins import named_object
from remoras.strategies.initial_roles import common_roles, founded
from remoras.strategy import JOB_DONE, Declaration, Move, Situation, Statement
from remoras.work import Outlook, Point, share_left

MOST_JOBS, MOST_PEERS = 20, 7
TAKE, LEAVE, AGAIN = 1, 1 + MOST_JOBS, 1 + 2 * MOST_JOBS
N_ACTIONS = 1 + 3 * MOST_JOBS
OWN = (
    "x_m", "y_m", "transit_mps", "survey_mps", "energy_share", "n_held", "free_after_s", "now_s", "round", "place",
    "n_members", "is_head", "n_unfinished", "rally_x_m", "rally_y_m",
)  # fmt: skip
"""Features of the vehicle, in ``own``.

Position; nominal speeds; energy share, 1 if sufficient; number of held jobs, and time to finish them (s); time (s);
frame number; index among the members, and their number; True for the leader; number of jobs not known as done; rally
point relative to here, 0 without one.
"""
JOB = (
    "known", "done", "open", "own", "n_others", "room", "share_left", "x_m", "y_m", "done_after_s", "holder_age_s",
)  # fmt: skip
"""Features of each job, in ``jobs``.

Known; known as done; may start; held by this vehicle; number of other holders; has a vacancy; remaining share; place
relative to here; time to finish if taken next (s), 0 if not allowed; age of the last packet of another holder (s), 0
without one.
"""
PEER = (
    "known", "member", "word_age_s", "x_m", "y_m", "n_held", "job", "loss_from", "loss_to", "n_unheard", "call",
)  # fmt: skip
"""Features of each peer, in ``peers``.

Exists; known member of the group; age of its last packet (s), since the start without one; last known position relative
to here; number of held jobs, and row of the first, -1 without one; estimated loss from and to it; number of
unacknowledged assignments to it; its dissatisfaction.
"""
BOXES: dict[str, spaces.Box] = {
    "own": spaces.Box(-np.inf, np.inf, (len(OWN),), np.float64),
    "jobs": spaces.Box(-np.inf, np.inf, (MOST_JOBS, len(JOB)), np.float64),
    "peers": spaces.Box(-np.inf, np.inf, (MOST_PEERS, len(PEER)), np.float64),
    "action_mask": spaces.Box(0, 1, (N_ACTIONS,), np.int8),  # 1: valid by the beliefs of the vehicle
}
SPACE = spaces.Dict({**BOXES})
Sight: TypeAlias = "dict[str, npt.NDArray[Any]]"
Infos: TypeAlias = dict[str, dict[str, Any]]


class FleetEnv(ParallelEnv):  # type: ignore[misc]  # PettingZoo's classes have no types of ours
    """Fleet in runs of a suite (shipped name or TOML file) on the split ``dev``.

    An agent without a decision observes 0 and may take action 0 only. It terminates when its vehicle is permanently
    lost; all terminate when the mission completes and are truncated at the time limit. ``infos`` report a refused
    action and, at the end, ``completed`` and ``efficiency``.

    Attributes:
        fleet: of the current run.
        dividing: its vehicles that divide jobs.
        bound_s: lower bound of its mission time (s).
    """

    def __init__(self, name_or_path: str) -> None:
        self.suite = suite_named(name_or_path)
        self.metadata, self.render_mode = {"name": self.suite.about.name, "render_modes": []}, None
        self._configurations = self.suite.study(("remoras",)).configurations
        self._bounds = Bounds(named_object(self.suite.about.bound))
        self._seed = self._episode = 0
        self.fleet: Fleet
        self._run: greenlet | None = None
        self.agents: list[str] = []
        able = set[str]()
        for scenario in {e.source: e.scenario for e in self._configurations}.values():
            database = database_of(scenario, mission_class(scenario.scenario.mission))
            for group in groups_of(scenario):
                able |= {e.name for role in jobs_of(group) for e in database.able_to_play(group.name, role.name)}
        self.possible_agents = sorted(able)
        self.action_spaces = {agent: spaces.Discrete(N_ACTIONS) for agent in self.possible_agents}

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """Return the space, common to all agents."""
        return SPACE

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Return the action numbers; ``sample(mask=...)`` accepts ``action_mask`` of an observation."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[dict[str, Sight], Infos]:
        """Start a run of the suite, drawn by ``seed`` (None: next draw), or set by ``options`` ``cell``, ``repeat``.

        Raises OutputError for an unknown cell or repeat, or vehicles without common frames.
        """
        self.close()
        suite, labels = self.suite, [cell.label for cell in self.suite.cells]
        if seed is not None:
            self._seed, self._episode = seed, 0
        n = suite.about.repeats
        drawn = math.floor(len(labels) * n * uniform(self._seed, EPISODES, self._episode, 0, 1))
        self._episode += 1
        case = {"cell": labels[drawn // n], "repeat": drawn % n, **(options or {})}
        for key, allowed in ("cell", labels), ("repeat", range(n)):
            if case[key] not in allowed:
                raise OutputError(f"{key} = {case[key]!r}; allowed: {allowed[0]!r} to {allowed[-1]!r}")
        run_seed = suite.seed(case["repeat"])
        scenario = self._configurations[labels.index(case["cell"])].scenario.for_seed(run_seed)
        self.bound_s, self._now_s = self._bounds.bound_s(scenario, run_seed), 0.0
        self.dividing, self._rounds = set[str](), dict[str, greenlet]()
        self.fleet = assemble(resolved(scenario, _Strategy(self)), run_seed, vehicle=partial(_Vehicle, self))
        self._run = greenlet(self.fleet.run)
        if self.fleet.clocks:
            raise OutputError(f"{case['cell']}: vehicles decide at different times; allowed: no clocks")
        self._go_on({})
        self.agents = [agent for agent in self.possible_agents if agent in self.dividing]
        return self._observations(), {agent: {"refused": False} for agent in self.agents}

    def step(
        self, actions: Mapping[str, Any]
    ) -> tuple[dict[str, Sight], dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Apply the actions, 0 if missing, and run to the end of the next frame."""
        if not self.agents:
            return {}, {}, {}, {}, {}
        agents, fleet = self.agents, self.fleet
        taken = {agent: actions.get(agent, 0) for agent in agents}
        # Read before the frame, which replaces the observations.
        masks = {agent: seen["action_mask"] for agent, seen in self._observations().items()}
        allowed = {a: n for a, n in taken.items() if self.action_spaces[a].contains(n) and masks[a][n]}
        self._go_on(allowed)
        is_over, completed = not fleet.running, bool(fleet.completed)
        # The goal is judged at ticks, so the time of the last tick goes with it.
        now_s = fleet.ended_s if is_over else (fleet.n_ticks - 2) * fleet.tick_s
        reward = -(1.0 - fleet.truth.goal_fraction) * (now_s - self._now_s) / self.bound_s
        self._now_s = now_s
        infos: Infos = {agent: {"refused": agent not in allowed} for agent in agents}
        if is_over:
            time_s = fleet.ended_s if completed else self.suite.about.limit_s
            for info in infos.values():
                info |= {"completed": completed, "efficiency": self.bound_s / time_s}
        gone = {v.name for v in fleet.vehicles if v.condition.lost_for_good or v.functional.exhausted}
        seen = self._observations()
        terminated = {agent: (is_over and completed) or agent in gone for agent in agents}
        self.agents = [] if is_over else [agent for agent in agents if agent not in gone]
        truncated = dict.fromkeys(agents, is_over and not completed)
        return seen, dict.fromkeys(agents, reward), terminated, truncated, infos

    def close(self) -> None:
        """End the run and release its vehicles."""
        if self._run is not None:
            for waiting in (*self._rounds.values(), self._run):
                if waiting:
                    # A paused round would keep its vehicle alive; this unwinds it.
                    waiting.throw()
            self.fleet.close()
        self._run, self.agents = None, []

    def _observations(self) -> dict[str, Sight]:
        return {agent: self._asked.get(agent) or nothing_seen() for agent in self.agents}

    def _go_on(self, actions: Mapping[str, Any]) -> None:
        self._actions, self._asked, self._outside = actions, dict[str, Sight](), getcurrent()
        assert self._run is not None
        self._run.switch()

    def consult(self, vehicle: Vehicle, now_s: float) -> None:
        """Run a consultation; the first of a frame starts all rounds and waits for the actions."""
        if not self._rounds:
            for other in self.fleet.vehicles:
                self._rounds[other.name] = round_ = greenlet(partial(Vehicle.consult, other))
                round_.switch(now_s)
            if self._asked:
                self._outside.switch()
        if not (round_ := self._rounds.pop(vehicle.name)).dead:
            round_.switch()

    def negotiate(self, me: str, group: Group, situation: Situation) -> Move:
        """Wait for the action of a vehicle in its round, and return its statement."""
        self._asked[me] = observation(me, group, situation)
        run = getcurrent().parent
        assert run is not None
        run.switch()
        statements: tuple[Statement, ...] = ()
        if number := int(self._actions.get(me, 0)):
            path = group.path(jobs_of(group)[(number - TAKE) % MOST_JOBS].name)
            statements = (Statement(((me, "leftRole" if LEAVE <= number < AGAIN else "playsRole", path),)),)
        return Move(statements, holding=bool(situation.work.unfinished))


class _Vehicle(Vehicle):
    def __init__(self, env: FleetEnv, *args: Any) -> None:
        super().__init__(*args)
        self._env = env

    def consult(self, now_s: float) -> None:
        self._env.consult(self, now_s)


class _Strategy:
    name, form, adapt = "agents", staticmethod(founded), staticmethod(common_roles)

    def __init__(self, env: FleetEnv) -> None:
        messages = {"playsRole": "a job is taken", "leftRole": "a job is left", JOB_DONE: "a job is done"}
        self.declaration = Declaration("PettingZoo", messages, authorities=frozenset({Authority.TAKE}))
        self._env = env

    def negotiator(self, me: str, group: Group) -> _Negotiator:
        self._env.dividing.add(me)
        return _Negotiator(self._env, me, group)


class _Negotiator:
    def __init__(self, env: FleetEnv, me: str, group: Group) -> None:
        self.negotiate = partial(env.negotiate, me, group)


def jobs_of(group: Group) -> list[RoleSpecification]:
    """Return the roles with jobs of a group, one per row of ``jobs``."""
    return sorted((role for role in group.roles if role.job), key=lambda role: (role.job or "", role.name))


def nothing_seen() -> Sight:
    """Return the observation of a vehicle without a decision."""
    seen: Sight = {name: np.zeros_like(box.low) for name, box in BOXES.items()}
    seen["action_mask"][0] = 1
    return seen


def observation(me: str, group: Group, situation: Situation) -> Sight:
    """Return the knowledge of a vehicle about the jobs of its group, as arrays."""
    work, now_s, heard_s, seen = situation.work, situation.now_s, situation.heard_s, nothing_seen()
    data, position_m, roles, mask = work.database[me], work.position_m(me), jobs_of(group), seen["action_mask"]
    here, may_begin, held, n_unfinished = Outlook(now_s, position_m), {role.name for role in work.open}, [], 0
    able = {v.name for role in roles for v in work.database.able_to_play(group.name, role.name)}
    rows_of: dict[str, list[int]] = {name: [] for name in work.database if name in able and name != me}

    def away(of_m: Point) -> tuple[float, float]:
        return of_m[0] - position_m[0], of_m[1] - position_m[1]

    for row, role in enumerate(roles):
        job = work.jobs.get(role.job or "")
        if job is None:
            continue
        holders, is_done = work.holders(role), job.name in work.done
        others = [name for name in holders if name != me]
        is_own, has_room = len(others) < len(holders), role.maximum is None or len(holders) < role.maximum
        is_open = role.name in may_begin
        after = None
        if not is_done:
            n_unfinished += 1
            if is_own:
                held.append(role)
                # Only a held job can be released, or its claim repeated.
                mask[[LEAVE + row, AGAIN + row]] = 1
            elif is_open and has_room and work.able(data, role):
                mask[TAKE + row] = 1
                after = job.after(here, data)
            for name in rows_of.keys() & set(others):
                rows_of[name].append(row)
        seen["jobs"][row] = (
            1, is_done, is_open, is_own, len(others), has_room, 0 if is_done else share_left(job), *away(job.place_m),
            0 if after is None else after.free_s - now_s,
            0 if is_done or not others else now_s - max([heard_s.get(name, 0.0) for name in others]),
        )  # fmt: skip
    energy_j, members = work.energy_j.get(me), work.members
    seen["own"][:] = (
        *position_m, data.transit_speed_mps, data.survey_speed_mps, 1 if energy_j is None else energy_j / data.energy_j,
        len(held), work.after_all(here, data, held).free_s - now_s if held else 0, now_s, situation.round,
        members.index(me), len(members), me in work.heads, n_unfinished, *away(situation.rally_m or position_m),
    )  # fmt: skip
    for number, (name, rows) in enumerate(rows_of.items()):
        links = situation.links.get(name)
        seen["peers"][number] = (
            1, name in members, now_s - heard_s.get(name, 0.0), *away(work.position_m(name)), len(rows),
            rows[0] if rows else -1, 0 if links is None else links.incoming.p_reckoned,
            0 if links is None else links.outgoing.p_reckoned, len(situation.unheard.get(name, ())),
            situation.calls.get(name, 0.0),
        )  # fmt: skip
    return seen
