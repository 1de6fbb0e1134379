"""Figures of one run; importing this does not load matplotlib."""

from visualisation.runs.drawing import Moment, draw, picture

__all__ = ["Moment", "draw", "picture"]
