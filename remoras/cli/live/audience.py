"""Those who watch a live run, and what is new for them."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from missions.runs.underway import Underway, Watch
from visualisation.replay import Payload

LEAST_GAP_S = 0.4
"""Watchers get what is new no more often than this."""
GREATEST_SHARE = 0.1
"""Of the time, so much goes at most into what watchers get while the run goes on."""
MOST_BLOCKS = 100
"""A watcher that is behind by more blocks gets all anew."""


@dataclass(eq=False)
class Watcher:
    """Somebody who watches: ``blocks`` has what is new since the last look, see ``visualisation.replay.Payload``."""

    blocks: deque[bytes] = field(default_factory=deque)


class Audience:
    """All who watch. Nothing is made for nobody.

    Args:
        changed: is told when somebody comes; its lock guards what is here.
    """

    def __init__(self, changed: threading.Condition) -> None:
        self._changed = changed
        self._watchers: list[Watcher] = []
        self._lack_all: list[Watcher] = []  # those of them who get the run from its start; the others get it too
        self._source: tuple[Watch, Payload] | None = None
        self._has_news = False
        self._told_at_s = self._gap_s = 0.0

    def __len__(self) -> int:
        return len(self._watchers)

    def watch(self) -> Watcher:
        """A new watcher, who gets the run from its start."""
        watcher = Watcher()
        with self._changed:
            self._watchers.append(watcher)
            self._lack_all.append(watcher)
            self._changed.notify_all()
        return watcher

    def leave(self, watcher: Watcher) -> None:
        """Forget a watcher."""
        with self._changed:
            self._watchers.remove(watcher)

    def begin(self) -> None:
        """Another run begins: all get it from its start."""
        self._lack_all, self._source, self._has_news = list(self._watchers), None, False

    def note(self, is_last: bool = False) -> None:
        """There are news; the last of a run do not wait."""
        self._has_news = True
        if is_last:
            self._gap_s = 0.0

    def until_s(self) -> float | None:
        """Time (s) until watchers are due to get what is new; None if nothing is."""
        if not self._watchers:
            return None
        if self._lack_all:
            return 0.0
        return self._told_at_s + self._gap_s - time.monotonic() if self._has_news else None

    def tell(self, underway: Underway, summary: Mapping[str, Any]) -> None:
        """Hand what is new to the watchers; if one of them lacks all, all get all.

        Args:
            underway: the run.
            summary: its figures as they are now.

        Raises:
            Exception: rows of a mission's own do not fit their table; the run may go on.
        """
        began = time.perf_counter()
        with self._changed:
            is_anew = bool(self._lack_all) or self._source is None
            watchers, self._lack_all, self._has_news = list(self._watchers), [], False
        if is_anew or self._source is None:
            mission, strategy = underway.setup.mission, underway.setup.strategy
            payload = Payload(mission.places, mission.jobs.values(), strategy.declaration.communicates)
            self._source = (Watch(underway), payload)
        watch, payload = self._source
        try:
            block = payload.block(watch.news(summary))
        except Exception:
            self._source = None
            raise
        with self._changed:
            for watcher in watchers:
                if is_anew:
                    watcher.blocks.clear()
                watcher.blocks.append(block)
                if len(watcher.blocks) > MOST_BLOCKS and watcher in self._watchers:
                    watcher.blocks.clear()
                    self._lack_all.append(watcher)
        self._told_at_s = time.monotonic()
        self._gap_s = max(LEAST_GAP_S, (time.perf_counter() - began) / GREATEST_SHARE)
