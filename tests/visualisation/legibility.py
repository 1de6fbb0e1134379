"""Texts of a figure and their boxes, for tests of legibility."""

import numpy as np
import pytest
from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

TOUCH_PX = 1.0
"""Boxes of text hold the rounding of a pixel on each side."""


def inscriptions(figure: Figure, monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, Bbox]]:
    """Every text that is drawn in a figure, with its box in pixels."""
    drawn: list[Text] = []
    draw_text = Text.draw

    def noted(self: Text, renderer: RendererBase) -> None:
        if self.get_visible() and self.get_text():
            drawn.append(self)
        draw_text(self, renderer)

    with monkeypatch.context() as patch:
        patch.setattr(Text, "draw", noted)
        figure.draw_without_rendering()
    return [(text.get_text(), Text.get_window_extent(text).padded(-TOUCH_PX)) for text in drawn]  # without its arrow


def check_texts(figure: Figure, monkeypatch: pytest.MonkeyPatch) -> None:
    """No text is cut off, and none covers another."""
    found = inscriptions(figure, monkeypatch)
    assert found
    width_px, height_px = figure.bbox.width, figure.bbox.height
    cut = [text for text, box in found if box.x0 < 0 or box.y0 < 0 or box.x1 > width_px or box.y1 > height_px]
    assert not cut
    sides = np.array([[sorted((box.x0, box.x1)), sorted((box.y0, box.y1))] for _, box in found])
    reach = (sides[:, None, :, 0] <= sides[None, :, :, 1]).all(axis=2)  # one begins before another ends, either way
    pairs = np.argwhere(np.triu(reach & reach.T, k=1))
    assert not [(found[one][0], found[other][0]) for one, other in pairs]
