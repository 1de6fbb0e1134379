"""The run of the REMORAS paper (section VII.B), and the causes of its milestones."""

import pytest

from missions.runs.run import Run, run
from missions.scenarios import Scenario, load
from remoras.executive.layer import ExecutiveLayer

PAPER_S = {
    ("consultation_done", ""): 7.1,
    ("mapping_done", "AUV02"): 1738.0,
    ("mapping_done", "AUV01"): 1774.0,
    ("mapping_stopped", "AUV00"): 1908.0,
    ("gathered", "Operational"): 2008.0,
    ("gathered", "Coordination"): 2036.0,
}
"""Times printed in section VII.B."""


def scenario(*settings: str) -> Scenario:
    options = [("--set", setting) for setting in ('channel.name="perfect"', *settings)]
    return load("mapping-rendezvous", options)


def times_s(finished: Run) -> dict[tuple[str, str], float]:
    return {(m.name, m.vehicle or m.group): m.time_s for m in finished.milestones}


@pytest.fixture(scope="module")
def paper_run() -> Run:
    return run(scenario())


def test_every_milestone_of_the_paper_is_met(paper_run: Run) -> None:
    """The consultation takes one TDMA frame, in which every vehicle has had its say."""
    measured = times_s(paper_run)
    consulted_s = measured.pop(("consultation_done", ""))
    assert consulted_s == paper_run.setup.schedule.frame_s
    assert round(consulted_s, 1) == PAPER_S["consultation_done", ""]
    for milestone, time_s in measured.items():
        if milestone[0] != "mission_complete":
            assert time_s == pytest.approx(PAPER_S[milestone], rel=0.02)
    assert len(measured) == len(PAPER_S)


def test_the_milestones_come_in_the_order_of_the_paper(paper_run: Run) -> None:
    order = [(m.name, m.vehicle or m.group) for m in paper_run.milestones if m.name != "mission_complete"]
    assert order == list(PAPER_S)


def test_after_consultation_the_vehicles_move(paper_run: Run) -> None:
    """Section VII.B: the MissionAdministrator goes to its rally point; AUV00 neglects its role of Tactician and goes
    to the central area, the wingers to theirs."""
    driving: dict[str, set[str]] = {}
    for time_s, vehicle, _, role, event in paper_run.recorder.roles:
        if time_s <= times_s(paper_run)["consultation_done", ""] and event in ("active", "inactive"):
            (set.add if event == "active" else set.discard)(driving.setdefault(vehicle, set()), role)
    assert driving == {
        "ASV00": {"MissionAdministrator"},
        "AUV00": {"Midfield", "Cartographer"},
        "AUV01": {"LeftWinger", "Cartographer"},
        "AUV02": {"RightWinger", "Cartographer"},
    }


def test_no_vehicle_holds_a_false_belief(paper_run: Run) -> None:
    assert paper_run.completed
    assert paper_run.n_false_beliefs == 0
    assert paper_run.recorder.faults == []


def test_without_influence_signals_auv00_finishes_its_area(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing but the signals is cut: assignments, observations and acknowledgements still flow."""
    monkeypatch.setattr(ExecutiveLayer, "signals", lambda layer: [])
    finished = run(scenario())
    measured = times_s(finished)
    assert ("mapping_stopped", "AUV00") not in measured
    assert PAPER_S["mapping_stopped", "AUV00"] < measured["mapping_done", "AUV00"] < measured["gathered", "Operational"]
    assert finished.completed


def test_faster_performers_make_auv00_give_up_earlier(paper_run: Run) -> None:
    faster = [
        f"vehicle.{name}.{speed}={1.1 * getattr(vehicle, speed)}"
        for name in ("AUV01", "AUV02")
        for vehicle in scenario().vehicle
        if vehicle.name == name
        for speed in ("transit_speed_mps", "survey_speed_mps")
    ]
    measured, usual = times_s(run(scenario(*faster))), times_s(paper_run)
    earlier_s = usual["mapping_done", "AUV01"] - measured["mapping_done", "AUV01"]
    assert earlier_s > 100.0
    gained_s = usual["mapping_stopped", "AUV00"] - measured["mapping_stopped", "AUV00"]
    assert gained_s == pytest.approx(earlier_s, rel=0.2)  # it gives up as long after their arrival as before


def test_without_weight_on_signals_auv00_never_gives_up() -> None:
    measured = times_s(run(scenario("decision.weight_external=0")))
    assert ("mapping_stopped", "AUV00") not in measured
    assert ("mapping_done", "AUV00") in measured


def test_auv00_has_about_85_m_left_when_it_gives_up(paper_run: Run) -> None:
    """Free parameters of the paper's geometry: last row, about 85 m left, about 280 m from the rally point."""
    stopped_s = times_s(paper_run)["mapping_stopped", "AUV00"]
    x_m, y_m = next(
        (row[2], row[3]) for row in paper_run.recorder.trajectories if row[1] == "AUV00" and row[0] >= stopped_s
    )
    assert y_m == pytest.approx(337.5, abs=2.0)
    assert x_m - 112.5 == pytest.approx(85.0, abs=25.0)
    assert ((450.0 - x_m) ** 2 + (450.0 - y_m) ** 2) ** 0.5 == pytest.approx(280.0, abs=20.0)


@pytest.mark.slow
def test_delivery_follows_the_loss_rate_and_beliefs_stay_true() -> None:
    """Two seeds: n received of N pairs has mean N(1-p) and variance N p (1-p), losses being independent."""
    per = 0.8
    for seed in (1, 2):
        finished = run(load("mapping-rendezvous", [("--per", f"channel.per={per}")]), seed)
        assert finished.completed or finished.reason
        assert finished.n_false_beliefs == 0
        received = sum(len(row[6]) for row in finished.recorder.packets)
        pairs = received + sum(len(row[7]) for row in finished.recorder.packets)
        standard_error = (per * (1.0 - per) / pairs) ** 0.5
        assert abs(received / pairs - (1.0 - per)) <= 4.0 * standard_error
