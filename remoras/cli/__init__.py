"""Command line: the top layer, which may import all packages and is imported by none.

Commands load on demand, and their dependencies within, so that each starts fast.
"""

from remoras.cli.app import app, main

__all__ = ["app", "main"]
