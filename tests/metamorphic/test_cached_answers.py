"""Cached answers equal those computed every time: here each is recomputed, with equal tables.

Facts that nobody in the social layer rests on are not considered, a decision under which nothing changed is not taken
again, nor is one searched for by the same motivations, and work is kept until what is known of it changes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import pytest
from recorded import flown

from missions.runs.run import Run
from remoras.executive.decision import Choice
from remoras.executive.layer import Decision, ExecutiveLayer
from remoras.social.layer import SocialLayer
from remoras.work import Work
from worldmodel import Change


def made() -> Run:
    settings = "strategy.name=status-broadcast", "channel.per=0.2", "vehicle.AUV01.energy_j=60000"
    return flown("mapping-rendezvous", *settings, seed=11)


def ask_every_time(monkeypatch: pytest.MonkeyPatch, n_spared: list[int]) -> None:
    """Disable the caches, and count their hits."""
    is_concerned, decide, best = SocialLayer._is_concerned, ExecutiveLayer.decide, Choice.best

    def concerned(self: SocialLayer, changes: Sequence[Change]) -> bool:
        n_spared[0] += not is_concerned(self, changes)
        return True

    def decide_anew(self: ExecutiveLayer, *args: Any) -> Decision:
        n_spared[1] += self._is_weighed
        self._is_weighed = False
        return decide(self, *args)

    def best_anew(self: Choice, motivations: Sequence[float]) -> tuple[int, ...]:
        n_spared[2] += self.holds(motivations)
        self._holds_within, self._found_at = 0.0, [math.nan] * len(motivations)
        return best(self, motivations)

    def seen_anew(self: Work, positions_m: Mapping[str, Any], now_s: float) -> Work:
        n_spared[3] += 1
        fields = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return Work(**fields | {"positions_m": positions_m, "now_s": now_s})

    monkeypatch.setattr(SocialLayer, "_is_concerned", concerned)
    monkeypatch.setattr(ExecutiveLayer, "decide", decide_anew)
    monkeypatch.setattr(Choice, "best", best_anew)
    monkeypatch.setattr(Work, "seen", seen_anew)


@pytest.mark.slow
def test_cached_answers_change_no_table(monkeypatch: pytest.MonkeyPatch) -> None:
    kept, n_spared = made(), [0, 0, 0, 0]
    ask_every_time(monkeypatch, n_spared)
    asked = made()
    for name in kept.recorder.tables:
        assert asked.recorder.rows(name) == kept.recorder.rows(name), name
    assert asked.milestones == kept.milestones
    assert min(n_spared[:3]) > 100  # there was something to be spared
