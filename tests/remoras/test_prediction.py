"""Prediction of peers: learned delays, and the coverage of intervals in missions."""

from dataclasses import dataclass
from typing import Any, ClassVar

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sampling import sampled

from missions.runs.run import run
from missions.scenarios import load
from remoras.beliefs import Key
from remoras.organisation import Group
from remoras.strategies.prediction import Delays, Forecast, StatedJob
from remoras.strategies.status_broadcast import Broadcaster, JobWatch, StatusBroadcast
from remoras.strategy import Heard, Move, Situation
from remoras.testing.sample_worlds import Visit
from remoras.work import Work, vehicles_taken

EXACT = 40
"""Reports after which fewer than a tenth of all delays, on each side, stem from the prior."""


def learned(delays_s: list[float], due_s: float = 600.0) -> Delays:
    """One that has learned these delays of jobs due after ``due_s``."""
    delays = Delays()
    for number, late_s in enumerate(delays_s):
        job = Visit(f"job {number}", (0.0, 0.0))
        delays.expect("AUV01", job, StatedJob(0.0, due_s, 0.0))
        attribute, subject = job.done
        delays.learn([Heard("AUV01", due_s + late_s, ((subject, attribute, True),))])
    return delays


def width_s(forecast: Forecast) -> float:
    return forecast.latest_s - forecast.earliest_s


@given(st.floats(10.0, 1e4), st.floats(0.0, 1e4))
def test_without_reports_the_interval_is_wide_and_exact_reports_make_it_narrow(length_s: float, age_s: float) -> None:
    stated = StatedJob(0.0, length_s, age_s)
    assert width_s(Delays().end(stated)) > 0.05 * length_s + age_s
    exact = learned([0.0] * EXACT).end(stated)
    assert exact == pytest.approx((length_s, length_s, length_s))


@given(st.floats(-500.0, 1e5), st.floats(1.0, 1e4), st.floats(0.0, 1e4))
def test_a_delay_stands_for_one_end(late_s: float, length_s: float, age_s: float) -> None:
    stated = StatedJob(0.0, length_s, age_s)
    assert stated.end_s(stated.delay(length_s + late_s)) == pytest.approx(length_s + late_s, abs=1e-6)


@given(st.lists(st.floats(-100.0, 1e4), max_size=30), st.floats(0.0, 1e3))
def test_times_are_in_order_and_older_statements_widen_the_interval(late_s: list[float], age_s: float) -> None:
    delays = learned(late_s)
    fresh, old = delays.end(StatedJob(0.0, 600.0, 0.0)), delays.end(StatedJob(0.0, 600.0, age_s))
    assert list(old) == sorted(old)
    assert width_s(old) >= width_s(fresh) - 1e-6


def test_a_report_by_another_vehicle_teaches_nothing() -> None:
    delays, job = Delays(), Visit("job", (0.0, 0.0))
    stated = StatedJob(0.0, 100.0, 0.0)
    delays.expect("AUV01", job, stated)
    attribute, subject = job.done
    delays.learn([Heard("AUV02", 900.0, ((subject, attribute, True),))])
    assert delays.end(stated) == Delays().end(stated)


FORECASTS: list[tuple[str, Key, Forecast]] = []
"""Of the run under way: vehicle, job, forecast of its end."""


class Forecaster(Broadcaster):
    """Vehicle that predicts the end of each job of which it hears, when it first does."""

    def __init__(self, me: str, group: Group, strategy: StatusBroadcast) -> None:
        super().__init__(me, group, strategy)
        self._delays, self._asked = Delays(), set[tuple[str, str]]()
        self._heard_s: dict[str, float] = {}

    def negotiate(self, situation: Situation) -> Move:
        self._delays.learn(situation.heard)
        self._heard_s = dict(situation.heard_s)
        return super().negotiate(situation)

    def _station(self, role: str, vehicle: str, since_s: float, work: Work) -> JobWatch:
        watch, declared = super()._station(role, vehicle, since_s, work), self._group.role(role)
        if vehicle != self._me and declared in work.roles and (vehicle, role) not in self._asked:
            self._asked.add((vehicle, role))
            stated = StatedJob(since_s, watch.due_s, self._heard_s[vehicle], vehicles_taken(work.job(declared)) > 1)
            FORECASTS.append((vehicle, work.job(declared).done, self._delays.end(stated)))
            self._delays.expect(vehicle, work.job(declared), stated)
        return watch


@dataclass(frozen=True, slots=True)
class Forecasting(StatusBroadcast):
    """``status-broadcast`` with forecasts, which change nothing."""

    name: ClassVar[str] = "forecasting"
    member: ClassVar[Any] = Forecaster


def covered(name: str, per: float, seeds: range) -> list[bool]:
    """Return for each forecast of a job that its vehicle ended whether its interval has that end."""
    hits: list[bool] = []
    for seed in seeds:
        FORECASTS.clear()
        scenario = load(name, [("--set", f"channel.per={per}")])
        items = run(scenario, seed, strategy=Forecasting()).recorder.items
        ends_s = {(row[1], (row[5], row[4])): row[3] for row in reversed(items)}
        ended = [(forecast, ends_s[vehicle, job]) for vehicle, job, forecast in FORECASTS if (vehicle, job) in ends_s]
        hits += [forecast.earliest_s <= end_s <= forecast.latest_s for forecast, end_s in ended]
    return hits


MAPPING, LIFTING = ("mapping-patches", range(601, 609)), ("recovery-field", range(701, 704))
"""Missions with seeds that the prior was not fitted on."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "seeds", "per"),
    sampled([(*MAPPING, 0.4), (*MAPPING, 0.8), (*MAPPING, 0.95), (*LIFTING, 0.4), (*LIFTING, 0.8)], (*LIFTING, 0.8)),
)
def test_four_of_five_ends_lie_in_their_interval(name: str, seeds: range, per: float) -> None:
    """Of 150 to 210 ends, whose hits are alike within a run: two standard errors are 0.1."""
    hits = covered(name, per, seeds)
    assert 0.7 <= sum(hits) / len(hits) <= 0.9
