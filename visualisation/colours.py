"""The colours of figures and of the page of a replay: one meaning each, the same in both.

Those of Okabe and Ito (Color Universal Design, 2008), which stay apart for colour-blind readers; wine and indigo are
from Tol's "muted" scheme (2021).
"""

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
"""Colours of series, in order; yellow is left out because a yellow line vanishes on white paper."""
VEHICLES = (*COLOURS[:-1], WINE, INDIGO)
"""Colours of vehicles in all figures of a run and on its page: eight that stay apart. In figures black is the fleet,
yellow a place or a milestone, and a shade of grey (darker is worse) a share or an age."""
