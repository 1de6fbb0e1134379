"""Figures of runs and studies, and exports of runs. Importing this does not load matplotlib."""

from visualisation.output import FORMATS, KINDS, SWEEP_KINDS, DrawingError, Drawn, ExportError, VisualisationError

__all__ = ["FORMATS", "KINDS", "SWEEP_KINDS", "DrawingError", "Drawn", "ExportError", "VisualisationError"]
