"""Properties common to all figures of a run: width, colours, metadata of files, animation."""

import re
from contextlib import suppress
from pathlib import Path

import pytest
from legibility import inscriptions
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from PIL import Image
from sampling import sampled

import remoras
from missions.figure import Figure as Declared
from missions.runs.results import Results
from missions.scenarios.parts import mission_of
from visualisation import KINDS, DrawingError, style
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


@pytest.mark.slow
@pytest.mark.parametrize(
    "scenario",
    sampled(
        ["mapping-rendezvous", "pandora-inspection", "trident-intervention", "arrows-archaeology",
         "minehunting-contacts", "recovery-field", "escort-lines", "ferry-passage", "resupply-field"],
        "mapping-rendezvous", "trident-intervention",
    ),
)  # fmt: skip
def test_no_text_of_a_shipped_figure_is_cut_in_a_column(scenario: str, monkeypatch: pytest.MonkeyPatch) -> None:
    end_s = 3300.0 if scenario == "pandora-inspection" else 300.0  # it has faults until 3000 s
    run = remoras.run(scenario, seed=1, set={"scenario.duration_s": end_s})
    own = [figure.name for figure in mission_of(run.scenario).figures if isinstance(figure, Declared)]
    drawn = 0
    for kind in [*KINDS, *own]:
        with suppress(DrawingError):  # a table that this run lacks, or no losses
            shown = run.plot(kind, width_in=style.COLUMN_IN)
            width_px, height_px = shown.bbox.width, shown.bbox.height
            texts = inscriptions(shown, monkeypatch)
            inside = [t for t, box in texts if min(box.x0, box.y0) >= 0 and box.x1 <= width_px and box.y1 <= height_px]
            assert len(inside) == len(texts), kind
            drawn += 1
    assert drawn >= len(KINDS) - 1


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
