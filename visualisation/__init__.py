"""Figures of runs and studies, ready for a paper; importing this does not load matplotlib.

``visualisation.runs.draw`` draws a run, ``visualisation.sweeps.draw`` a sweep, ``visualisation.policies.write`` the
policy study.
"""

from visualisation.errors import DrawingError, VisualisationError
from visualisation.files import FORMATS, Drawn
from visualisation.kinds import KINDS, SWEEP_KINDS

__all__ = ["FORMATS", "KINDS", "SWEEP_KINDS", "DrawingError", "Drawn", "VisualisationError"]
