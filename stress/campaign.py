"""A campaign: many schedules, drawn from seeds, each run once; what was broken is shrunk."""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from functools import lru_cache, partial
from itertools import groupby

from missions.errors import ConfigurationError, ConfigurationFault
from missions.scenarios import load
from missions.sweeps.pool import SupervisedPool, WorkerDied
from stress.configurations import baseline, first_of, plan_for_block
from stress.drawing import Plan, schedule_of
from stress.invariants.ending import NoException, SameDigest
from stress.invariants.seam import Invariant
from stress.kinds import FOR_GOOD
from stress.schedule import Schedule, overrides
from stress.shipped import invariants_of
from stress.shrinking import Shrunk, shrunk
from stress.trial import Broken, Outcome, repeated, run_trial

TWICE_EVERY = 10
"""One seed in so many is run twice, to see whether both runs give the same."""
LONGER = 4.0
"""How many times as long as the run without faults one seed may take."""


@dataclass
class InvariantTally:
    """An invariant under a kind: runs in which it held though the kind had happened, and seeds that broke it."""

    held: int = 0
    broken: list[int] = field(default_factory=list)


@dataclass
class Report:
    """What came of a campaign.

    Attributes:
        plan: from which schedules were drawn; outcomes: by seed; shrunk: the first breach of each invariant, by name.
        invariants: names in the order of tables.
        wall_s: what it took on this machine.
    """

    plan: Plan
    invariants: tuple[str, ...]
    outcomes: list[Outcome]
    shrunk: dict[str, Shrunk] = field(default_factory=dict)
    wall_s: float = 0.0

    @property
    def broken(self) -> list[Outcome]:
        """Outcomes with a breach."""
        return [outcome for outcome in self.outcomes if outcome.broken is not None]

    @property
    def happened(self) -> Counter[str]:
        """Events of each kind in all runs."""
        return sum((Counter(outcome.happened) for outcome in self.outcomes), Counter())

    @property
    def recovered(self) -> Counter[str]:
        """Ways of recovery in all runs."""
        return sum((Counter(outcome.recovered) for outcome in self.outcomes), Counter())

    def table(self) -> dict[tuple[str, str], InvariantTally]:
        """Tallys by invariant and kind; a tally that is not there was not exercised."""
        found: dict[tuple[str, str], InvariantTally] = {}
        for outcome in self.outcomes:
            if outcome.broken is None:
                for name in outcome.judged:
                    for kind in kinds_of(outcome):
                        found.setdefault((name, kind), InvariantTally()).held += 1
            else:
                name = outcome.broken.invariant
                small = self.shrunk.get(name)
                is_own = small is not None and small.schedule.stress.seed == outcome.seed
                kinds = small.schedule.kinds if small is not None and is_own else kinds_of(outcome)
                for kind in kinds:
                    found.setdefault((name, kind), InvariantTally()).broken.append(outcome.seed)
        return found


def kinds_of(outcome: Outcome) -> set[str]:
    """Kinds that have changed anything in a run; those of which a fault stays for good by themselves."""
    staying = {fault.kind for fault in outcome.schedule.permanent}
    return {kind + FOR_GOOD if kind in staying else kind for kind in outcome.happened if outcome.happened[kind]}


def judge(schedule: Schedule, added: tuple[str, ...] = (), twice: bool = False) -> Outcome:
    """Run one schedule with all invariants of its scenario; called in processes of their own, too.

    Args:
        schedule: what befalls the fleet.
        added: invariants that a user names.
        twice: run it twice and compare.
    """
    invariants = _invariants(schedule.stress.scenario, tuple(schedule.overrides), added)
    return (repeated if twice else run_trial)(schedule, invariants)


@lru_cache(maxsize=64)
def _invariants(
    scenario: str, changes: tuple[tuple[str, str], ...], added: tuple[str, ...]
) -> tuple[type[Invariant], ...]:
    return invariants_of(load(scenario, changes), added)


