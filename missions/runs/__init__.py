"""Runs of a scenario: setup, execution, metrics, results. Modules load on first use."""

from typing import TYPE_CHECKING

from exchange import lazily

if TYPE_CHECKING:
    from missions.runs.results import Results
    from missions.runs.run import Run
    from missions.runs.setup import Setup

__all__ = ["Results", "Run", "Setup"]
__getattr__ = lazily.loader(__name__, __file__)
