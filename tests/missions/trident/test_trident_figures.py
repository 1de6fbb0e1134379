"""Figures of this mission, drawn from the tables of a run."""

from types import SimpleNamespace
from typing import Any, ClassVar

import pytest
from intervening import run
from matplotlib.figure import Figure as Sheet

from missions.runs.results import MemoryResults
from missions.trident.metrics import FIGURES, draw_choreography, draw_services, draw_site, statuses, uses


class Style:
    """As the package that draws hands it in."""

    black, grey = "#000000", "#666666"
    looks: ClassVar[Any] = {
        name: SimpleNamespace(colour=colour, line="-", marker="o")
        for name, colour in (("ASV00", "#0000ff"), ("IAUV00", "#ff0000"))
    }

    def tint(self, colour: str, strength: float) -> tuple[float, float, float]:
        return (1.0 - strength, 1.0 - strength, 1.0 - strength)

    def axis(self, label: str, unit: str = "") -> str:
        return f"{label} in {unit}"

    def time(self, time_s: float) -> str:
        return f"{time_s} s"


@pytest.fixture(scope="module")
def results() -> MemoryResults:
    return MemoryResults(run(failing=("IAUV00 arm",)))


def test_services_show_when_each_worked_and_who_used_it(results: MemoryResults) -> None:
    said = statuses(results)
    assert len(said) == 13
    assert [status for _, status in said["IAUV00 arm"]] == ["available", "failed"]
    found = {(vehicle, service) for vehicle, service, _, _ in uses(results, said)}
    assert ("IAUV00", "IAUV00 gripper") in found
    assert ("IAUV00", "IAUV00 arm") not in found
    assert all(from_s <= to_s for _, _, from_s, to_s in uses(results, said))
    axes = Sheet().subplots()
    assert draw_services(axes, results, Style()).startswith("Grey: the service says")
    assert [label.get_text() for label in axes.get_yticklabels()] == list(said)


def test_the_choreography_has_a_step_for_each_message(results: MemoryResults) -> None:
    axes = Sheet().subplots()
    assert draw_choreography(axes, results, Style()).endswith("Violations of the pattern: 0.")
    marks = [line for line in axes.lines if line.get_marker() == "o"]
    assert len(marks) == results.table("choreography").num_rows == 5


def test_the_map_has_every_tile_once(results: MemoryResults) -> None:
    axes = Sheet().subplots()
    draw_site(axes, results, Style())
    rows = results.table("charted").to_pylist()
    assert len(axes.patches) == len({(row["column"], row["row"]) for row in rows}) == 128


def test_figures_name_the_tables_that_they_need() -> None:
    assert [one.name for one in FIGURES] == ["services", "choreography", "site"]
    assert [one.needs for one in FIGURES] == [("items", "plans"), ("choreography",), ("charted", "attempts")]
