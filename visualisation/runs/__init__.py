"""Figures of one run; importing this does not load matplotlib."""

from visualisation.runs.drawing import draw, picture

__all__ = ["draw", "picture"]
