"""Fleets of autonomous marine vehicles: how they organise themselves, and what they know of each other.

>>> import remoras
>>> run = remoras.run("mapping-rendezvous", per=0.6, seed=3)  # doctest: +SKIP
>>> run.summary["mission_time_s"], run.table("roles"), run.plot("trajectories")  # doctest: +SKIP

``load`` and ``run`` take a scenario; ``open`` reads what was written; ``sweep`` makes the runs of a study, ``compare``
sets them side by side; ``exchange_study`` compares acknowledgement policies without a mission. The other names are the
seams: what one needs to add a mission, a strategy, a sensor, a metric or a figure. All is loaded when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from exchange.policies import AckPolicy
    from missions.figure import Figure, Layer, Mark, Place
    from missions.metric import Better, Metric
    from missions.scenarios import Scenario
    from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective
    from remoras.behaviours import Behaviour, Perception, Reference
    from remoras.errors import RemorasError
    from remoras.face import Run, Sweep, compare, exchange_study, load, open, run, sweep
    from remoras.mission import Finding, FleetView, Milestone, Mission, Truth, VehicleView
    from remoras.recorder import Column, Table
    from remoras.sensor import Observation, Pose, Sensor, SensorSettings
    from remoras.strategy import Declaration, Move, Negotiator, Situation, Statement, Strategy
    from remoras.work import Job, Outlook, Work

_HOMES = {
    "remoras.face": ("Run", "Sweep", "compare", "exchange_study", "load", "open", "run", "sweep"),
    "missions.scenarios": ("Scenario",),
    "missions.metric": ("Better", "Metric"),
    "missions.figure": ("Figure", "Layer", "Mark", "Place"),
    "exchange.policies": ("AckPolicy",),
    "remoras.activities": ("Activity", "ActivityKind", "ActivitySet", "ActivityType", "Objective"),
    "remoras.behaviours": ("Behaviour", "Perception", "Reference"),
    "remoras.errors": ("RemorasError",),
    "remoras.mission": ("Finding", "FleetView", "Milestone", "Mission", "Truth", "VehicleView"),
    "remoras.recorder": ("Column", "Table"),
    "remoras.sensor": ("Observation", "Pose", "Sensor", "SensorSettings"),
    "remoras.strategy": ("Declaration", "Move", "Negotiator", "Situation", "Statement", "Strategy"),
    "remoras.work": ("Job", "Outlook", "Work"),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [
    "AckPolicy", "Activity", "ActivityKind", "ActivitySet", "ActivityType", "Behaviour", "Better", "Column",
    "Declaration", "Figure", "Finding", "FleetView", "Job", "Layer", "Mark", "Metric", "Milestone", "Mission", "Move",
    "Negotiator", "Objective", "Observation", "Outlook", "Perception", "Place", "Pose", "Reference", "RemorasError",
    "Run", "Scenario", "Sensor", "SensorSettings", "Situation", "Statement", "Strategy", "Sweep", "Table", "Truth",
    "VehicleView", "Work", "compare", "exchange_study", "load", "open", "run", "sweep",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME_OF[name]), name)


def __dir__() -> list[str]:
    return [*globals(), *__all__]
