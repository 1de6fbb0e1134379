"""Fleet of a suite as a PettingZoo environment."""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pettingzoo.test import parallel_api_test
from short_suite import SHORT

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
from missions.runs.run import run
from missions.sweeps.plan import seed_of

ROOT = Path(__file__).resolve().parents[3]
SPEEDS = "half, alike, speeds"


def env_of(folder: Path, duration_s: float = 200.0, per: float = 0.42) -> FleetEnv:
    path = folder / "short.toml"
    path.write_text(SHORT.replace("40.0", f"{duration_s}").replace("0.42", f"{per}"), encoding="utf-8")
    return FleetEnv(str(path))


def nearest(seen: Sight) -> int:
    """Strategy of the how-to by observations: at its turn a vehicle takes the vacant job that it can finish first."""
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
def test_environment_passes_the_parallel_api_test_of_pettingzoo(short: FleetEnv) -> None:
    parallel_api_test(short, num_cycles=60)


@pytest.mark.slow
@pytest.mark.parametrize("label", ["none escorted, links measured, one lost"])
def test_an_example_gives_the_same_rows_through_the_environment_as_a_strategy(label: str) -> None:
    """In one frame, rows of vehicles that go on later come later."""
    env, suite = FleetEnv("fathom-2"), suite_named("fathom-2")
    run_through(env, label, nearest)
    assert env.fleet.completed
    number = [cell.label for cell in suite.cells].index(label)
    scenario = suite.study(("remoras",)).configurations[number].scenario
    one, other = run(scenario, seed_of(1, 0), strategy=nearest_of_the_howto()).recorder, env.fleet.recorder
    assert one.tables == other.tables
    for name in one.tables:
        assert sorted(map(repr, one.rows(name))) == sorted(map(repr, other.rows(name)))


# What a vehicle cannot know -----------------------------------------------------------------------

BEFORE, AFTER = 25, 30
NEAR_M = 65.0  # the sonar reaches 60 m


def told_of(env: FleetEnv, told: set[str], n_read: int) -> int:
    """Add vehicles that received from, or came near, one that knows of the difference; return the packets read."""
    packets = env.fleet.recorder.packets
    for row in packets[n_read:]:
        if row[2] in told:
            told |= set(row[6])
    vehicles = env.fleet.view.vehicles
    for one, other in itertools.permutations(vehicles, 2):
        is_as_deep = one.data.depth_m == other.data.depth_m
        if one.name in told and is_as_deep and math.dist(one.position_m, other.position_m) < NEAR_M:
            told.add(other.name)
    return len(packets)


@pytest.mark.slow
def test_observations_of_others_depend_on_received_packets_only(tmp_path: Path) -> None:
    n_compared, n_seen = 0, 0
    envs = env_of(tmp_path, 900.0, 0.97), env_of(tmp_path, 900.0, 0.97)
    seen = [env.reset(options={"cell": SPEEDS, "repeat": 0})[0] for env in envs]
    told, read = {"AUV02"}, [0, 0]
    for step in range(BEFORE + AFTER):
        if step == BEFORE:
            envs[1].fleet.named("AUV02").functional.motion.x_m += 30.0
            read = [len(env.fleet.recorder.packets) for env in envs]
        seen = [
            env.step({agent: nearest(of[agent]) for agent in env.agents})[0] for env, of in zip(envs, seen, strict=True)
        ]
        if step < BEFORE:
            continue
        read = [told_of(env, told, n_read) for env, n_read in zip(envs, read, strict=True)]
        for agent in envs[0].agents:
            is_same = all(np.array_equal(seen[0][agent][key], seen[1][agent][key]) for key in seen[0][agent])
            assert is_same or agent in told
            n_compared += agent not in told
            n_seen += not is_same
    assert n_compared > 10
    assert n_seen > 0


# Actions, truth, and what is missing --------------------------------------------------------------


def test_actions_take_repeat_and_leave_a_job_of_one_vehicle(short: FleetEnv) -> None:
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


def test_action_outside_its_mask_is_refused_without_effect(short: FleetEnv) -> None:
    def run(policy: Callable[[Sight], Any]) -> tuple[int, list[Any]]:
        seen, _ = short.reset(options={"cell": SPEEDS, "repeat": 0})
        n_refused = 0
        while short.agents:
            seen, _, _, _, infos = short.step({agent: policy(seen[agent]) for agent in short.agents})
            n_refused += sum(info["refused"] for info in infos.values())
        return n_refused, [list(short.fleet.recorder.rows(name)) for name in short.fleet.recorder.tables]

    silent = run(lambda seen: 0)
    assert silent[0] == 0
    for bad in (LEAVE, N_ACTIONS, None):
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
    ("options", "named"), [({"cell": "nowhere"}, "cell = 'nowhere'"), ({"repeat": 2}, "repeat = 2")]
)
def test_unknown_cell_or_repeat_is_refused_with_allowed_values(
    short: FleetEnv, options: Mapping[str, Any], named: str
) -> None:
    with pytest.raises(OutputError, match=f"{named}; allowed: "):
        short.reset(options=options)
