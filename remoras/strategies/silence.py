"""What several strategies share: how much a vehicle holds at a time, and when it is out of reach."""

from __future__ import annotations

from collections.abc import Iterable

from pydantic import Field

from remoras.strategy import Situation

QUEUE = Field(ge=1, le=16, description="most jobs that a vehicle holds, the one it is at included")
SILENCE = Field(ge=1, le=10_000, description="TDMA frames without a word after which a vehicle is out of reach")


class Silence:
    """Who has not been heard for too long."""

    def __init__(self, me: str, rounds: int) -> None:
        self._me = me
        self._rounds = rounds
        self._heard: dict[str, tuple[float | None, int]] = {}

    def out_of_reach(self, names: Iterable[str], situation: Situation) -> set[str]:
        """Those of ``names`` that no packet has come from for as many rounds as allowed."""
        gone = set()
        for name in names:
            heard_s = situation.heard_s.get(name)
            if name not in self._heard or self._heard[name][0] != heard_s:
                self._heard[name] = heard_s, situation.round
            if name != self._me and situation.round - self._heard[name][1] >= self._rounds:
                gone.add(name)
        return gone
