"""Properties common to all figures of a run: width, colours, metadata of files, animation."""

import re
from pathlib import Path

import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from PIL import Image

from missions.runs.results import Results
from visualisation import KINDS, style
from visualisation.runs import draw_run_figures, run_picture


def colours(figure: Figure) -> set[str]:
    """Full colours of the lines and bars of a figure, without shades of grey."""
    found = set()
    for axes in figure.axes:
        for line in axes.lines:
            found |= {to_hex(line.get_color())} if line.get_linestyle() != "None" else set()
        for collection in (one for one in axes.collections if one.get_array() is None):
            found |= {to_hex(one) for one in collection.get_facecolor()}
        found |= {to_hex(patch.get_facecolor()) for patch in axes.patches}
    return {one for one in found if len({one[1:3], one[3:5], one[5:]}) > 1}


@pytest.mark.parametrize("kind", KINDS)
def test_vehicle_has_one_colour_in_all_figures(runs: dict[str, Results], kind: str) -> None:
    """Every colour of a figure of two vehicles is that of one of them, or a tint of it."""
    figure = run_picture(runs["two vehicles"], kind, (), ()).figure
    own = [style.vehicle_look(number).colour for number in range(2)]
    allowed = {to_hex(style.tint(one, strength)) for one in own for strength in (1.0, 0.4, 0.25)}
    assert colours(figure) <= allowed
    assert bool(colours(figure)) == (
        kind in ("trajectories", "roles", "organisation", "satisfaction", "motivation", "htn")
    )


def test_files_have_version_seed_and_key_of_the_run(tmp_path: Path, runs: dict[str, Results]) -> None:
    """Version, seed and key: as chunks of text, as Dublin Core, in the info of the document."""
    run = runs["two vehicles"]
    for format in ("png", "svg", "pdf"):
        draw_run_figures(run, ["trajectories"], tmp_path, format)
    png = Image.open(tmp_path / "trajectories.png")
    assert (png.text["seed"], png.text["scenario"]) == ("77", "fiction")  # type: ignore[attr-defined]
    key = png.text["run"]  # type: ignore[attr-defined]
    assert re.fullmatch("[0-9a-f]{20}", key)
    assert png.text["version"].startswith("remoras ")  # type: ignore[attr-defined]
    svg = (tmp_path / "trajectories.svg").read_text(encoding="utf-8")
    assert f"run {key}; seed 77" in svg
    assert f"run {key}; seed 77".encode() in (tmp_path / "trajectories.pdf").read_bytes()
