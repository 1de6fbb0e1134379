"""A run that is watched and steered while it goes: the command, its server, and the run behind it."""

from remoras.cli.live.command import live

__all__ = ["live"]
