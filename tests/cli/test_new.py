"""Output of `remoras new`: scenarios run, plug-ins conform, existing files stay without --force."""

import re
import tomllib
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from invoked import refused, remoras

from missions.mapping.new_scenario import scenario_text
from missions.runs.estimates import cautions
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.cli.new import PLUGINS, TEMPLATES

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


# A scenario ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "flags",
    [
        "",
        "--vehicles 2 --areas 1 --side 50 --per 0",
        "--vehicles 6 --areas 5 --modem s2c-18-34 --per 0.95 --lost 2",
        "--vehicles 16 --areas 36 --side 75.5 --lost 15",
        "--areas 6 --side 1000 --modem whoi-fsk-0",
    ],
)
def test_a_new_scenario_is_valid_and_feasible(flags: str) -> None:
    assert remoras("new", "scenario", "mine", *flags.split()).exit_code == 0
    setup = resolved(load("mine.toml"))
    asked = dict(re.findall(r"--(\w+) (\S+)", flags))
    assert len(setup.database) == int(asked.get("vehicles", 3))
    assert len(setup.mission.jobs) == int(asked.get("areas", 4))
    assert setup.scenario.channel.per == float(asked.get("per", 0.3))
    assert len(setup.scenario.fault) == int(asked.get("lost", 0))
    assert setup.modem.name == asked.get("modem", "nanomodem-v3")
    assert list(cautions(setup)) == []
    assert "$" not in Path("mine.toml").read_text(encoding="utf-8")


@given(side_m=st.integers(500, 10_000).map(lambda tenths: tenths / 10), areas=st.integers(1, 9))
@example(side_m=80.0, areas=6)
def test_cells_of_a_new_scenario_end_at_the_borders_of_its_areas(side_m: float, areas: int) -> None:
    """The grid begins at 0, hence every corner is a multiple of the cell's side, to a micrometre."""
    written = tomllib.loads(scenario_text("mine", {"nanomodem-v3": 1e6}, areas=areas, side=side_m))
    cell_m = written["world"]["cell_m"]
    assert 12.0 <= cell_m <= 25.0
    for along_m in {along_m for area in written["area"] for corner in area["corners_m"] for along_m in corner}:
        assert abs(along_m - cell_m * round(along_m / cell_m)) <= 1e-6


def test_a_new_scenario_runs_unchanged() -> None:
    said = remoras("new", "scenario", "mine", "--areas", "2", "--side", "75", "--lost", "1", "--vehicles", "3").stdout
    told = said.splitlines()[-1].removeprefix("try it with: remoras ").split()
    ran = remoras(*told)
    assert ran.exit_code == 0, ran.output
    assert "completed            yes" in ran.stdout


# Plug-ins -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", PLUGINS)
def test_a_new_plug_in_equals_its_template_under_another_name(kind: str) -> None:
    """All that is written is shown in a how-to, whose commands are run; the name takes the place of the template's."""
    made = remoras("new", kind, "by_night", "--out", "deep/er")
    assert made.exit_code == 0
    assert "try it with: python -m pytest -q deep/er/test_by_night.py  # " in made.stdout
    word = PLUGINS[kind][0].removesuffix(".py")
    for file in (*PLUGINS[kind], f"test_{word}.py"):
        text = Path("deep/er", file.replace(word, "by_night")).read_text(encoding="utf-8")
        for old, its in (("by_night", word), ("BY_NIGHT", word.upper()), ("ByNight", word.capitalize())):
            text = text.replace(old, its)
        assert text == (TEMPLATES / file).read_text(encoding="utf-8")
    pages = [path.read_text(encoding="utf-8") for path in (ROOT / "docs" / "howto").glob("*.md")]
    (how_to,) = (text for text in pages if f"remoras new {kind} {word}\n" in text)
    assert {*PLUGINS[kind]} <= {*re.findall(r"templates/(\S+\.\w+)", how_to)}
    assert f"\npython -m pytest -q test_{word}.py\n" in how_to


def test_pip_takes_the_name_of_a_new_package_for_a_folder() -> None:
    made = remoras("new", "strategy", "patient", "--package")
    assert "try it with: pip install remoras-patient/ && " in made.stdout


@pytest.mark.parametrize("kind", PLUGINS)
def test_a_new_plug_in_is_renamed_whole_or_not_at_all(kind: str) -> None:
    """The name is a word of code, never of a sentence about the template's subject; of a sensor, no subject remains."""
    assert remoras("new", kind, "by_night").exit_code == 0
    for path in Path().iterdir():
        text = path.read_text(encoding="utf-8")
        texts = re.findall(r'#.*|"""[^"]+"""|"[^"\n]*"', text)
        sentences = [one for one in texts if " " in one.strip("# ") or one.startswith("#")]
        assert not [one for one in sentences if re.search(r"\bby_night\b(?![.:])|By[nN]ight", one)]
        assert kind != "sensor" or not re.search("temperature|warm|degree|degC", text)


# What is refused ----------------------------------------------------------------------------------


@pytest.mark.parametrize("arguments", ["scenario mine", "metric mine", "mission mine"])
def test_new_replaces_no_file_without_force(arguments: str) -> None:
    assert remoras("new", *arguments.split()).exit_code == 0
    before = {path: path.read_bytes() for path in Path().rglob("*") if path.is_file()}
    changed = next(iter(before))
    changed.write_bytes(b"of mine")
    assert re.fullmatch(r"remoras: .*mine.*: already there; --force replaces; .*\n", refused("new", *arguments.split()))
    assert changed.read_bytes() == b"of mine"
    assert remoras("new", *arguments.split(), "--force").exit_code == 0
    assert {path: path.read_bytes() for path in Path().rglob("*") if path.is_file()} == before


def test_a_file_in_place_of_the_folder_is_reported_in_one_line() -> None:
    Path("taken").touch()
    assert refused("new", "metric", "mine", "--out", "taken").count("\n") == 1


def test_wrong_answer_of_a_strategy_is_one_line_of_check(tmp_path: Path) -> None:
    text = (TEMPLATES / "nearest.py").read_text()
    wrong = text.replace("return Move(tuple(statements), holding=bool(work.unfinished))", "return statements")
    assert wrong != text
    (tmp_path / "mine.py").write_text(wrong)
    report = refused("check", "strategy", "mine.py:NEAREST")
    assert re.search(r"negotiate returned \[.*\]; expected: a Move with statements", report)
    assert report.count("\n") == 1
