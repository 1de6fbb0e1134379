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
from exchange.policies import AckPolicy, header_bits
from exchange.study import trial
from exchange.study.bound import BOUND
from exchange.study.compiler import Form, SlotLoop
from exchange.study.estimates import Moments, moments
from exchange.study.montecarlo import NOT_DRAWN
from exchange.study.trial import Floats, Ints, Load, PolicyRules

TRIALS_AT_ONCE = 1000
"""Memory does not depend on the number of trials, but on this."""

REMEMBERED_SLOTS = 250
"""Slots of a trial whose losses are kept for the next policy; later ones are drawn again."""
REMEMBERED_WORDS = 400
"""The same where bits are sliced, in words of some slots."""


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
    def forms(self) -> dict[Acknowledgement, Form]:
        """What the slot loop of each acknowledgement has to do."""
        load, forms = self.load, {}
        for policy in self.policies:
            kind = policy.acknowledgement
            is_single = load.rate == 0.0 and load.n_sources * load.columns_per_source == 1
            fits = header_bits(policy, self.n_nodes) + load.item_bits <= load.capacity_bits
            narrow_or_wide = Form.NARROW if self.n_words == 1 else Form.WIDE
            usual = Form.SLICED if is_single and fits and kind.bit_sliced else narrow_or_wide
            forms[kind] = Form.STATING if kind.states else usual
        return forms

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
    received: dict[bool, Ints] = {}
    baseline = np.empty(0, np.int64)
    n_estimated = trial.IN_FLIGHT if plan.load.rate == 0.0 else trial.FALSE_BELIEFS
    tallies = []
    for policy in plan.policies:
        loop = loops[policy.acknowledgement]
        if loop.is_sliced not in received:
            received[loop.is_sliced] = memory_of(plan, loop, part)
        began_s = time.thread_time()
        outcomes = play(plan, policy, loop, part, received[loop.is_sliced])
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


def memory_of(plan: TrialPlan, loop: SlotLoop, part: TrialBatch) -> Ints:
    """Memory of who received what in the trials of a part, as the slot loop takes it."""
    if loop.is_sliced:
        return np.zeros((REMEMBERED_WORDS, part.n_trials), np.int64)
    return np.full((part.n_trials, min(REMEMBERED_SLOTS, plan.load.max_slots)), NOT_DRAWN, np.int64)


def play(plan: TrialPlan, policy: AckPolicy, loop: SlotLoop, part: TrialBatch, received: Ints) -> Ints:
    """The outcomes of a policy in the trials of a part, shape (n_trials, N_QUANTITIES, 3)."""
    knows_all = policy == BOUND
    repeat, codes = policy.repeat or knows_all, policy.acknowledgement.codes
    rules = PolicyRules(repeat, plan.carrier_evidence, plan.n_nodes, plan.n_words, 1, knows_all, codes)
    outcomes = np.empty((part.n_trials, trial.N_QUANTITIES, 3), np.int64)
    loop.run(rules, plan.load, plan.matrices[part.setting], plan.seed, part.first_trial, received, outcomes)
    return outcomes
