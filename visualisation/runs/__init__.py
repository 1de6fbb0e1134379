"""Figures of one run; importing this does not load matplotlib."""

from visualisation.runs.drawing import ViewAt, draw_run_figures, run_picture

__all__ = ["ViewAt", "draw_run_figures", "run_picture"]
