"""Figures of a sweep. Importing this package does not load matplotlib."""

from visualisation.sweeps.comparison import draw_sweep_figures, sweep_picture, sweep_pictures

__all__ = ["draw_sweep_figures", "sweep_picture", "sweep_pictures"]
