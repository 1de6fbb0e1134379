"""Notebook display of runs and scenarios, and a run stepped by its caller."""

from pathlib import Path

import pytest

import remoras
from missions.errors import ConfigurationError

SHORT = {"scenario": {"duration_s": 60.0}}
LONGEST = 400
"""Characters that a notebook shows of a value without a card."""

STUDY = """
[study]
name = "small"
scenario = "mapping-rendezvous"
policies = ["ack", "mps-ack"]
repeats = 1
[channel]
name = "bernoulli"
per = 0.4
[set]
scenario.duration_s = 20
"""


@pytest.fixture(scope="module")
def short() -> remoras.Run:
    return remoras.run("mapping-rendezvous", per=0.4, seed=3, set=SHORT)


def shown(value: object) -> str:
    """What a notebook shows: the card if there is one, else the text."""
    as_card = getattr(value, "_repr_html_", None)
    return as_card() if as_card else repr(value)


def test_every_value_of_a_notebook_is_short_or_a_card(short: remoras.Run, tmp_path: Path) -> None:
    study = tmp_path / "study.toml"
    study.write_text(STUDY, encoding="utf-8")
    swept = remoras.sweep(study, tmp_path / "swept")
    state = next(remoras.stepping("mapping-rendezvous", set=SHORT))
    values = [
        short, short.scenario, short.summary, short.milestones, short.table("roles"), short.known("AUV02", at_s=50.0),
        short.scenario.vehicle[0], short.scenario.channel, swept, swept.runs(), remoras.scenarios(),
    ]  # fmt: skip
    for value in values:
        assert hasattr(value, "_repr_html_"), value
        assert "<table" in shown(value)
    cards = [short, short.scenario, short.scenario.vehicle[0], swept, state, short.known("AUV02", at_s=50.0)]
    assert [repr(value) for value in cards if len(repr(value)) > LONGEST] == []
    for value in (short.scenario.vehicle, short.scenario.scenario.metrics, swept.status, short.tables):
        assert len(repr(value)) <= LONGEST


def test_settings_are_merged_and_accepted_as_text() -> None:
    whole = remoras.load("mapping-rendezvous", set={"mission": {"goal": 0.9}, "scenario.duration_s": 60.0})
    before = remoras.load("mapping-rendezvous")
    assert whole.mission.goal == 0.9  # type: ignore[attr-defined]
    assert whole.mission.patience_s == before.mission.patience_s  # type: ignore[attr-defined]
    for texts in ("scenario.duration_s=60", ["scenario.duration_s=60", "mission.goal=0.9"]):
        assert remoras.load("mapping-rendezvous", set=texts).scenario.duration_s == 60.0
    named = remoras.load("mapping-rendezvous", set={"vehicle": {"AUV01": {"energy_j": 5e5}}})
    assert [vehicle.energy_j for vehicle in named.vehicle if vehicle.name == "AUV01"] == [5e5]
    with pytest.raises(ConfigurationError, match=r"set \(mission.goal\) = 2: .*less than or equal to 1"):
        remoras.load("mapping-rendezvous", set={"mission": {"goal": 2}})
    with pytest.raises(ConfigurationError, match="KEY=VALUE"):
        remoras.load("mapping-rendezvous", set="scenario.duration_s")
    with pytest.raises(TypeError, match="set is 3; allowed: a table"):
        remoras.load("mapping-rendezvous", set=3)  # type: ignore[arg-type]


def test_a_stepped_run_equals_the_plain_run(short: remoras.Run) -> None:
    steps = remoras.stepping("mapping-rendezvous", per=0.4, seed=3, set=SHORT)
    assert isinstance(steps, remoras.Stepping)
    states = list(steps)
    tracks = short.table("trajectories")
    for state in states[:: len(states) // 5]:
        for name, now in state.vehicles.items():
            row = tracks[(tracks.vehicle == name) & (tracks.time_s == state.time_s)].iloc[0]
            assert (now.x_m, now.y_m) == pytest.approx((row.x_m, row.y_m), abs=1.0 / 128)
    assert [told.name for state in states for told in state.milestones] == [m["name"] for m in short.milestones]
    assert states[-1].time_s == short.summary["mission_time_s"]
    assert len(states[-1].vehicles["AUV00"].roles) == 4
    finished = steps.run()
    assert finished.summary == short.summary
    for name in short.tables:
        assert finished.table(name).equals(short.table(name)), name
    assert list(steps) == []
