"""The examples in the docstrings of plug-in interfaces run and conform."""

import doctest
import inspect
import math
import textwrap
from dataclasses import dataclass, field
from typing import Any, ClassVar

from pydantic import Field
from sample_vehicles import AUV

import missions.figure
import missions.meeting.job_mission
import remoras
import remoras.behaviours
import remoras.sensor
import remoras.strategy
import remoras.work
from missions.runs.run import run
from missions.scenarios import load
from remoras.organisation import Organisation
from remoras.recorder import TIME, VEHICLE, Column, Table
from remoras.strategies.initial_roles import common_roles, founded
from remoras.testing import behaviours as behaviour_conformance
from remoras.testing import sensors as sensor_conformance
from remoras.work import Outlook


def example_of(documented: Any) -> str:
    """The indented block behind ``::`` in a docstring, else its interactive example."""
    text = inspect.getdoc(documented) or ""
    if "::\n" not in text and (examples := doctest.DocTestParser().get_examples(text)):
        return "".join(example.source for example in examples)
    assert "::\n" in text, documented
    block: list[str] = []
    for line in text.split("::\n", 1)[1].splitlines():
        if line.strip() and not line.startswith("    "):
            break
        block.append(line)
    found = textwrap.dedent("\n".join(block)).strip()
    assert found, documented
    return found


def run_example(documented: Any, **names: Any) -> dict[str, Any]:
    """The names that an example makes, given those of the module that it stands in."""
    home = documented if inspect.ismodule(documented) else inspect.getmodule(documented)
    namespace: dict[str, Any] = {**vars(home), "__name__": "example", **names}
    exec(compile(example_of(documented), "example", "exec", flags=0, dont_inherit=True), namespace)
    return namespace


def test_the_example_job_can_be_assigned() -> None:
    """It is 40 m away, at 2 m/s, and takes its 60 s: done after 80 s."""
    visit = run_example(remoras.work.Job, math=math, dataclass=dataclass)["Visit"]("buoy", (40.0, 0.0))
    assert all(hasattr(visit, part) for part in ("name", "place_m", "needs", "done"))
    assert visit.is_able(AUV)
    assert visit.after(Outlook(0.0, (0.0, 0.0)), AUV) == Outlook(80.0, (40.0, 0.0))


def test_the_sensor_of_the_example_conforms() -> None:
    class Sea:
        def temperature_c(self, x_m: float, y_m: float) -> float:
            return 10.0 + x_m / 1000.0

    names = {"Field": Field, "Table": Table, "TIME": TIME, "VEHICLE": VEHICLE, "Column": Column}
    made = run_example(remoras.sensor, VehicleData=remoras.VehicleData, **names)
    assert sensor_conformance.check(made["ThermometerSettings"](), AUV, Sea()) > 0


def test_the_behaviour_of_the_example_conforms() -> None:
    circling = run_example(remoras.behaviours)["Circling"]
    behaviour_conformance.check(lambda: circling((10.0, 0.0), 25.0, AUV), AUV)


def test_the_strategy_of_the_example_founds_groups() -> None:
    class MyNegotiator:
        def __init__(self, me: str, group: Any) -> None:
            self.me = me

        def negotiate(self, situation: Any) -> Any:
            return remoras.Move()

    names = {"ClassVar": ClassVar, "founded": founded, "common_roles": common_roles, "dataclass": dataclass}
    made = run_example(remoras.strategy.Strategy, field=field, MyNegotiator=MyNegotiator, **names)
    mine = next(value() for name, value in made.items() if isinstance(value, type) and name == "Mine")
    assert not list(remoras.strategy.faults_of_strategy(mine))
    finished = run(load("mapping-rendezvous", [("--set", "scenario.duration_s=30")]), strategy=mine)
    assert isinstance(finished.setup.agreement.organisation, Organisation)


def test_the_figure_of_the_example_is_one() -> None:
    """It is drawn by the how-to of figures, which has the same text."""
    assert run_example(missions.figure)["SPEED"].needs == ("trajectories",)
