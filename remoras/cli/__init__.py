"""The command line: the roof, the one place that may import everything, and that nobody imports.

A command is loaded when it is called, and what it needs within it, so that each answers at once.
"""

from remoras.cli.app import app, main

__all__ = ["app", "main"]
