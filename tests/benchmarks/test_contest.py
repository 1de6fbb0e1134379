"""What cards say together: who is told apart from whom, what is lacking to the best, and which order stands."""

from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.contest import Contest, apart, lines, p_value, ranked, read, regrets
from missions.benchmark.scoring import CellRun, Scored
from missions.benchmark.suite import Cell

CARD = Path("missions/benchmark/suites/fathom-1.json")
NETWORKS = "alike", "bursts"


def scored(name: str, *times_s: float) -> Scored:
    """Runs of two cells; those of the second take twice as long."""
    cells = {
        Cell("sea", network, "nothing"): [
            CellRun(repeat, repeat, 1000.0, factor * time_s, True, 1.0, 0.0) for repeat, time_s in enumerate(times_s)
        ]
        for factor, network in zip((1.0, 2.0), NETWORKS, strict=True)
    }
    return Scored(name, name, cells)


@pytest.fixture
def contest() -> Contest:
    made = scored("central", 2000.0, 2100.0, 2200.0), scored("cbba", 2400.0, 2520.0, 2640.0)
    return {one.name: one for one in made}


def test_who_is_always_behind_is_told_apart_and_twins_are_not(contest: Contest) -> None:
    twin = replace(contest["cbba"], name="remoras")
    found = apart({**contest, "remoras": twin}, ["central", "cbba", "remoras"])
    assert found == {("central", "cbba"): True, ("central", "remoras"): True, ("cbba", "remoras"): False}
    assert p_value(contest["cbba"], twin) == 1.0


def test_regret_is_what_is_lacking_in_each_condition(contest: Contest) -> None:
    assert regrets(contest, ["central", "cbba"])["cbba"] == pytest.approx([1.0 - 2000.0 / 2400.0] * 2)
    assert regrets(contest, ["central", "cbba"])["central"] == [0.0, 0.0]


def test_order_of_another_split(contest: Contest) -> None:
    assert list(lines(contest, contest))[-1].endswith("tau 1.00")
    swapped = {"central": replace(contest["cbba"], name="central"), "cbba": replace(contest["central"], name="cbba")}
    assert list(lines(contest, swapped))[-1].endswith("tau -1.00")


def test_the_nine_of_the_shipped_card_are_ranked() -> None:
    names = ranked(read([CARD]))
    assert len(names) == 9
    assert "oracle" not in names
