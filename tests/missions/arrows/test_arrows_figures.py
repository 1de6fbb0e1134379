"""The map that is drawn is that of all looks, with what really lies there."""

from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
from matplotlib.figure import Figure as Sheet
from searching import mission, run

from missions.arrows.metrics import LEVELS, draw_maps, found_at_s, sites_of
from missions.arrows.truth import looks_known
from missions.runs.results import MemoryResults


class Style:
    """As the package that draws hands it in."""

    black, grey = "#000000", "#666666"
    looks: ClassVar[Any] = {
        name: SimpleNamespace(colour="#0000ff", line="-", marker="o") for name in ("ASV00", "AUV01", "AUV02", "AUV03")
    }

    def tint(self, colour: str, strength: float) -> tuple[float, float, float]:
        return (1.0 - strength, 1.0 - strength, 1.0 - strength)

    def axis(self, label: str, unit: str = "") -> str:
        return f"{label} in {unit}"


def test_the_map_shades_cells_by_all_looks_and_marks_sites_by_whether_they_were_detected() -> None:
    of, axes = run(), Sheet().subplots()
    caption = draw_maps(axes, MemoryResults(of), Style())
    chart, grid = mission().chart(), mission().grid
    for _, attribute, code in looks_known(of.recorder, mission().crew)[""]:
        chart.add(attribute, (code,))
    shares = chart.shares[1:4].sum(axis=0)
    tones = np.searchsorted(LEVELS, shares, side="right").reshape(grid.n_rows, grid.n_columns)
    assert (np.asarray(axes.images[0].get_array()) == tones).all()
    assert len(np.unique(tones)) > 2
    drawn = {line.get_label(): len(line.get_xdata()) for line in axes.lines}
    found, sites = found_at_s(of).keys(), sites_of(of)
    assert (drawn["site, detected"], drawn["site, not detected"]) == (len(sites & found), len(sites - found))
    assert {"AUV01", "AUV02", "AUV03"} <= drawn.keys()
    assert f"{len(sites)} there, {len(sites & found)} detected" in caption
