"""Bad input: one clear line with the key, the value and what is allowed."""

from pathlib import Path

import pytest
from searching import text

from missions.errors import ConfigurationError
from missions.scenarios import load


def says(tmp_path: Path, old: str, new: str) -> str:
    assert old in text()
    file = tmp_path / "sea.toml"
    file.write_text(text().replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ConfigurationError) as caught:
        load(str(file))
    found = [line for line in str(caught.value).splitlines() if line.strip()]
    assert len(found) == 1, found
    return found[0]


ROW = "[" + ", ".join(["0.0016666667"] * 30) + "]"
EVEN = "[" + ", ".join([ROW] * 20) + "]"


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("x_m = [0.0, 1200.0]", "x_m = [0.0, 1400.0]", "search.x_m = [0, 1400]: within world.x_m = [-100, 1300]"),
        ("x_m = [0.0, 1200.0]", "x_m = [1200.0, 0.0]", "search.x_m = [1200, 0]: the lower border first"),
        ("cell_m = 40.0", "cell_m = 10.0", "search.cell_m = 10: 120 x 80 cells; at most 4096"),
        (
            "expected = 4.0",
            "expected = 4.0\nmap = [[0.5, 0.5]]",
            "kind.amphorae.map = 1 rows of 2: 20 rows of 30 numbers",
        ),
        (
            "expected = 4.0",
            f"expected = 4.0\nmap = {EVEN.replace('67]', '67, 0.1]')}",
            "kind.amphorae.map = 20 rows of 31",
        ),
        (
            "expected = 4.0",
            f"expected = 4.0\nmap = {EVEN.replace('0.0016666667', '0.002')}",
            "kind.amphorae.map = sums to 1.2: shares of all cells sum to 1",
        ),
        (
            "expected = 4.0",
            f"expected = 4.0\nmap = {EVEN.replace('0.0016666667', 'nan', 1)}",
            "kind.amphorae.map.1.1 = nan",
        ),
        (
            "expected = 4.0",
            f"expected = 4.0\nmap = {EVEN.replace('0.0016666667', '-0.1', 1)}",
            "kind.amphorae.map.1.1 = -0.1: a number from 0 on",
        ),
        ("expected = 4.0", "expected = 400.0", "things in one cell: at most 1 of all kinds together"),
        ("rock = 0.5", "rock = 1.5", "detector.acoustic.p_detect.rock"),
        ("position_m = [240.0", "position_m = [-2400.0", "historic_find"),
    ],
)
def test_what_cannot_be_is_refused(tmp_path: Path, old: str, new: str, expected: str) -> None:
    if old.startswith("position_m"):
        old = next(line for line in text().splitlines() if line.startswith("position_m"))
        new = "position_m = [-2400.0, 100.0]"
    assert expected in says(tmp_path, old, new)


def test_a_map_is_taken_as_it_is(tmp_path: Path) -> None:
    file = tmp_path / "sea.toml"
    even = EVEN.replace("0.0016666667", repr(1.0 / 600.0))
    file.write_text(text().replace("expected = 4.0", f"expected = 4.0\nmap = {even}", 1), encoding="utf-8")
    assert load(str(file)).kind[0].map[0][0] == 1.0 / 600.0
