"""Command line: the top layer; commands load on demand, and their dependencies within."""

from remoras.cli.app import app, main

__all__ = ["app", "main"]
