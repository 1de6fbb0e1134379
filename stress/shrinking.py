"""Shrinking: the fewest events, settings, vehicles and seconds by which an invariant is still broken."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from missions.errors import ConfigurationError
from stress.schedule import Schedule, StressFault
from stress.trial import Broken, Outcome

MOST_RUNS = 60
"""Runs that the search may take."""
SHORTEST_S = 20.0
"""Faults are not made shorter than twice this."""


@dataclass(frozen=True)
class Shrunk:
    """A short schedule that breaks an invariant.

    Attributes:
        schedule: the shortest that was found; broken: what it breaks; n_runs: that the search took.
        digest: of its run.
    """

    schedule: Schedule
    broken: Broken
    n_runs: int
    digest: str


class _Search:
    def __init__(self, outcome: Outcome, broken: Broken, trial: Callable[[Schedule], Outcome]) -> None:
        self.best, self.broken, self.digest = outcome.schedule, broken, outcome.digest
        self.n_runs = 0
        self._trial = trial

    def takes(self, schedule: Schedule) -> bool:
        """Run a schedule; it is the best from now on if it breaks the same invariant."""
        if self.n_runs >= MOST_RUNS or schedule == self.best:
            return False
        self.n_runs += 1
        try:
            outcome = self._trial(schedule)
        except ConfigurationError:
            return False  # the scenario declares faults that come later than it would end
        if outcome.broken is None or outcome.broken.invariant != self.broken.invariant:
            return False
        self.best, self.broken, self.digest = schedule, outcome.broken, outcome.digest
        return True

    def leave_out(self) -> None:
        """Leave out halves of the faults, then smaller parts, as long as that goes on (Zeller, Hildebrandt 2002)."""
        size = max(1, len(self.best.fault) // 2)
        while True:
            start, left_out = 0, False
            while start < len(self.best.fault):
                faults = self.best.fault
                if self.takes(self.best.with_faults((*faults[:start], *faults[start + size :]))):
                    left_out = True
                else:
                    start += size
            if size == 1 and not left_out:
                return
            size = max(1, size // 2)

    def leave_out_settings(self) -> None:
        """Put settings back to those of the scenario, all at once, then one by one as long as that goes on."""
        if self.best.settings and self._takes_settings({}):
            return
        goes_on = True
        while goes_on:
            goes_on = False
            for name in self.best.settings:
                left = {one: lines for one, lines in self.best.settings.items() if one != name}
                goes_on = self._takes_settings(left) or goes_on

    def _takes_settings(self, settings: dict[str, tuple[str, ...]]) -> bool:
        try:
            return self.takes(self.best.with_settings(settings))
        except ConfigurationError:
            return False  # the scenario does not allow one without the other

    def simplify(self) -> None:
        """Replace single faults by simpler ones, as long as that goes on."""
        index = 0
        while index < len(self.best.fault):
            faults = self.best.fault
            simpler = _simpler(faults[index])
            if not any(self.takes(self.best.with_faults((*faults[:index], s, *faults[index + 1 :]))) for s in simpler):
                index += 1
            if self.n_runs >= MOST_RUNS:
                return

    def shorten(self) -> None:
        """Let the run end soon after what is broken, and heal when the last fault is over."""
        about = self.best.stress
        over_s = max((fault.until_s or fault.at_s for fault in self.best.fault), default=about.heal_s)
        if 0.0 < over_s < about.heal_s:
            healed = about.model_copy(update={"heal_s": over_s, "bound_s": about.bound_s - (about.heal_s - over_s)})
            self.takes(self.best.model_copy(update={"stress": healed}))
        about = self.best.stress
        ended_s = float(int(self.broken.time_s) + 2)
        if ended_s < about.bound_s and all(fault.at_s < ended_s for fault in self.best.fault):
            cut = about.model_copy(update={"bound_s": ended_s, "must_finish": False})
            self.takes(self.best.model_copy(update={"stress": cut}))


def _simpler(fault: StressFault) -> Iterator[StressFault]:
    """Faults that are simpler than one: half as long, weaker, of one link instead of all."""
    if fault.until_s is not None and fault.until_s - fault.at_s > 2.0 * SHORTEST_S:
        middle_s = round((fault.at_s + fault.until_s) / 2.0, 1)
        yield fault.model_copy(update={"until_s": middle_s})
        yield fault.model_copy(update={"at_s": middle_s})
    if fault.share < 1.0:
        yield fault.model_copy(update={"share": 1.0})
    if fault.bits > 1:
        yield fault.model_copy(update={"bits": 1})


def shrunk(outcome: Outcome, trial: Callable[[Schedule], Outcome]) -> Shrunk:
    """Search for the shortest schedule that breaks what one did.

    Args:
        outcome: of a schedule that broke an invariant.
        trial: runs a schedule.
    """
    if outcome.broken is None:
        raise ValueError("nothing is broken: there is nothing to shrink")
    search = _Search(outcome, outcome.broken, trial)
    search.leave_out()
    search.leave_out_settings()
    while search.n_runs < MOST_RUNS:  # a setting, a shorter fault, or an earlier end, may have made another needless
        fewest = search.best
        search.leave_out()
        search.shorten()
        search.simplify()
        search.leave_out_settings()
        if search.best == fewest:
            break
    return Shrunk(search.best, search.broken, search.n_runs, search.digest)
