"""Figures of runs and studies, ready for a paper; importing this does not load matplotlib."""

from visualisation.errors import DrawingError, VisualisationError
from visualisation.kinds import FORMATS, KINDS, caption, draw

__all__ = ["FORMATS", "KINDS", "DrawingError", "VisualisationError", "caption", "draw"]
