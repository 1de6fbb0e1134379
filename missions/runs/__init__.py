"""Runs: a scenario set up, run, measured, written and read back. Each part is loaded when it is first used."""

from typing import TYPE_CHECKING

from exchange import lazily

if TYPE_CHECKING:
    from missions.runs.results import Results
    from missions.runs.run import Run
    from missions.runs.setup import Setup

__all__ = ["Results", "Run", "Setup"]
__getattr__ = lazily.loader(__name__, __file__)
