"""The fleet of a suite as a PettingZoo environment."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pettingzoo.test import parallel_api_test, parallel_seed_test

from missions.benchmark.pettingzoo_environment import (
    AGAIN,
    JOB,
    LEAVE,
    MOST_JOBS,
    N_ACTIONS,
    OWN,
    TAKE,
    FleetEnv,
    Sight,
)
from missions.benchmark.suite import suite_named
from missions.errors import OutputError
from missions.runs.run import run_of
from missions.runs.setup import resolved
from missions.sweeps.plan import seed_of

ROOT = Path(__file__).resolve().parents[3]
SUITE = """
[suite]
name = "short"
grounds = ["mapping-patches"]
bound = "missions.mapping.rounds:rounds"
limit_s = 7200.0
repeats = 34

[set]
scenario.duration_s = {duration_s}

[[network]]
name = "alike"
set."channel.per" = {per}

[[unforeseen]]
name = "speeds"
set."uncertainty.speed_spread" = 0.3

[[unforeseen]]
name = "work found"
set."uncertainty.speed_spread" = 0.0
set."finds.number" = 4
"""
SPEEDS, FINDS = "mapping-patches, alike, speeds", "mapping-patches, alike, work found"


def env_of(folder: Path, duration_s: float = 200.0, per: float = 0.42) -> FleetEnv:
    path = folder / "short.toml"
    path.write_text(SUITE.format(duration_s=duration_s, per=per), encoding="utf-8")
    return FleetEnv(str(path))


def nearest(seen: Sight) -> int:
    """What the strategy of the how-to does, by observations: at its turn the vacant job that is done soonest."""
    own = dict(zip(OWN, seen["own"], strict=True))
    if own["round"] % own["n_members"] != own["place"] or own["n_held"]:
        return 0
    jobs = seen["jobs"]
    may_take = seen["action_mask"][TAKE : TAKE + MOST_JOBS] == 1
    vacant = np.flatnonzero(may_take & (jobs[:, JOB.index("n_others")] == 0))
    return TAKE + int(min(vacant, key=lambda row: jobs[row, JOB.index("done_after_s")])) if len(vacant) else 0


def run_through(env: FleetEnv, label: str, policy: Callable[[Sight], int], repeat: int = 0) -> None:
    seen, _ = env.reset(options={"cell": label, "repeat": repeat})
    while env.agents:
        seen, *_ = env.step({agent: policy(seen[agent]) for agent in env.agents})


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FleetEnv]:
    env = env_of(tmp_path_factory.mktemp("short"))
    yield env
    env.close()


def nearest_of_the_howto() -> Any:
    source = (ROOT / "remoras" / "cli" / "templates" / "nearest.py").read_text(encoding="utf-8")
    names: dict[str, Any] = {"__name__": "nearest"}
    exec(source, names)
    return names["NEAREST"]


@pytest.mark.slow
@pytest.mark.filterwarnings("error")
def test_pettingzoo_takes_it_for_a_parallel_environment(short: FleetEnv) -> None:
    parallel_api_test(short, num_cycles=60)


def test_the_same_seed_gives_the_same_run(tmp_path: Path) -> None:
    parallel_seed_test(lambda: env_of(tmp_path), num_cycles=60)


@pytest.mark.slow
@pytest.mark.parametrize(
    "label",
    [
        pytest.param("mapping-corridor, measured at sea, one lost"),
        pytest.param("mapping-patches, bursts, work found", marks=pytest.mark.thorough),
        *[pytest.param(f"{ground}, {network}, head lost", marks=pytest.mark.thorough)
          for ground in ("mapping-patches", "mapping-corridor")
          for network in ("alike", "measured at sea", "bursts", "slow modem")],
    ],
)  # fmt: skip
def test_an_example_gives_the_same_rows_through_the_environment_as_a_strategy(label: str) -> None:
    """In one frame, rows of vehicles that go on later come later."""
    env, suite = FleetEnv("fathom-1"), suite_named("fathom-1")
    run_through(env, label, nearest)
    assert env.fleet.completed
    number = [cell.label for cell in suite.cells].index(label)
    scenario = suite.study(("remoras",)).configurations[number].scenario
    one, other = run_of(resolved(scenario, nearest_of_the_howto()), seed_of(1, 0)).recorder, env.fleet.recorder
    assert one.tables == other.tables
    for name in one.tables:
        assert sorted(map(repr, one.rows(name))) == sorted(map(repr, other.rows(name)))


# What a vehicle cannot know -----------------------------------------------------------------------

BEFORE, AFTER = 25, 30
NEAR_M = 65.0  # the sonar reaches 60 m


class Told:
    """Who may know of a difference between two runs.

    Args:
        envs: of the two runs.
        told: who does at once.
        find: name of a find that one of them lacks.
    """

    def __init__(self, envs: tuple[FleetEnv, FleetEnv], told: set[str], find: str | None = None) -> None:
        self._envs, self.told, self._find = envs, told, find
        self._read = [len(env.fleet.recorder.packets) for env in envs]

    def look(self) -> None:
        """Who has heard somebody who knows, has come near to one, or to the find."""
        heard = sorted(
            (row[1], row[2], tuple(row[6]))
            for env, read in zip(self._envs, self._read, strict=True)
            for row in env.fleet.recorder.packets[read:]
        )
        self._read = [len(env.fleet.recorder.packets) for env in self._envs]
        for _, sender, receivers in heard:
            if sender in self.told:
                self.told |= set(receivers)
        for env in self._envs:
            vehicles = env.fleet.view.vehicles
            for one in vehicles:
                for other in vehicles:
                    is_as_deep = one.data.depth_m == other.data.depth_m
                    away_m = np.hypot(*np.subtract(one.position_m, other.position_m))
                    if one.name in self.told and is_as_deep and away_m < NEAR_M:
                        self.told.add(other.name)
                if self._find and env.fleet.named(one.name).beliefs.get(("foundAt", self._find)) is not None:
                    self.told.add(one.name)


def moved(env: FleetEnv) -> tuple[set[str], str | None]:
    """A vehicle is elsewhere."""
    env.fleet.named("AUV02").functional.motion.x_m += 30.0
    return {"AUV02"}, None


def lost(env: FleetEnv) -> tuple[set[str], str | None]:
    """A vehicle does not hear the next packet that arrives at it."""
    fleet = env.fleet
    deliver, fates = fleet.deliver, iter([True])

    def lossy(arrival: Any) -> None:
        if arrival.receiver != 2 or not next(fates, False):
            deliver(arrival)

    fleet.deliver = lossy  # type: ignore[method-assign]
    return {"AUV01"}, None


def unfound(env: FleetEnv) -> tuple[set[str], str | None]:
    """A find that nobody has come across is not there."""
    fleet = env.fleet
    features: dict[Any, Any] = fleet.truth._seabed.features  # type: ignore[attr-defined]
    known = [vehicle.beliefs for vehicle in fleet.vehicles]
    for at, feature in features.items():
        if all(beliefs.get(("foundAt", feature.name)) is None for beliefs in known):
            del features[at]
            return set(), feature.name
    return set(), None


def differences(folder: Path, label: str, change: Callable[[FleetEnv], Any], repeat: int) -> tuple[int, int, int]:
    """Two runs that differ by a change alone: observations compared of who was not told, those of them that differ,
    and those that differ of who was told."""
    envs = env_of(folder, 900.0, 0.97), env_of(folder, 900.0, 0.97)
    seen = [env.reset(options={"cell": label, "repeat": repeat})[0] for env in envs]
    told = Told(envs, set())
    n_compared = n_leaked = n_seen = 0
    for step in range(BEFORE + AFTER):
        if step == BEFORE:
            told = Told(envs, *change(envs[1]))
        seen = [
            env.step({agent: nearest(of[agent]) for agent in env.agents})[0] for env, of in zip(envs, seen, strict=True)
        ]
        if step < BEFORE:
            continue
        told.look()
        for agent in envs[0].agents:
            is_same = all(np.array_equal(seen[0][agent][key], seen[1][agent][key]) for key in seen[0][agent])
            n_compared += agent not in told.told
            n_leaked += agent not in told.told and not is_same
            n_seen += agent in told.told and not is_same
    for env in envs:
        env.close()
    return n_compared, n_leaked, n_seen


PAIRS = [(moved, SPEEDS), (lost, SPEEDS), (unfound, FINDS)]


@pytest.mark.slow
@pytest.mark.parametrize(
    "repeats", [pytest.param(range(1), id="few"), pytest.param(range(1, 34), id="many", marks=pytest.mark.thorough)]
)
def test_what_a_vehicle_cannot_know_changes_no_observation_until_it_is_told(tmp_path: Path, repeats: range) -> None:
    """In the many there are 99 pairs, of each kind some in which those who are told see the difference."""
    for change, label in PAIRS:
        found = [differences(tmp_path, label, change, repeat) for repeat in repeats]
        n_compared, n_leaked, n_seen = map(sum, zip(*found, strict=True))
        assert n_compared > 10 * len(repeats)
        assert n_leaked == 0, change.__name__
        assert n_seen > 0 or change is unfound or len(repeats) == 1


# Actions, truth, and what is missing --------------------------------------------------------------


def test_actions_take_say_again_and_leave_a_job_and_nobody_else_has_it(short: FleetEnv) -> None:
    seen, _ = short.reset(options={"cell": SPEEDS, "repeat": 0})
    own = JOB.index("own")
    while not seen["AUV01"]["action_mask"][TAKE]:
        seen, *_ = short.step({})
    seen, *_ = short.step({"AUV01": TAKE})
    seen, *_ = short.step({})
    assert seen["AUV01"]["jobs"][0, own] == 1
    assert (seen["AUV01"]["action_mask"][[TAKE, LEAVE, AGAIN]] == (0, 1, 1)).all()
    seen, _, _, _, infos = short.step({"AUV01": AGAIN})
    assert not infos["AUV01"]["refused"]
    seen, *_ = short.step({"AUV01": LEAVE})
    seen, *_ = short.step({})
    assert seen["AUV01"]["jobs"][0, own] == 0


def test_an_action_outside_its_mask_is_refused_and_has_no_effect(short: FleetEnv) -> None:
    def run(policy: Callable[[Sight], Any]) -> tuple[int, list[Any]]:
        seen, _ = short.reset(options={"cell": SPEEDS, "repeat": 0})
        n_refused = 0
        while short.agents:
            seen, _, _, _, infos = short.step({agent: policy(seen[agent]) for agent in short.agents})
            n_refused += sum(info["refused"] for info in infos.values())
        return n_refused, [list(short.fleet.recorder.rows(name)) for name in short.fleet.recorder.tables]

    silent = run(lambda seen: 0)
    assert silent[0] == 0
    for bad in (LEAVE, N_ACTIONS, -1, "take", 1.5, None):
        n_refused, tables = run(lambda seen, bad=bad: bad)  # type: ignore[misc]
        assert n_refused > 20
        assert tables == silent[1]


def now_s(env: FleetEnv) -> float:
    """Time of the last row of the trajectories (s)."""
    return float(env.fleet.recorder.trajectories[-1][0])


def test_rewards_add_up_to_the_time_in_which_the_goal_was_not_reached(short: FleetEnv) -> None:
    short.reset(options={"cell": SPEEDS, "repeat": 0})
    bound_s, lost_s, before_s, rewards = short.bound_s, 0.0, 0.0, []
    while short.agents:
        _, reward, *_ = short.step({})
        lost_s += (1.0 - short.fleet.truth.goal_fraction) * (now_s(short) - before_s)
        before_s = now_s(short)
        rewards.append(reward["AUV00"])
        assert len(set(reward.values())) == 1
    assert sum(rewards) == pytest.approx(-lost_s / bound_s)


@pytest.mark.parametrize(
    ("options", "named"), [({"cell": "nowhere"}, "cell = 'nowhere'"), ({"repeat": 34}, "repeat = 34")]
)
def test_a_case_that_is_none_is_named(short: FleetEnv, options: Mapping[str, Any], named: str) -> None:
    with pytest.raises(OutputError, match=f"{named}; allowed: "):
        short.reset(options=options)
