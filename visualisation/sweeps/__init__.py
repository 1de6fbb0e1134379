"""Figures of a sweep; importing this does not load matplotlib."""

from visualisation.sweeps.comparison import draw, picture

__all__ = ["draw", "picture"]