def campaign(
    plan: Plan,
    seeds: Iterable[int],
    added: tuple[str, ...] = (),
    jobs: int = 1,
    limit_s: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Report:
    """Run the schedules of seeds, and shrink the first breach of each invariant.

    Where settings are drawn, seeds come in blocks of one configuration, whose first is run without faults. If that one
    breaks something, the others of its block are left out: they have nothing to be measured by.

    Args:
        plan: from which schedules are drawn.
        seeds: of schedules.
        added: invariants that a user names.
        jobs: processes.
        limit_s: no seed is begun after this time (s).
        progress: is told how many seeds are done.

    Raises:
        ConfigurationError: an invariant raises; or the time is too short for one seed.
    """
    began = time.perf_counter()
    if limit_s is not None and limit_s < LONGER * plan.cost_s:
        allowed = f"one seed takes up to {LONGER * plan.cost_s:.1f} s here: give more"
        raise ConfigurationError("remoras stress", [ConfigurationFault("--time", f"{limit_s:g} s", allowed)])
    names = [
        invariant.name
        for invariant in invariants_of(load(plan.scenario, overrides(plan.strategy, plan.settings)), added)
    ]
    report = Report(plan, tuple(str(name) for name in names), [])

    def begun_in_time() -> Iterator[int]:
        for seed in seeds:
            if limit_s is not None and time.perf_counter() - began > limit_s:
                return
            yield seed

    for outcome in _outcomes(plan, begun_in_time(), added, jobs):
        report.outcomes.append(outcome)
        if progress is not None:
            progress(len(report.outcomes))
    report.outcomes.sort(key=lambda outcome: outcome.seed)
    for outcome in report.broken:
        broken = outcome.broken
        if broken is not None and broken.invariant not in report.shrunk:
            again = partial(judge, added=added, twice=broken.invariant == SameDigest.name)
            report.shrunk[broken.invariant] = shrunk(outcome, again)
    report.wall_s = time.perf_counter() - began
    return report


def _outcomes(plan: Plan, seeds: Iterator[int], added: tuple[str, ...], jobs: int) -> Iterator[Outcome]:
    """What comes of each seed, in the order in which they finish."""
    work = _Work(plan, seeds)
    first = work.next()
    if first is None:
        return
    second = work.next() if jobs > 1 else None
    if second is None:
        schedule: Schedule | None = first
        while schedule is not None:
            yield from work.told(judge(schedule, added, is_twice(schedule)))
            schedule = work.next()
        return
    with SupervisedPool(jobs, "stress.campaign") as pool:
        under_way: dict[Future[Outcome], Schedule] = {}

        def begin(schedule: Schedule | None) -> None:
            if schedule is not None:
                under_way[pool.submit(judge, schedule, added, is_twice(schedule))] = schedule

        try:
            begin(first)
            begin(second)
            while True:  # what is done may be what others wait for: the first of the last block, say
                while len(under_way) < 2 * jobs and (schedule := work.next()) is not None:
                    begin(schedule)
                if not under_way:
                    return
                done, _ = wait(under_way, return_when=FIRST_COMPLETED)
                for future in sorted(done, key=lambda future: under_way[future].stress.seed):
                    yield from work.told(_result(future, under_way.pop(future)))
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def is_twice(schedule: Schedule) -> bool:
    """True for schedules that are run twice."""
    return schedule.stress.seed % TWICE_EVERY == 0


class _Work:
    """Schedules that are to be run: those of a block once it is known what came of its first.

    Args:
        plan: from which they are drawn.
        seeds: in order.
    """

    def __init__(self, plan: Plan, seeds: Iterator[int]) -> None:
        self._plan = plan
        self._seeds = seeds
        self._blocks = groupby(seeds, key=first_of)
        self._ready: deque[Schedule] = deque()
        self._waiting: dict[int, list[int]] = {}

    def next(self) -> Schedule | None:
        """The next that can be run; None if none can be for now."""
        if self._ready:
            return self._ready.popleft()
        if not self._plan.draws:
            seed = next(self._seeds, None)
            return None if seed is None else schedule_of(self._plan, seed)
        first, block = next(self._blocks, (0, None))
        if block is None:
            return None
        self._waiting[first] = list(block)
        return baseline(self._plan, first)

    def told(self, outcome: Outcome) -> Iterator[Outcome]:
        """What a schedule that was run counts for; the others of its block can be run from now on."""
        if outcome.seed not in self._waiting:
            yield outcome
            return
        seeds = self._waiting.pop(outcome.seed)
        if outcome.seed in seeds or outcome.broken is not None:
            yield outcome
        if outcome.broken is None:
            plan = plan_for_block(self._plan, outcome)
            self._ready.extend(schedule_of(plan, seed) for seed in seeds if seed != outcome.seed)


def _result(future: Future[Outcome], schedule: Schedule) -> Outcome:
    """What came of a seed; a process that died broke the law that nothing leaves a vehicle."""
    try:
        return future.result()
    except WorkerDied as error:
        broken = Broken(NoException.name, 0.0, str(error))
        return Outcome(schedule, broken, (NoException.name,), {}, {}, False, 0.0, "", 0.0)
