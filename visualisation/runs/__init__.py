"""Figures of one run. Importing this package does not load matplotlib."""

from visualisation.runs.drawing import ViewAt, draw_run_figures, run_picture

__all__ = ["ViewAt", "draw_run_figures", "run_picture"]
