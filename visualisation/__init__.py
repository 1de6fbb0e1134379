"""Figures of runs and studies, and runs in the formats of other tools; importing this does not load matplotlib.

``visualisation.runs.drawing.draw_run_figures`` draws a run, ``visualisation.sweeps.comparison.draw_sweep_figures`` a
sweep, ``visualisation.policies.write_figure`` the policy study; ``visualisation.exports.export`` writes a run for
another tool.
"""

from visualisation.output import FORMATS, KINDS, SWEEP_KINDS, DrawingError, Drawn, ExportError, VisualisationError

__all__ = ["FORMATS", "KINDS", "SWEEP_KINDS", "DrawingError", "Drawn", "ExportError", "VisualisationError"]
