"""Sweeps: all runs of a study, once each, however often they are interrupted.

>>> from missions.sweeps import load_study
>>> load_study("strategies-quick").n_runs
160

``sweep`` makes the runs of a study in a folder, ``SweepResults.read`` reads it. Each is loaded when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from missions.sweeps.driver import PartlyDoneError, sweep
    from missions.sweeps.folder import SweepResults, SweepStatus
    from missions.sweeps.study import Study, load_study

__all__ = ["PartlyDoneError", "Study", "SweepResults", "SweepStatus", "load_study", "sweep"]

_HOMES = {
    "PartlyDoneError": "driver",
    "Study": "study",
    "SweepResults": "folder",
    "SweepStatus": "folder",
    "load_study": "study",
    "sweep": "driver",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
