"""Figures of one run. Importing this package does not load matplotlib."""

from visualisation.runs.drawing import draw_run_figures, run_picture

__all__ = ["draw_run_figures", "run_picture"]
