"""Figures of runs and studies, and exports of runs; importing this does not load matplotlib.

Entry points: ``runs.drawing.draw_run_figures``, ``sweeps.comparison.draw_sweep_figures``, ``policies.write_figure``,
``exports.export``.
"""

from visualisation.output import FORMATS, KINDS, SWEEP_KINDS, DrawingError, Drawn, ExportError, VisualisationError

__all__ = ["FORMATS", "KINDS", "SWEEP_KINDS", "DrawingError", "Drawn", "ExportError", "VisualisationError"]
