"""Sweeps: ``sweep`` makes all runs of a study, each once, in a folder, ``SweepResults.read`` reads it.

>>> from missions.sweeps import load_study
>>> load_study("strategies-quick").n_runs
160
"""

from typing import TYPE_CHECKING

from exchange import lazily

if TYPE_CHECKING:
    from missions.sweeps.driver import PartlyDoneError, sweep
    from missions.sweeps.folder import SweepResults, SweepStatus
    from missions.sweeps.study import Study, load_study

__all__ = ["PartlyDoneError", "Study", "SweepResults", "SweepStatus", "load_study", "sweep"]
__getattr__ = lazily.loader(__name__, __file__)
