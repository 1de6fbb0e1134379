"""Strategies that hang or write files are stopped and named, and the run continues."""

import gc
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from missions.runs.results import summary
from missions.runs.run import Run, run
from missions.scenarios import load
from remoras.errors import PluginError
from remoras.organisation import Group
from remoras.strategies.cbba import Bidder, Cbba
from remoras.strategy import Move, Situation

SETTINGS = [("--set", "scenario.duration_s=300.0"), ("--set", "channel.per=0.4")]
LIMIT = ("--set", "watch.cpu_s=0.2")


class Turning(Bidder):
    """Calls a given function in one round."""

    def __init__(self, me: str, group: Group, strategy: "TurnsStrategy") -> None:
        super().__init__(me, group, strategy.of)
        self.turns = strategy.turns if me == strategy.vehicle else None

    def negotiate(self, situation: Situation) -> Move:
        if situation.round == 5 and self.turns is not None:
            self.turns()
        return super().negotiate(situation)


class TurnsStrategy:
    """``cbba`` of which one vehicle does something else in its fifth round."""

    of = Cbba()
    name, declaration = "turns", of.declaration
    form, adapt = staticmethod(of.form), staticmethod(of.adapt)

    def __init__(self, turns: Callable[[], Any], vehicle: str = "AUV01") -> None:
        self.turns, self.vehicle = turns, vehicle

    def negotiator(self, me: str, group: Group) -> Bidder:
        return Turning(me, group, self)


def flown(strategy: Any, *settings: tuple[str, str]) -> Run:
    return run(load("mapping-patches", [*SETTINGS, *settings]), 3, strategy=strategy)


def hang() -> None:
    while True:
        pass


def hang_on() -> None:
    """An endless loop that lets no error end it, but for a few times."""
    for _ in range(3):
        with suppress(BaseException):
            hang()


def rows_of(run: Run) -> dict[str, list[Any]]:
    return {name: list(run.recorder.rows(name)) for name in run.recorder.tables}


@pytest.mark.parametrize("turns", [hang, hang_on, lambda: sum(range(10**8))])
def test_a_hanging_strategy_is_silenced_and_named(turns: Callable[[], Any]) -> None:
    began_s = time.process_time()
    run = flown(TurnsStrategy(turns), LIMIT)
    assert time.process_time() - began_s < 30.0
    rows = run.recorder.rows("silenced")
    assert [row[1:] for row in rows] == [("AUV01", "Operational", "negotiate")]
    fallen_s = rows[0][0]
    assert summary(run)["n_silenced"] == 1
    senders = {sender for _, sent_s, sender, *_ in run.recorder.packets if sent_s > fallen_s}
    assert "AUV00" in senders
    assert "AUV01" not in senders


def test_garbage_collection_is_off_during_a_decision() -> None:
    collected: list[bool] = []
    flown(TurnsStrategy(lambda: collected.append(gc.isenabled())), LIMIT)
    assert collected == [False]
    assert gc.isenabled()


def test_a_time_limit_that_is_kept_changes_no_byte() -> None:
    limited, free = flown(Cbba(), LIMIT), flown(Cbba())
    assert limited.recorder.rows("silenced") == []
    assert {name: rows for name, rows in rows_of(limited).items() if name != "silenced"} == rows_of(free)
    assert "n_silenced" not in summary(free)


def test_a_file_opened_for_writing_in_a_decision_is_named_and_not_written(tmp_path: Path) -> None:
    file = tmp_path / "notes"
    with pytest.raises(
        PluginError, match=r"strategy turns: negotiate opened '.*notes' for writing; allowed: reading files"
    ):
        flown(TurnsStrategy(lambda: file.write_text("x")), LIMIT)
    assert not file.exists()
    file.write_text("between decisions anybody may write")
    assert flown(TurnsStrategy(file.read_text), LIMIT).recorder.rows("silenced") == []
