"""The command line: the roof, the one place that may import everything, and that nobody imports.

Commands register with the application; what they need is imported when they are called, so ``--help`` answers at once.
"""

from remoras.cli import (
    budgets,
    bursts,
    exports,
    files,
    live,
    networks,
    nodes,
    policies,
    replay,
    runs,
    stress,
    sweeps,
    verify,
)
from remoras.cli.app import app, main

__all__ = [
    "app",
    "budgets",
    "bursts",
    "exports",
    "files",
    "live",
    "main",
    "networks",
    "nodes",
    "policies",
    "replay",
    "runs",
    "stress",
    "sweeps",
    "verify",
]
