"""Figures of runs and studies, and runs in the formats of other tools; importing this does not load matplotlib.

``visualisation.runs.draw`` draws a run, ``visualisation.sweeps.draw`` a sweep, ``visualisation.policies.write`` the
policy study; ``visualisation.exports.export`` writes a run for another tool.
"""

from visualisation.errors import DrawingError, ExportError, VisualisationError
from visualisation.files import FORMATS, Drawn
from visualisation.kinds import KINDS, SWEEP_KINDS

__all__ = ["FORMATS", "KINDS", "SWEEP_KINDS", "DrawingError", "Drawn", "ExportError", "VisualisationError"]
