"""Fleets of autonomous marine vehicles: organisation, and knowledge of each other.

>>> import remoras
>>> run = remoras.run("mapping-rendezvous", per=0.6, seed=3)  # doctest: +SKIP
>>> run.summary["mission_time_s"], run.table("roles"), run.plot("trajectories")  # doctest: +SKIP

``scenarios``, ``policies`` and ``metrics`` list the shipped ones, ``remoras.strategies.titles`` the strategies;
``load``, ``run`` and ``stepping`` take a scenario; ``open`` reads results;
``sweep`` makes the runs of a study, ``compare`` compares them; ``exchange_study`` compares acknowledgement policies
without a mission; ``network`` returns a measured network as a graph. The other names are plug-in interfaces: missions,
strategies, sensors, faults, metrics and figures. Every name is imported at its first use.
"""

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from remoras.version import __version__ as __version__

if TYPE_CHECKING:
    from exchange.policy.policies import AckPolicy
    from missions.fault import Absence
    from missions.figure import Figure, Layer, Mark, Place
    from missions.meeting import JobMission, JobScenario, JobSettings, JobTruth, Meeting, MeetingTruth
    from missions.metric import Better, Metric
    from missions.scenarios import Scenario
    from missions.scenarios.faults import DeclaredFault
    from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective
    from remoras.api import (
        Run,
        Sweep,
        compare,
        exchange_study,
        load,
        metrics,
        network,
        open,
        policies,
        run,
        scenarios,
        stepping,
        sweep,
    )
    from remoras.behaviours import (
        ADVANCING,
        DONE,
        DUE,
        IDLE,
        Approach,
        Behaviour,
        Perception,
        Reference,
        attracted,
        distance_m,
    )
    from remoras.beliefs import Known
    from remoras.condition import Condition
    from remoras.database import VehicleData
    from remoras.errors import RemorasError
    from remoras.mission import Finding, FleetView, Milestone, Mission, Truth, VehicleView
    from remoras.motion import Motion
    from remoras.organisation import Group
    from remoras.picture import Picture
    from remoras.recorder import TIME, VEHICLE, Column, Recorder, Table
    from remoras.sensor import SELF, Observation, Pose, Quiet, Sensor, SensorSettings
    from remoras.stepped import MissionState, Stepping
    from remoras.strategy import Declaration, Move, Negotiator, Situation, Statement, Strategy
    from remoras.work import DivisibleJob, Job, Outlook, Work

for _package in ("worldmodel", "exchange", "missions", "visualisation"):
    _found = find_spec(_package)
    if _found is not None and Path(_found.origin or "").parents[1:2] != Path(__file__).parents[1:2]:
        _other = _found.origin or next(iter(_found.submodule_search_locations or ()))
        raise ImportError(f"{_other} hides the simulator's package {_package!r}: give it another name")
__all__ = [
    "ADVANCING", "DONE", "DUE", "IDLE", "SELF", "TIME", "VEHICLE", "Absence", "AckPolicy", "Activity", "ActivityKind",
    "ActivitySet", "ActivityType", "Approach", "Behaviour", "Better", "Column", "Condition", "Declaration",
    "DeclaredFault", "DivisibleJob", "Figure", "Finding", "FleetView", "Group", "Job", "JobMission", "JobScenario",
    "JobSettings", "JobTruth", "Known", "Layer", "Mark", "Meeting", "MeetingTruth", "Metric", "Milestone", "Mission",
    "MissionState", "Motion", "Move", "Negotiator", "Objective", "Observation", "Outlook", "Perception", "Picture",
    "Place", "Pose", "Quiet", "Recorder", "Reference", "RemorasError", "Run", "Scenario", "Sensor", "SensorSettings",
    "Situation", "Statement", "Stepping", "Strategy", "Sweep", "Table", "Truth", "VehicleData", "VehicleView", "Work",
    "attracted", "compare", "distance_m", "exchange_study", "load", "metrics", "network", "open", "policies", "run",
    "scenarios", "stepping", "sweep",
]  # fmt: skip


from exchange import lazily  # noqa: E402  # of ours, as was just made sure

__getattr__ = lazily.loader(__name__, __file__)


def __dir__() -> list[str]:
    return sorted({*__all__, *(name for name in globals() if name.startswith("__") and name.endswith("__"))})
