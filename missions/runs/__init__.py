"""Runs: a scenario set up, run, measured, written and read back. Each part is loaded when it is first used."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from missions.runs.results import Results
    from missions.runs.run import Run
    from missions.runs.setup import Setup

__all__ = ["Results", "Run", "Setup"]

_HOMES = {"Results": "results", "Run": "run", "Setup": "setup"}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
