"""Figures of runs and studies, ready for a paper; importing this does not load matplotlib."""

from visualisation.errors import DrawingError, VisualisationError
from visualisation.files import FORMATS, Drawn
from visualisation.kinds import KINDS, draw, picture

__all__ = ["FORMATS", "KINDS", "DrawingError", "Drawn", "VisualisationError", "draw", "picture"]
