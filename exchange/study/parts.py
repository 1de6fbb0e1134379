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
from exchange.study.estimates import Moments, moments
from exchange.study.montecarlo import NOT_DRAWN
from exchange.study.trial import Floats, Ints, Load, PolicyRules

TRIALS_AT_ONCE = 500
"""Memory does not depend on the number of trials, but on this."""

REMEMBERED_SLOTS = 250
"""Slots of a trial whose losses are kept for the next policy; later ones are drawn again."""


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
    def n_words(self) -> int:
        """Words in a set of items."""
        return -(-self.load.n_sources * self.load.columns_per_source // trial.WORD_BITS)

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
    """Sums over the trials of one policy at one setting."""

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


MachineCodes = Mapping[Acknowledgement, Callable[..., None]]
"""The slot loop of each acknowledgement: `montecarlo.run_trials` with the kind built in."""


def play_all(
    plan: TrialPlan, machine_codes: MachineCodes, jobs: int, progress: Callable[[int, int], None]
) -> list[list[Tally]]:
    """Play the whole plan; returns the tallies of each setting, in the order of the policies.

    Args:
        plan: all trials.
        machine_codes: the slot loop of every acknowledgement in the plan.
        jobs: threads.
        progress: is told how many parts of how many are done.
    """
    tallies: list[list[Tally]] = [[] for _ in plan.matrices]
    with ThreadPoolExecutor(jobs) as pool:
        for done, (setting, of_part) in enumerate(_in_order(plan, machine_codes, pool, 2 * jobs), start=1):
            if not tallies[setting]:
                tallies[setting] = of_part
            else:
                for tally, more in zip(tallies[setting], of_part, strict=True):
                    tally.add(more)
            progress(done, plan.n_parts)
    return tallies


def _in_order(
    plan: TrialPlan, machine_codes: MachineCodes, pool: ThreadPoolExecutor, ahead: int
) -> Iterator[tuple[int, list[Tally]]]:
    """Setting and tallies of each part in order, so that sums do not depend on the pool; at most so many ahead."""
    play = partial(_play, plan, machine_codes)
    pending: deque[tuple[int, Future[list[Tally]]]] = deque()
    for part in plan.parts:
        pending.append((part.setting, pool.submit(play, part)))
        if len(pending) > ahead:
            setting, future = pending.popleft()
            yield setting, future.result()
    for setting, future in pending:
        yield setting, future.result()


def _play(plan: TrialPlan, machine_codes: MachineCodes, part: TrialBatch) -> list[Tally]:
    """Play one part; every policy meets the same losses."""
    received = np.full((part.n_trials, min(REMEMBERED_SLOTS, plan.load.max_slots)), NOT_DRAWN, np.int64)
    baseline = np.zeros((part.n_trials, trial.N_QUANTITIES, 3), np.int64)
    tallies = []
    for policy in plan.policies:
        rules = PolicyRules(policy.repeat, plan.carrier_evidence, plan.n_nodes, plan.n_words)
        run_trials = machine_codes[policy.acknowledgement]
        outcomes = np.zeros_like(baseline)
        began_s = time.thread_time()
        run_trials(rules, plan.load, plan.matrices[part.setting], plan.seed, part.first_trial, received, outcomes)
        cpu_s = time.thread_time() - began_s
        if policy == plan.policies[0]:
            baseline = outcomes
        totals = outcomes.sum(axis=0)
        tallies.append(
            Tally(
                moments(outcomes, baseline),
                totals[: trial.N_STAGES, trial.CENSORED],
                int(totals[trial.FALSE_BELIEFS, trial.SUM]),
                int(totals[trial.SLOTS, trial.SUM]),
                cpu_s,
            )
        )
    return tallies
