"""Figures and layers declared by a mission: drawn in the common style; their errors name them."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from legibility import check_texts, inscriptions
from matplotlib.figure import Figure as Sheet
from synthetic_runs import DECLARED, FINDS, Fiction

from missions.figure import Figure, Layer, Mark, RunResults, Style
from missions.runs.results import Results
from visualisation import DrawingError, style
from visualisation.runs import draw_run_figures, run_picture

WRECKS = next(one for one in DECLARED if isinstance(one, Layer))


@pytest.fixture
def run(tmp_path: Path) -> Results:
    return Fiction(milestones=[("broken_off", "A", "", 400.0)]).write(tmp_path / "run")


def raises(axes: Any, results: RunResults, style: Style) -> str:
    raise KeyError("depth_m")


def ends_the_program(axes: Any, results: RunResults, style: Style) -> str:
    raise SystemExit(0)


def returns_nothing(axes: Any, results: RunResults, style: Style) -> None:
    axes.plot([0, 1], [0, 1])


def is_no_formula(axes: Any, results: RunResults, style: Style) -> str:
    axes.set_title(r"$\\frac{1$")
    return ""


def test_declared_figure_has_the_common_style_and_wording(run: Results, tmp_path: Path) -> None:
    found = run_picture(run, "finds", DECLARED)
    (axes,) = found.figure.axes
    assert [line.get_color() for line in axes.get_lines()] == [style.look(0).colour, style.look(1).colour]
    assert [text.get_text() for text in found.figure.legends[0].get_texts()] == ["A", "B"]
    assert axes.get_xlabel() == "time (s)"
    assert found.caption.startswith(
        "Finds of the vehicles over mission time. Found by 1000 s: 2. Scenario fiction, n = 2"
    )
    written = draw_run_figures(run, ["finds"], tmp_path / "out", "svg", DECLARED)
    assert [path.name for path in written.files] == ["finds.svg", "finds.txt"]
    assert written.files[1].read_text(encoding="utf-8") == found.caption + "\n"


def test_declared_figure_is_drawn_into_axes_of_a_user(run: Results) -> None:
    own = Sheet(figsize=(4.0, 2.0)).subplots()
    found = run_picture(run, "finds", DECLARED, ax=own)
    assert found == (own.figure, run_picture(run, "finds", DECLARED).caption, ())
    assert [text.get_text() for text in own.get_legend().get_texts()] == ["A", "B"]
    assert tuple(found.figure.get_size_inches()) == (4.0, 2.0)


def test_long_labels_get_enough_room(run: Results, monkeypatch: pytest.MonkeyPatch) -> None:
    def draw_large(axes: Any, results: RunResults, style: Style) -> str:
        axes.plot(
            [0, 1],
            [1_000_000_000, 3_000_000_000],
            label="an_entry_that_is_too_long_" * 3,
        )
        axes.ticklabel_format(style="plain")
        axes.set_ylabel("two\nlines")
        axes.set_xlabel("below\nit\ntoo")
        axes.set_title("and above")
        return ""

    figure = run_picture(run, "large", [Figure("large", "Large", draw_large)]).figure
    check_texts(figure, monkeypatch)
    assert figure.get_figwidth() == style.COLUMN_IN
    assert any(text.endswith("\u2026") for text, _ in inscriptions(figure, monkeypatch))


@pytest.mark.parametrize(
    ("broken", "message"),
    [
        (raises, "its draw raised KeyError: 'depth_m'"),
        (ends_the_program, "its draw raised SystemExit: 0"),
        (returns_nothing, "its draw returned None, a NoneType; it has to return the sentences of the caption as text"),
    ],
)
@pytest.mark.parametrize(("declared", "kinds"), [(FINDS, ["roles", "finds"]), (WRECKS, ["trajectories"])])
def test_failing_draw_function_gives_one_error_line_and_no_file(
    run: Results, tmp_path: Path, declared: Figure | Layer, kinds: list[str], broken: Any, message: str
) -> None:
    kind = type(declared).__name__.lower()
    with pytest.raises(DrawingError) as raised:
        draw_run_figures(run, kinds, tmp_path / "out", "svg", [replace(declared, draw=broken)])
    assert str(raised.value).startswith(f"the mission's {kind} {declared.name!r}: {message}")
    assert "\n" not in str(raised.value)
    assert not (tmp_path / "out").exists()


def test_invalid_formula_text_is_reported_with_its_figure(run: Results, tmp_path: Path) -> None:
    with pytest.raises(DrawingError, match="the mission's figure 'finds': its draw raised ValueError"):
        draw_run_figures(run, ["finds"], tmp_path / "out", "svg", [replace(FINDS, draw=is_no_formula)])


@pytest.mark.parametrize(
    ("declared", "message"),
    [
        ([FINDS, FINDS], "declares a figure 'finds', a name that is taken; rename it"),
        ([replace(FINDS, name="roles")], "declares a figure 'roles', a name that is taken"),
        ([replace(FINDS, name="overview")], "declares a figure 'overview', a name that is taken"),
        *(
            ([replace(FINDS, name=name)], "declares a figure '.*': name = '.*': it is no name of a file")
            for name in ("a/b", ".a", "a\\b")
        ),
        ([raises], "it is a function; expected a remoras.Figure, Layer or Mark"),
    ],
)
def test_a_wrong_declaration_is_refused(run: Results, tmp_path: Path, declared: Any, message: str) -> None:
    with pytest.raises(DrawingError, match=message):
        draw_run_figures(run, ["roles"], tmp_path / "out", "svg", declared)
    assert not (tmp_path / "out").exists()


def test_unknown_kind_is_refused_with_all_known_kinds(run: Results, tmp_path: Path) -> None:
    with pytest.raises(DrawingError, match=r"'fids'; known: trajectories, .*, tdma, links, finds; nearest: 'finds'"):
        draw_run_figures(run, ["fids"], tmp_path, "svg", DECLARED)


def test_layers_are_below_tracks_with_one_sentence_in_the_caption(run: Results) -> None:
    found = run_picture(run, "trajectories", DECLARED, Fiction().places)
    for axes in found.figure.axes:
        tracks = [line.get_zorder() for line in axes.get_lines() if len(line.get_xdata()) > 1]
        assert max(one.get_zorder() for one in axes.collections) < 1.0 <= min(tracks)
    assert found.caption.count("Dots: finds.") == 1
    assert "finds" in [text.get_text() for text in found.figure.legends[0].get_texts()]


def test_marks_are_at_the_position_of_the_vehicle(run: Results) -> None:
    found = run_picture(run, "trajectories", [Mark("broken_off", "broken off")])
    (mark,) = [line for line in found.figure.axes[0].get_lines() if line.get_marker() == "X"]
    track = next(line for line in found.figure.axes[0].get_lines() if len(line.get_xdata()) == 61)
    assert mark.get_xdata()[0] == pytest.approx(track.get_xdata()[24], abs=1e-6)  # 400 s of 1000 s in 60 steps
    assert "A: broken off at 400 s." in found.caption
    assert "broken off" not in run_picture(run, "trajectories").caption
