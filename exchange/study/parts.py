"""The trials of a policy study in parts that fit into memory, played by threads and added up in order."""

import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from exchange.ack import Acknowledgement
from exchange.policies import AckPolicy
from exchange.study import trial
from exchange.study.compiler import SlotLoop
from exchange.study.estimates import Moments, moments
from exchange.study.parameters import BOUND
from exchange.study.trial import Floats, Ints, Load, PolicyRules
from exchange.study.trials import layouts_of

TRIALS_AT_ONCE = 1000
"""Memory does not depend on the number of trials, but on this."""

REMEMBERED_WORDS = 400
"""Words of some slots of a trial whose losses are kept for the next policy; later ones are drawn again."""


@dataclass(frozen=True)
class TrialPlan:
    """All trials of all policies, the baseline first, at all settings: one matrix of loss probabilities each."""

    n_nodes: int
    policies: tuple[AckPolicy, ...]
    carrier_evidence: bool
    matrices: tuple[Floats, ...]
    load: Load
    seed: int
    n_trials: int

    @property
    def parts(self) -> "Iterator[TrialBatch]":
        """The trials in the order in which they are added up."""
        for setting in range(len(self.matrices)):
            for first_trial in range(0, self.n_trials, TRIALS_AT_ONCE):
                yield TrialBatch(setting, first_trial, min(TRIALS_AT_ONCE, self.n_trials - first_trial))

    @property
    def n_parts(self) -> int:
        """Number of parts."""
        return len(self.matrices) * -(-self.n_trials // TRIALS_AT_ONCE)


class TrialBatch(NamedTuple):
    """Trials to be played in one go, of all policies at one setting."""

    setting: int
    first_trial: int
    n_trials: int


@dataclass(slots=True)
class Tally:
    """Sums over the trials of one policy at one setting; moments of the quantities of which there are means."""

    moments: Moments
    censored: Ints
    false_beliefs: int
    slots: int
    cpu_s: float

    def add(self, other: "Tally") -> None:
        """Take in the sums of more trials."""
        self.moments += other.moments
        self.censored += other.censored
        self.false_beliefs += other.false_beliefs
        self.slots += other.slots
        self.cpu_s += other.cpu_s


SlotLoops = Mapping[Acknowledgement, SlotLoop]
"""The slot loop of each acknowledgement, with the kind built in."""


def play_all(plan: TrialPlan, loops: SlotLoops, jobs: int, progress: Callable[[int, int], None]) -> list[list[Tally]]:
    """Play the whole plan; returns the tallies of each setting, in the order of the policies.

    Args:
        plan: all trials.
        loops: the slot loop of every acknowledgement in the plan.
        jobs: threads, for loops of machine code; Python would run in one at a time, and none heeds an interruption.
        progress: is told how many parts of how many are done.
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
    """Setting and tallies of each part in order, so that sums do not depend on the threads; a few are played ahead."""
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
    """Play one part; every policy meets the same losses."""
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
    """The outcomes of a policy in the trials of a part, shape (n_trials, N_QUANTITIES, 3)."""
    kind, knows_all = policy.acknowledgement, policy == BOUND
    rules = PolicyRules(policy.repeat or knows_all, plan.carrier_evidence, plan.n_nodes, knows_all, kind.codes)
    layouts, outcomes = layouts_of(kind, plan.n_nodes), np.empty((part.n_trials, trial.N_QUANTITIES, 3), np.int64)
    loop(layouts, rules, plan.load, plan.matrices[part.setting], plan.seed, part.first_trial, received, outcomes)
    return outcomes
