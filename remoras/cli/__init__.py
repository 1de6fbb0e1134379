"""The command line: the roof, the one place that may import everything, and that nobody imports."""

from remoras.cli import policies, runs, sweeps  # noqa: F401 - their commands register with the application
from remoras.cli.app import app, main

__all__ = ["app", "main"]
