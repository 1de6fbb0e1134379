"""Batches of trials that fit into memory, run by threads and summed in a fixed order."""

import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from exchange.policy.acknowledgement import Acknowledgement
from exchange.policy.policies import AckPolicy
from exchange.study import trial
from exchange.study.compiler import SlotLoop
from exchange.study.estimates import Moments, moments
from exchange.study.parameters import BOUND
from exchange.study.trial import Floats, Ints, Load, PolicyRules
from exchange.study.trials import layouts_of

TRIALS_AT_ONCE = 1000
"""Trials of a batch; memory grows with it, not with the number of trials."""

REMEMBERED_WORDS = 400
"""Words of loss draws per trial cached for the next policy; later ones are drawn again."""


@dataclass(frozen=True)
class TrialPlan:
    """All trials of all policies (baseline first) at all settings: a loss matrix each."""

    n_nodes: int
    policies: tuple[AckPolicy, ...]
    carrier_evidence: bool
    matrices: tuple[Floats, ...]
    load: Load
    seed: int
    n_trials: int

    @property
    def parts(self) -> "Iterator[TrialBatch]":
        """Batches in the order of summation."""
        for setting in range(len(self.matrices)):
            for first_trial in range(0, self.n_trials, TRIALS_AT_ONCE):
                yield TrialBatch(setting, first_trial, min(TRIALS_AT_ONCE, self.n_trials - first_trial))

    @property
    def n_parts(self) -> int:
        """Number of batches."""
        return len(self.matrices) * -(-self.n_trials // TRIALS_AT_ONCE)


class TrialBatch(NamedTuple):
    """Batch of trials of all policies at one setting."""

    setting: int
    first_trial: int
    n_trials: int


@dataclass(slots=True)
class Tally:
    """Sums over the trials of one policy at one setting; moments of quantities with means."""

    moments: Moments
    censored: Ints
    false_beliefs: int
    slots: int
    cpu_s: float

    def add(self, other: "Tally") -> None:
        """Add the sums of more trials."""
        self.moments += other.moments
        self.censored += other.censored
        self.false_beliefs += other.false_beliefs
        self.slots += other.slots
        self.cpu_s += other.cpu_s


SlotLoops = Mapping[Acknowledgement, SlotLoop]
"""Slot loop by acknowledgement."""


def play_all(plan: TrialPlan, loops: SlotLoops, jobs: int, progress: Callable[[int, int], None]) -> list[list[Tally]]:
    """Run the plan on ``jobs`` threads (1 for Python loops); return tallies per setting, policy.

    ``progress`` is called with the numbers of batches done and in total.
    """
    tallies: list[list[Tally]] = [[] for _ in plan.matrices]
    for done, (setting, of_part) in enumerate(_in_order(plan, loops, jobs), start=1):
        if not tallies[setting]:
            tallies[setting] = of_part
        else:
            for tally, more in zip(tallies[setting], of_part, strict=True):
                tally.add(more)
        progress(done, plan.n_parts)
    return tallies


def _in_order(plan: TrialPlan, loops: SlotLoops, jobs: int) -> Iterator[tuple[int, list[Tally]]]:
    """Yield setting and tallies of each batch in order, so that sums do not depend on threads."""
    play = partial(_play, plan, loops)
    if jobs == 1:
        yield from ((part.setting, play(part)) for part in plan.parts)
        return
    pending: deque[tuple[int, Future[list[Tally]]]] = deque()
    with ThreadPoolExecutor(jobs) as pool:
        for part in plan.parts:
            pending.append((part.setting, pool.submit(play, part)))
            if len(pending) > 2 * jobs:
                setting, future = pending.popleft()
                yield setting, future.result()
        for setting, future in pending:
            yield setting, future.result()


def _play(plan: TrialPlan, loops: SlotLoops, part: TrialBatch) -> list[Tally]:
    received = np.zeros((REMEMBERED_WORDS, part.n_trials), np.int64)
    baseline = np.empty(0, np.int64)
    n_estimated = trial.IN_FLIGHT if plan.load.rate == 0.0 else trial.FALSE_BELIEFS
    tallies = []
    for policy in plan.policies:
        loop = loops[policy.acknowledgement]
        began_s = time.thread_time()
        outcomes = play(plan, policy, loop, part, received)
        cpu_s = time.thread_time() - began_s
        if policy == plan.policies[0]:
            baseline = outcomes
        totals = outcomes.sum(axis=0)
        tallies.append(
            Tally(
                moments(outcomes[:, :n_estimated], baseline[:, :n_estimated]),
                totals[: trial.N_STAGES, trial.CENSORED],
                int(totals[trial.FALSE_BELIEFS, trial.SUM]),
                int(totals[trial.SLOTS, trial.SUM]),
                cpu_s,
            )
        )
    return tallies


def play(plan: TrialPlan, policy: AckPolicy, loop: SlotLoop, part: TrialBatch, received: Ints) -> Ints:
    """Return the outcomes of a policy in a batch, shape (n_trials, N_QUANTITIES, 3)."""
    kind, knows_all = policy.acknowledgement, policy == BOUND
    rules = PolicyRules(policy.repeat or knows_all, plan.carrier_evidence, plan.n_nodes, knows_all, kind.codes)
    layouts, outcomes = layouts_of(kind, plan.n_nodes), np.empty((part.n_trials, trial.N_QUANTITIES, 3), np.int64)
    loop(layouts, rules, plan.load, plan.matrices[part.setting], plan.seed, part.first_trial, received, outcomes)
    return outcomes
