"""Every kind of figure of every fictitious run: legible, the same each time, with its caption."""

import subprocess
import sys
from pathlib import Path

import pytest
from legibility import check_texts
from synthetic_runs import FICTIONS, LONG, Fiction

import visualisation
from missions.runs.results import Results
from visualisation import FORMATS, KINDS, DrawingError, caption, draw, style


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Results]:
    folder = tmp_path_factory.mktemp("runs")
    return {name: fiction.write(folder / name) for name, fiction in FICTIONS.items()}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", FICTIONS)
def test_texts_overlap_nothing_and_are_not_cut_off(
    runs: dict[str, Results], name: str, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    figure = KINDS[kind](runs[name])
    assert figure.get_figwidth() in {style.COLUMN_IN, style.PAGE_IN}
    check_texts(figure, monkeypatch)


@pytest.mark.parametrize(("file_format", "kinds"), [("png", KINDS), ("svg", KINDS), ("pdf", ["trajectories"])])
def test_the_same_results_give_the_same_bytes(
    tmp_path: Path, runs: dict[str, Results], file_format: str, kinds: list[str]
) -> None:
    run = runs["two vehicles"]
    first = draw(run, list(kinds), tmp_path / "first", file_format)
    again = draw(run, list(kinds), tmp_path / "again", file_format)
    assert [path.name for path in first] == [
        name for kind in kinds for name in (f"{kind}.{file_format}", f"{kind}.txt")
    ]
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in again]


def test_no_kinds_are_all_kinds(tmp_path: Path, runs: dict[str, Results]) -> None:
    written = draw(runs["empty tables"], [], tmp_path, "svg")
    assert [path.stem for path in written[::2]] == list(KINDS)


def test_settings_of_the_user_change_nothing(tmp_path: Path, runs: dict[str, Results]) -> None:
    import matplotlib

    (plain,) = [path for path in draw(runs["two vehicles"], ["roles"], tmp_path / "plain") if path.suffix == ".png"]
    with matplotlib.rc_context({"font.size": 20, "lines.linewidth": 9, "savefig.bbox": "tight"}):
        draw(runs["two vehicles"], ["roles"], tmp_path / "own")
        assert matplotlib.rcParams["font.size"] == 20
    assert (tmp_path / "own" / "roles.png").read_bytes() == plain.read_bytes()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", FICTIONS)
def test_captions_hold_the_conditions_of_the_run(runs: dict[str, Results], name: str, kind: str) -> None:
    text = caption(runs[name], kind)
    vehicles = len(FICTIONS[name].vehicles)
    for part in (f"n = {vehicles} vehicles", "seed 77", "policy m-ack", "PER 25 %", "mission time"):
        assert part in text


def test_a_caption_tells_why_a_run_did_not_complete(runs: dict[str, Results]) -> None:
    assert "not completed (out of time)" in caption(runs["not completed"], "roles")


def test_a_caption_gives_names_whole(runs: dict[str, Results]) -> None:
    assert LONG in caption(runs["long names"], "trajectories")


def test_a_channel_without_loss_rate_has_none_in_the_caption(tmp_path: Path) -> None:
    run = Fiction().write(tmp_path / "run")
    run.summary["per"] = None
    assert "PER" not in caption(run, "roles")


def test_an_unknown_kind_is_told_the_nearest(tmp_path: Path, runs: dict[str, Results]) -> None:
    with pytest.raises(DrawingError, match=r"'trajectory'.*roles.*nearest: 'trajectories'"):
        draw(runs["two vehicles"], ["roles", "trajectory"], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_an_unknown_format_is_told_the_known(tmp_path: Path, runs: dict[str, Results]) -> None:
    with pytest.raises(DrawingError, match=r"'jpg'; known: png, svg, pdf"):
        draw(runs["two vehicles"], ["roles"], tmp_path / "out", "jpg")


def test_formats_are_those_that_can_be_written() -> None:
    assert FORMATS == style.FORMATS


def test_importing_the_package_loads_no_matplotlib() -> None:
    code = "import visualisation, sys; sys.exit('matplotlib' in sys.modules or 'pyarrow' in sys.modules)"
    root = Path(visualisation.__file__).parents[1]
    assert subprocess.run([sys.executable, "-c", code], check=False, cwd=root).returncode == 0
