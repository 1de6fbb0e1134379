"""Colours of figures and replay: palette of Okabe and Ito (2008), wine and indigo of Tol's "muted" scheme (2021)."""

from __future__ import annotations

BLACK = "#000000"
ORANGE = "#E69F00"
SKY_BLUE = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#F0E442"
BLUE = "#0072B2"
VERMILLION = "#D55E00"
PURPLE = "#CC79A7"
WINE = "#882255"
INDIGO = "#332288"

COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY_BLUE, BLACK)
"""Colours of series, in order, without yellow, which is invisible as a line on white paper."""
VEHICLES = (*COLOURS[:-1], WINE, INDIGO)
"""Vehicle colours; black is the fleet, yellow a place, white a milestone, grey a share or an age (darker is worse)."""
