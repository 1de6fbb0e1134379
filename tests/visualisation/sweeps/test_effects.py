"""Effects of factors: known effects of a simulated law are recovered and drawn."""

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from synthetic_sweeps import HORIZON_S, Sweep, law

from missions.comparison.effects import MainEffect, effects_of
from missions.errors import OutputError
from missions.sweeps.folder import SweepResults
from visualisation.output import DrawingError
from visualisation.sweeps import draw_sweep_figures, sweep_picture

FACTORS = {"decision.weight_external": [0.0, 1.0], "guidance.attraction": [0.0, 2.0], "guidance.repulsion": [4.0, 8.0]}
OF_TIME = {"decision.weight_external": 30.0, "guidance.attraction": -10.0, "guidance.repulsion": 0.0}
"""From the low level to the high one; half of them at the middle of an interaction of 16 s."""


def time_of(strategy: str, policy: str, per: float, repeat: int, settings: dict[str, Any]) -> dict[str, Any]:
    """Effects as above, an interaction of the first two, a large part that all runs of a seed share, a small one."""
    a, b, _ = (settings[key] / 1.0 == high for key, (_, high) in FACTORS.items())
    seed = np.random.Generator(np.random.Philox([repeat, int(10 * per)])).standard_normal()
    own = np.random.Generator(np.random.Philox([repeat, int(10 * per), a, b, *map(int, settings.values())]))
    time_s = 1000.0 + 22.0 * a - 18.0 * b + 16.0 * a * b + 200.0 * seed + 2.0 * own.standard_normal() + 500.0 * per
    return {**law("remoras", "ack", 0.0, 0, {}), "completed": True, "mission_time_s": time_s}


def sweep(**given: Any) -> Sweep:
    usual = {"channels": [("bernoulli", (0.2, 0.6), {})], "repeats": 12, "summary": time_of}
    return Sweep(["remoras"], factorial=FACTORS, **{**usual, **given})


def of_all(rows: list[MainEffect]) -> dict[str, MainEffect]:
    return {row.term: row for row in rows if row.condition == "all"}


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> SweepResults:
    return sweep().write(tmp_path_factory.mktemp("effects") / "sweep")


def test_estimated_effects_equal_those_of_the_simulated_law(results: SweepResults) -> None:
    """The part of the seed, 200 s, cancels out; that of each run, 2 s, is left."""
    found = of_all(effects_of(results, ["mission_time_s"]))
    for factor, effect in OF_TIME.items():
        row = found[factor]
        assert row.ci95_low is not None
        assert row.ci95_high is not None
        assert row.ci95_low - 1.0 < effect < row.ci95_high + 1.0
        assert row.ci95_high - row.ci95_low < 5.0
        assert (row.low, row.high) == tuple(map(str, FACTORS[factor]))
        assert (row.n, row.n_missing, row.aliases, row.is_main) == (12, 0, "", True)
    crossed = found["decision.weight_external x guidance.attraction"]
    assert crossed.effect == pytest.approx(8.0, abs=1.0)
    assert not crossed.is_main
    assert {row.condition for row in effects_of(results, ["mission_time_s"])} == {
        "all", "mapping-rendezvous, remoras, m-ack, bernoulli per 0.2",
        "mapping-rendezvous, remoras, m-ack, bernoulli per 0.6",
    }  # fmt: skip


def test_half_fraction_names_the_interactions_mixed_with_each_effect(tmp_path: Path) -> None:
    """With C = AB the interaction of 8 s goes to C. A design of one condition is drawn, though it has no axis."""
    results = sweep(channels=[("bernoulli", (0.8,), {})], halvings=1).write(tmp_path / "half")
    assert [axes.get_title(loc="left") for axes in sweep_picture(results, "effects").figure.axes] == [""]
    rows = {row.term: row for row in effects_of(results, ["mission_time_s"])}
    mixed = rows["guidance.repulsion"]
    assert mixed.aliases == "decision.weight_external x guidance.attraction"
    assert mixed.effect == pytest.approx(8.0, abs=1.5)


def test_effects_count_runs_that_do_not_complete(tmp_path: Path) -> None:
    def never(*given: Any) -> dict[str, Any]:
        summary = time_of(*given)
        late = given[-1]["decision.weight_external"] > 0.0
        return summary | ({"completed": False, "mission_time_s": HORIZON_S} if late else {})

    row = of_all(effects_of(sweep(summary=never).write(tmp_path / "late"), ["mission_time_s"]))[
        "decision.weight_external"
    ]
    assert row.n_missing == 12 * 4 * 2
    assert row.effect > 5000.0


def test_few_repeats_have_no_interval_and_incomplete_conditions_are_omitted(tmp_path: Path) -> None:
    """The second loss rate comes last for each point; the last configuration of it was not made."""
    rows = effects_of(sweep(repeats=7, n_remaining=7).write(tmp_path / "few"), ["mission_time_s"])
    assert {row.condition for row in rows} == {"mapping-rendezvous, remoras, m-ack, bernoulli per 0.2"}
    assert all(row.ci95_low is None and row.note == "n too small" for row in rows)


def test_studies_without_factorial_design_have_no_effects(tmp_path: Path) -> None:
    other = Sweep(["remoras"], repeats=2).write(tmp_path / "other")
    with pytest.raises(OutputError, match='effects need a study with sampling = "factorial"'):
        effects_of(other)
    with pytest.raises((OutputError, DrawingError), match="factorial"):
        draw_sweep_figures(other, ["effects"], tmp_path / "figures")


def test_the_figure_has_a_panel_for_each_condition_and_a_whisker_for_each_factor(results: SweepResults) -> None:
    drawn = sweep_picture(results, "effects")
    panels = drawn.figure.axes
    titles = [axes.get_title(loc="left") for axes in panels]
    assert titles == ["(a) all", "(b) bernoulli per 0.2", "(c) bernoulli per 0.6"]
    for axes in panels:
        whiskers = [line for line in axes.lines if len(line.get_xdata()) == 2 and line.get_linewidth() > 1.0]
        assert len(whiskers) == len(FACTORS)
        assert [round(float(line.get_ydata()[0])) for line in whiskers] == [0, 1, 2]
    labels = [label.get_text() for label in panels[0].get_yticklabels()]
    assert labels[0] == "weight_external\n0.0 to 1.0"
    for part in ("n = 12", "full factorial, 2^3 = 8 runs", "master seed 11", "95 % confidence intervals"):
        assert part in drawn.caption


def test_a_factorial_study_is_drawn_as_effects_alone(results: SweepResults, tmp_path: Path) -> None:
    drawn = draw_sweep_figures(results, [], tmp_path / "figures")
    assert [path.name for path in drawn.files] == ["effects.png", "effects.csv", "effects.txt"]
    with (tmp_path / "figures" / "effects.csv").open() as file:
        table = list(csv.DictReader(file))
    assert {row["term"] for row in table if row["is_main"] == "True"} == set(FACTORS)
    named = draw_sweep_figures(results, ["effects"], tmp_path / "bytes", ranked="n_bytes")
    assert named.files[0].name == "effects-n_bytes.png"
