"""Missions as Mesa models: the run of ``remoras.run`` in any order of the agents, batch runs, the browser page."""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import mesa
import pytest
from browsing import PATIENCE_MS, browser
from hypothesis import given, settings
from hypothesis import strategies as st

import remoras
from remoras.mesa import MissionModel

ROOT = Path(__file__).parents[2]
SET = {"scenario.duration_s": 20.0}
APP = ROOT / "docs" / "examples" / "solara_app.py"


@pytest.fixture(scope="module")
def usual() -> remoras.Run:
    return remoras.run("mapping-rendezvous", per=0.3, seed=2, set=SET)


def made() -> MissionModel:
    return MissionModel("mapping-rendezvous", per=0.3, seed=2, set=SET)


def is_as_usual(model: MissionModel, usual: remoras.Run) -> bool:
    run = model.run()
    return all(run.table(name).equals(usual.table(name)) for name in usual.tables)


STEPS: dict[str, Callable[[MissionModel], object]] = {
    "model": lambda model: model.step(),
    "shuffled": lambda model: model.agents.shuffle_do("step"),
    "in order": lambda model: model.agents.do("step"),
}


@pytest.mark.parametrize("how", STEPS)
def test_steps_of_the_model_or_its_agents_give_the_run(how: str, usual: remoras.Run) -> None:
    model, n = made(), 0
    while model.running:
        STEPS[how](model)
        n += 1
    assert n == 21  # ticks of 1 s from 0 to 20 s
    assert is_as_usual(model, usual)
    STEPS[how](model)  # nothing after the end
    assert model.time_s == 20.0


@settings(max_examples=5, deadline=None)
@given(st.permutations(range(4)))
def test_no_vehicle_moves_before_all_are_ready(order: list[int]) -> None:
    model = made()
    agents = list(model.agents)
    for number in order[:-1]:
        agents[number].step()
        agents[number].step()  # ready already
    assert model.time_s == 0.0
    model.step()
    agents[order[0]].step()
    before = [agent.pos for agent in agents]
    for _ in range(10):
        model.step()
    assert [agent.pos for agent in agents] != before


def test_collected_data_are_those_of_the_tables(usual: remoras.Run) -> None:
    model = made()
    while model.running:
        model.step()
    frame = model.datacollector.get_model_vars_dataframe()
    assert frame["time_s"].tolist() == [float(at) for at in range(21)]
    assert frame["completed"].tolist()[-1] is usual.completed
    tracks = usual.table("trajectories")
    last = tracks[tracks.time_s == 20.0].set_index("vehicle")
    for agent in model.agents:
        assert agent.pos == pytest.approx((last.x_m[agent.name], last.y_m[agent.name]), abs=1 / 128)
    # The mean over pairs: a model of perfect knowledge has no age, one without packets the age of the mission.
    deaf = MissionModel(per=0.999, seed=1, set=SET)
    while deaf.running:
        deaf.step()
    assert deaf.belief_age_s == pytest.approx(20.0, abs=2.0)
    assert frame["belief_age_s"].iloc[-1] < deaf.belief_age_s


@pytest.mark.skipif(not hasattr(mesa, "batch_run"), reason="Mesa 4 has no batch_run")
def test_batch_run_takes_seeds_and_keys() -> None:
    parameters = {"per": [0.1, 0.5], "seed": [1, 2], "set": "scenario.duration_s=30"}
    rows = mesa.batch_run(MissionModel, parameters, display_progress=False)
    seen = {(row["per"], row["seed"], row["name"]): row["x_m"] for row in rows}
    assert len(rows) == len(seen) == 2 * 2 * 4
    assert len({seen[0.5, seed, "AUV01"] for seed in (1, 2)}) == 2
    assert {row["time_s"] for row in rows} == {30.0}


def test_wrong_arguments_are_refused_by_name() -> None:
    with pytest.raises(TypeError, match="sed is 1; allowed"):
        MissionModel(sed=1)
    with pytest.raises(TypeError, match="rng is 3; allowed"):
        MissionModel(seed=1, rng=3)
    assert MissionModel(rng=3, set=SET).run().seed == 3


@pytest.fixture
def page() -> Iterator[str]:
    """Address of the served example."""
    pytest.importorskip("solara")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    # In production it does not watch files, for which a busy machine may lack handles.
    command = [sys.executable, "-m", "solara", "run", APP.name, "--port", str(port), "--no-open", "--production"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(command, cwd=APP.parent, env=environment, stdout=subprocess.DEVNULL, stderr=-3) as server:
        try:
            for _ in range(900):
                assert server.poll() is None, "the page is not served"
                with socket.socket() as asked:
                    if asked.connect_ex(("127.0.0.1", port)) == 0:
                        break
                time.sleep(0.2)
            yield f"http://127.0.0.1:{port}/"
        finally:
            server.terminate()


@pytest.mark.slow
@pytest.mark.parametrize("width", [1280, 390])
def test_the_page_shows_and_steps_a_mission(page: str, width: int) -> None:
    with browser() as opened:
        window = opened.new_page(viewport={"width": width, "height": 1000})
        window.goto(page, timeout=PATIENCE_MS)
        window.locator("img").first.wait_for(timeout=PATIENCE_MS)
        assert window.evaluate("document.body.scrollWidth") <= width
        if width < 500:  # the controls are behind the menu
            return
        for label in ("loss", "strategy", "seed"):
            assert window.get_by_text(label, exact=True).count() >= 1
        told = "document.body.innerText.split('Information')[1]"  # the time, in Mesa 3.3 the step
        before = window.evaluate(told)
        window.get_by_role("button", name="Step").click()
        window.wait_for_function(f"before => {told} != before", arg=before, timeout=PATIENCE_MS)
