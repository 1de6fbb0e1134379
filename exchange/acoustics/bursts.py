"""Bursts: which losses of ``gilbert-elliott`` make a recorded trace most likely, and whether it has bursts at all.

A link is good or bad, and loses packets with a probability of its state; from one packet to the next it may change
(Gilbert 1960; Elliott 1963). States are hidden, so the parameters are found by expectation and maximisation with the
forward-backward recursion (Rabiner 1989, sections III and V). They step from packet to packet, whatever time goes by;
``BurstModel.stepped`` says them for another step.

Four models, each a case of the next: losses that are independent; the plain Markov chain, in which a good link loses
nothing and a bad one all; that of Gilbert, in which a good one loses nothing; that of Gilbert and Elliott. Beside them
stand independent losses with a rate of each link. That a hidden chain is needed for lengths and correlation of bursts,
where a plain one gives no more than their mean, is what Tomasi et al. found in packets of JANUS (MILCOM 2010).

The first packet of a link, and one after a long gap, is in a stationary state: a row of transitions that are alike from
both states. So all pieces of a trace are one product of matrices, whose partial products are made by a scan of NumPy.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations, product
from statistics import median
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from exchange.acoustics.trace import Trace

Numbers = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

FEWEST = 100
"""Packets below which a trace is too short."""
FEWEST_RUNS = 10
"""Runs of lost packets below which there is no telling how long they are."""
LONG_GAP = 5.0
"""A gap of so many median steps begins a new piece: nothing is said of how the state went on."""
LEAST = 1e-9
"""Least probability of a change of state."""
FIRST_STEPS, MOST_STEPS = 12, 2000
"""Steps from each start, and from the best of them."""
MOST_SAMPLED, SPELLS_SAMPLED = 10_000, 10
"""Packets of a longer trace on which starts are tried; spells in which they are taken."""
CONVERGED = 1e-6
"""Gain of log-likelihood in three steps by which they end."""
SPELLS, CONTRASTS = (3.0, 20.0, 200.0), (0.9, 0.5)
"""Starts: packets of a mean bad spell; how far the rates of both states lie apart."""
EDGE, SPAN = 1e-4, 0.05
"""A probability so near to 0 or 1 is at its bound; steps of log-odds by which curvature is measured."""
LONG_SPELL = 0.1
"""Share of a piece from which on states last so long that they may be no states, but links or hours that differ."""
WARRANTED = 10.0
"""Difference of BIC from which on there is very strong evidence (Kass, Raftery 1995)."""


class NoBurstsError(ValueError):
    """A trace of which no bursts can be told; its text says why."""


class BurstModel(NamedTuple):
    """A chain of two states: the settings of the channel ``gilbert-elliott``, by packet.

    >>> model = BurstModel(0.1, 0.3, 0.0, 0.8)
    >>> round(model.bad_share, 3), round(model.loss_rate, 3), round(model.mean_burst, 3)
    (0.25, 0.2, 2.273)
    """

    p_good_to_bad: float
    p_bad_to_good: float
    per_good: float
    per_bad: float

    @property
    def bad_share(self) -> float:
        """Share of packets in the bad state."""
        return self.p_good_to_bad / (self.p_good_to_bad + self.p_bad_to_good)

    @property
    def loss_rate(self) -> float:
        """Share of packets that are lost."""
        return self.per_good + self.bad_share * (self.per_bad - self.per_good)

    @property
    def mean_burst(self) -> float:
        """Mean number of packets that are lost one after another."""
        return self.loss_rate / math.fsum(self._onset(lost=True))

    def run_shares(self, lost: bool, longest: int) -> Numbers:
        """Share of the runs of lost, or of received, packets that have 1, 2, ... ``longest`` of them at least."""
        good, bad = self._onset(lost)
        total, shares = good + bad, np.empty(longest)
        onward = self._chain * self._rates(lost)
        state = np.array([good, bad])
        for length in range(longest):
            shares[length] = state.sum() / total
            state = state @ onward
        return shares

    def stepped(self, share: float) -> BurstModel:
        """The same chain by steps that are ``share`` as long: what it has come to after 1 / ``share`` of them is alike.

        >>> [round(number, 4) for number in BurstModel(0.19, 0.57, 0.0, 1.0).stepped(0.5)]
        [0.1275, 0.3826, 0.0, 1.0]
        """
        changes = 1.0 - max(0.0, 1.0 - self.p_good_to_bad - self.p_bad_to_good) ** share
        return self._replace(p_good_to_bad=changes * self.bad_share, p_bad_to_good=changes * (1.0 - self.bad_share))

    @property
    def _chain(self) -> Numbers:
        """Probabilities from (good, bad) to (good, bad)."""
        p, q = self.p_good_to_bad, self.p_bad_to_good
        return np.array([[1.0 - p, p], [q, 1.0 - q]])

    def _rates(self, lost: bool) -> Numbers:
        """Probability of the outcome in (good, bad)."""
        rates = np.array([self.per_good, self.per_bad])
        return rates if lost else 1.0 - rates

    def _onset(self, lost: bool) -> tuple[float, float]:
        """Probability that a run begins with a packet, in (good, bad)."""
        shares = np.array([1.0 - self.bad_share, self.bad_share])
        good, bad = (shares * self._rates(not lost)) @ self._chain * self._rates(lost)
        return float(good), float(bad)


@dataclass(frozen=True, slots=True)
class Recorded:
    """Packets of one link or several, one after another: whether each was lost, and whether it begins a piece.

    Attributes:
        lost, begins: (n,).
        per_link: packets and lost ones, by (sender, receiver).
        step_s: median time from one packet of a link to its next; 0 where there is none.
    """

    lost: Flags
    begins: Flags
    per_link: Mapping[tuple[str, str], tuple[int, int]]
    step_s: float

    @property
    def n_lost(self) -> int:
        """How many were lost."""
        return int(self.lost.sum())

    @property
    def loss_rate(self) -> float:
        """Share that was lost."""
        return float(self.lost.mean())

    @property
    def mean_burst(self) -> float:
        """Mean number of packets that were lost one after another: lost packets over bursts that began."""
        onward = ~self.begins[1:]
        begun = self.lost[1:] & ~self.lost[:-1] & onward
        return self.loss_rate * float(onward.sum()) / float(begun.sum())

    @property
    def n_pieces(self) -> int:
        """Pieces without a long gap."""
        return int(self.begins.sum())

    def runs(self, lost: bool) -> tuple[list[int], list[int]]:
        """Lengths of the runs of lost, or of received, packets that began within a piece: those that ended, and the
        others, which the end of their piece cut.
        """
        at = np.flatnonzero(self.begins | np.concatenate([[True], self.lost[1:] != self.lost[:-1]]))
        lengths, ends = np.diff([*at, len(self.lost)]), np.append(at[1:], len(self.lost))
        cut = np.append(self.begins, True)[ends]
        own = (self.lost[at] == lost) & ~self.begins[at]
        return lengths[own & ~cut].tolist(), lengths[own & cut].tolist()

    def sampled(self) -> Recorded:
        """All packets if they are few, else some spells of them, spread evenly, each a piece."""
        n = len(self.lost)
        if n <= MOST_SAMPLED:
            return self
        kept = np.arange(n) % (n // SPELLS_SAMPLED) < MOST_SAMPLED // SPELLS_SAMPLED
        begins = self.begins | (kept & ~np.concatenate([[False], kept[:-1]]))
        return replace(self, lost=self.lost[kept], begins=begins[kept])

    def checked(self) -> Recorded:
        """These packets, if bursts can be told of them.

        Raises:
            NoBurstsError: they are too few, all received or all lost, or hardly any is.
        """
        n, n_lost = len(self.lost), self.n_lost
        if n < FEWEST:
            raise NoBurstsError(f"{n} packets are too few to tell bursts; needed are {FEWEST} at least")
        if n_lost in (0, n):
            bound = 1.0 - 0.05 ** (1.0 / n)
            what, rate = ("lost", f"{1.0 - bound:.2g} at least") if n_lost else ("received", f"{bound:.2g} at most")
            raise NoBurstsError(
                f"all {n} packets were {what}: there are no bursts to fit; the loss rate is {rate} (95 %)"
            )
        for is_lost, what in ((True, "lost"), (False, "received")):
            if (n_runs := sum(map(len, self.runs(is_lost)))) < FEWEST_RUNS:
                allowed = f"needed are {FEWEST_RUNS} at least; record for longer"
                raise NoBurstsError(f"{n_runs} runs of {what} packets in {n} are too few to tell bursts; {allowed}")
        return self


def recorded(trace: Trace, link: tuple[str, str] | None = None) -> Recorded:
    """The outcomes of a trace, of one link or of all.

    Raises:
        NoBurstsError: there is no such link, or the trace has rates in place of outcomes.
    """
    if link is not None and link not in trace.links:
        known = ", ".join(f"{sender},{receiver}" for sender, receiver in trace.links)
        raise NoBurstsError(f"has no packet of {link[0]} to {link[1]}; allowed: {known}")
    chosen = trace.links if link is None else {link: trace.links[link]}
    if any(per not in (0.0, 1.0) for series in chosen.values() for per in series.per):
        raise NoBurstsError("has rates (per): bursts are told of outcomes, column lost, 0 or 1")
    gaps_s = {name: np.diff(series.times_s) for name, series in chosen.items()}
    every_s = [gap for gaps in gaps_s.values() for gap in gaps.tolist()]
    step_s = float(median(every_s)) if every_s else 0.0
    return Recorded(
        lost=np.concatenate([np.array(series.per) > 0.5 for series in chosen.values()]),
        begins=np.concatenate([[True, *(gaps > LONG_GAP * step_s)] for gaps in gaps_s.values()]),
        per_link={name: (len(series.per), int(sum(series.per))) for name, series in chosen.items()},
        step_s=step_s,
    )


class Expected(NamedTuple):
    """What a model says of the hidden states: the log-likelihood, and numbers that are expected.

    Attributes:
        changes: (2, 2) of steps from (good, bad) to (good, bad).
        begun: (2,) of pieces that begin (good, bad).
        bad: (n,) probability that a packet was in the bad state.
    """

    log_likelihood: float
    changes: Numbers
    begun: Numbers
    bad: Numbers


def expected(model: BurstModel, of: Recorded) -> Expected:
    """The states by all packets before and after (forward-backward, Rabiner 1989), scaled."""
    p, q, share, begins = model.p_good_to_bad, model.p_bad_to_good, model.bad_share, of.begins
    chain = np.array([[[1.0 - p, 1.0 - share], [p, share]], [[q, 1.0 - share], [1.0 - q, share]]])
    seen = np.array([[1.0 - model.per_good, model.per_good], [1.0 - model.per_bad, model.per_bad]])
    cases = (chain[:, :, :, None] * seen[None, :, None, :]).reshape(2, 2, 4)  # going on or begun; received or lost
    steps = np.take(cases, 2 * begins + of.lost, axis=2)
    before = _prefixes(steps)[0]  # the first step is alike from both states, so both rows are
    before = before / (before[0] + before[1])
    after = np.ones((2, len(of.lost)))
    if len(of.lost) > 1:
        after[:, :-1] = _prefixes(steps[:, :, :0:-1].transpose(1, 0, 2)).sum(axis=0)[:, ::-1]
    joint = np.empty_like(steps)
    joint[:, :, 0] = 0.5 * steps[:, :, 0]
    np.multiply(before[:, None, :-1], steps[:, :, 1:], out=joint[:, :, 1:])
    scale = _total(joint)
    joint *= after
    joint /= _total(joint)
    bad = joint[0, 1] + joint[1, 1]
    n_bad = float(bad[begins].sum())
    begun = np.array([float(begins.sum()) - n_bad, n_bad])
    return Expected(float(np.log(scale).sum()), joint.sum(axis=2) - joint[:, :, begins].sum(axis=2), begun, bad)


def _prefixes(steps: Numbers) -> Numbers:
    """Products of the first 1, 2, ... n matrices of (2, 2, n), each up to a factor; by halves, so without a loop."""
    n = steps.shape[2]
    if n == 1:
        return steps
    pairs = _prefixes(_product(steps[:, :, 0 : n - 1 : 2], steps[:, :, 1::2]))
    found = np.empty_like(steps)
    found[:, :, 0], found[:, :, 1::2] = steps[:, :, 0], pairs
    found[:, :, 2::2] = _product(pairs[:, :, : (n - 1) // 2], steps[:, :, 2::2])
    return found


def _product(one: Numbers, other: Numbers) -> Numbers:
    """Matrix products, each over the sum of its entries."""
    found = one[:, :1] * other[0] + one[:, 1:] * other[1]
    return np.asarray(found / _total(found))


def _total(of: Numbers) -> Numbers:
    """Sum of the entries of each matrix."""
    return np.asarray(of[0, 0] + of[0, 1] + of[1, 0] + of[1, 1])


class Kind(NamedTuple):
    """A model of losses in a chain: its name, and the rates of (good, bad) that it fixes; None is free."""

    name: str
    per_good: float | None = None
    per_bad: float | None = None

    @property
    def free(self) -> list[int]:
        """Places of the parameters that are fitted."""
        return [0, 1, *(place for place, rate in ((2, self.per_good), (3, self.per_bad)) if rate is None)]

    def of(self, numbers: Numbers | BurstModel) -> BurstModel:
        """The model of these numbers, with the rates that are fixed."""
        p, q, good, bad = map(float, numbers)
        return BurstModel(
            p, q, good if self.per_good is None else self.per_good, bad if self.per_bad is None else self.per_bad
        )


MARKOV, GILBERT, ELLIOTT = Kind("markov", 0.0, 1.0), Kind("gilbert", 0.0), Kind("gilbert-elliott")
CHAINS = (MARKOV, GILBERT, ELLIOTT)
"""Chains, each a case of the next."""
INDEPENDENT, LINKS = "independent", "links"


def improved(kind: Kind, model: BurstModel, by: Expected, of: Recorded) -> BurstModel:
    """The next model: one that makes what is expected of the states more likely, and so the trace.

    Rates of states are those of the packets in them. Of the two changes each is the best beside the other, twice in
    turn; they have a closed form each, since a piece begins in a stationary state, and are kept at a sum of 1 at most.
    """
    (stays_good, turns_bad), (turns_good, stays_bad) = by.changes.tolist()
    begun_good, begun_bad = by.begun.tolist()
    p, q = model.p_good_to_bad, model.p_bad_to_good
    for _ in range(2):
        p = _best_change(turns_bad + begun_bad, stays_good, begun_good + begun_bad, q)
        q = _best_change(turns_good + begun_good, stays_bad, begun_good + begun_bad, p)
    n_bad, n_lost_bad = float(by.bad.sum()), float(by.bad[of.lost].sum())
    n_good, n_lost_good = len(of.lost) - n_bad, of.n_lost - n_lost_bad
    good = min(1.0, max(0.0, n_lost_good / n_good)) if n_good > 0.0 else model.per_good
    bad = min(1.0, n_lost_bad / n_bad) if n_bad > 0.0 else model.per_bad
    return kind.of(BurstModel(p, q, good, bad))


def _best_change(changed: float, stayed: float, begun: float, other: float) -> float:
    """x that maximises changed log x + stayed log(1 - x) - begun log(x + other), at most 1 - other.

    Its derivative times x (1 - x) (x + other) is a square function that is positive at 0 and negative at 1.
    """
    a = begun - changed - stayed
    b, c = changed * (1.0 - other) - stayed * other - begun, changed * other
    denominator = math.sqrt(max(0.0, b * b - 4.0 * a * c)) - b
    return min(1.0 - other, max(LEAST, 2.0 * c / denominator)) if denominator > 0.0 else 1.0 - other


def _logits(model: BurstModel) -> Numbers:
    clipped = np.clip(model, 1e-12, 1.0 - 1e-12)
    return np.asarray(np.log(clipped / (1.0 - clipped)))


def _from_logits(kind: Kind, logits: Numbers) -> BurstModel:
    p, q, good, bad = 1.0 / (1.0 + np.exp(-np.clip(logits, -27.0, 27.0)))
    excess = max(1.0, p + q)
    return kind.of(BurstModel(max(LEAST, p / excess), max(LEAST, q / excess), good, bad))


def converged(kind: Kind, model: BurstModel, of: Recorded) -> tuple[BurstModel, float]:
    """The model that steps from another come to, and its log-likelihood.

    Two steps, and a leap in the direction in which they lead (SQUAREM, Varadhan, Roland 2008), which is taken back if
    the trace is less likely by it than after the first of them.
    """
    here, by = model, expected(model, of)
    for _ in range(MOST_STEPS // 3):
        first = improved(kind, here, by, of)
        by_first = expected(first, of)
        second = improved(kind, first, by_first, of)
        start, went = _logits(here), _logits(first) - _logits(here)
        bent = _logits(second) - _logits(first) - went
        size = math.sqrt(float(bent @ bent))
        stride = max(1.0, math.sqrt(float(went @ went)) / size) if size > 0.0 else 1.0
        there = _from_logits(kind, start + 2.0 * stride * went + stride * stride * bent)
        by_there = expected(there, of)
        if not by_there.log_likelihood >= by_first.log_likelihood:
            there, by_there = second, expected(second, of)
        gain = by_there.log_likelihood - by.log_likelihood
        here, by = there, by_there
        if gain < CONVERGED:
            break
    return here, by.log_likelihood


@dataclass(frozen=True, slots=True)
class Fit:
    """A model fitted to a trace.

    Attributes:
        name: of the model.
        n_parameters: that were fitted.
        log_likelihood, bic: of the trace; the model with the least BIC is the best.
        mean_burst: packets that it loses one after another, in the mean.
        model: its chain; None for rates of links.
        intervals: 95 % intervals of its parameters by name, as far as the trace tells them.
        per_link: rates of links, of the model that has them.
    """

    name: str
    n_parameters: int
    log_likelihood: float
    bic: float
    mean_burst: float
    model: BurstModel | None = None
    intervals: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    per_link: Mapping[tuple[str, str], float] = field(default_factory=dict)


def fits(of: Recorded) -> list[Fit]:
    """All models fitted to a trace, simple ones first.

    Raises:
        NoBurstsError: no bursts can be told of it.
    """
    n, rate = len(of.checked().lost), of.loss_rate
    weight = math.log(n)

    def fit(name: str, n_parameters: int, log_likelihood: float, mean_burst: float, **more: Any) -> Fit:
        bic = n_parameters * weight - 2.0 * log_likelihood
        return Fit(name, n_parameters, log_likelihood, bic, mean_burst, **more)

    alike = BurstModel(0.5, 0.5, rate, rate)
    found = [fit(INDEPENDENT, 1, _of_rate(n, rate), alike.mean_burst, model=alike)]
    if len(of.per_link) > 1:
        rates = {link: n_lost / n_link for link, (n_link, n_lost) in of.per_link.items()}
        likely = math.fsum(_of_rate(of.per_link[link][0], per) for link, per in rates.items())
        begun = math.fsum(of.per_link[link][0] * per * (1.0 - per) for link, per in rates.items())
        found.append(fit(LINKS, len(rates), likely, rate * n / begun if begun else math.inf, per_link=rates))
    earlier: list[BurstModel] = []
    for kind in CHAINS:
        model, log_likelihood = _fitted(kind, of, earlier)
        earlier.append(model)
        intervals = _intervals(kind, model, of)
        found.append(fit(kind.name, len(kind.free), log_likelihood, model.mean_burst, model=model, intervals=intervals))
    return found


def best(of: list[Fit]) -> Fit:
    """The model with the least BIC."""
    return min(of, key=lambda fit: fit.bic)


def do_links_differ(of: Recorded, model: BurstModel) -> bool:
    """True if rates of links lie farther apart than this chain, alike on all of them, lets them in 99 of 100 traces.

    Sums of chi-square, with the variance that bursts give to the number of lost packets; a gap does not cut them here.
    """
    stays, share, rate = 1.0 - model.p_good_to_bad - model.p_bad_to_good, model.bad_share, of.loss_rate
    covariance = share * (1.0 - share) * (model.per_bad - model.per_good) ** 2
    total = 0.0
    for n, n_lost in of.per_link.values():
        lags = np.arange(1, n)
        variance = n * rate * (1.0 - rate) + 2.0 * covariance * float(((n - lags) * stays**lags).sum())
        total += (n_lost - n * rate) ** 2 / variance
    spare = len(of.per_link) - 1
    if not spare:
        return False
    most = spare * (1.0 - 2.0 / (9.0 * spare) + 2.326 * math.sqrt(2.0 / (9.0 * spare))) ** 3  # Wilson, Hilferty 1931
    return total > most


def are_spells_long(of: Recorded, model: BurstModel) -> bool:
    """True if states last for a tenth of a piece or more: links, or hours, that differ look the same."""
    return LONG_SPELL * len(of.lost) / of.n_pieces < 1.0 / (model.p_good_to_bad + model.p_bad_to_good)


def _of_rate(n: int, rate: float) -> float:
    """Log-likelihood of independent losses."""
    return math.fsum(n * part * math.log(part) for part in (rate, 1.0 - rate) if part > 0.0)


def _fitted(kind: Kind, of: Recorded, earlier: list[BurstModel]) -> tuple[BurstModel, float]:
    """The most likely model from all starts; the good state is the one that loses less."""
    rate = of.loss_rate
    starts = [
        kind.of(BurstModel(rate / spell, (1.0 - rate) / spell, rate * (1.0 - contrast), rate + (1.0 - rate) * contrast))
        for spell, contrast in product(SPELLS, CONTRASTS if len(kind.free) > len(MARKOV.free) else CONTRASTS[:1])
    ]
    tried, some = [], of.sampled()
    for start in starts:
        model, by = start, expected(start, some)
        for _ in range(FIRST_STEPS):
            model = improved(kind, model, by, some)
            by = expected(model, some)
        tried.append((by.log_likelihood, model))
    found, log_likelihood = converged(kind, max(tried)[1], of)
    for model in earlier:  # cases of this one: what fits them fits it
        if (likely := expected(model, of).log_likelihood) > log_likelihood:
            found, log_likelihood = model, likely
    if found.per_good > found.per_bad:
        found = BurstModel(found.p_bad_to_good, found.p_good_to_bad, found.per_bad, found.per_good)
    return found, log_likelihood


def _intervals(kind: Kind, model: BurstModel, of: Recorded) -> dict[str, tuple[float, float]]:
    """95 % intervals from the curvature of the log-likelihood over the log-odds of the parameters (Wald).

    A parameter at its bound has none, and is taken for known; nor has any if the likelihood does not fall on all sides.
    """
    centre = _logits(model)
    if model.p_good_to_bad + model.p_bad_to_good > 1.0 - EDGE:
        return {}
    free = [place for place in kind.free if EDGE < model[place] < 1.0 - EDGE]

    def likely(*moves: tuple[int, float]) -> float:
        logits = centre.copy()
        for place, by in moves:
            logits[place] += by
        return expected(kind.of(1.0 / (1.0 + np.exp(-logits))), of).log_likelihood

    curved, middle = np.empty((len(free), len(free))), likely()
    for row, place in enumerate(free):
        curved[row, row] = likely((place, SPAN)) + likely((place, -SPAN)) - 2.0 * middle
    for (row, one), (column, other) in combinations(enumerate(free), 2):
        mixed = likely((one, SPAN), (other, SPAN)) + likely((one, -SPAN), (other, -SPAN)) - 2.0 * middle
        curved[row, column] = curved[column, row] = 0.5 * (mixed - curved[row, row] - curved[column, column])
    information = -curved / (SPAN * SPAN)
    if not free or np.linalg.eigvalsh(information).min() <= 0.0:
        return {}
    half = 1.96 * np.sqrt(np.diag(np.linalg.inv(information)))
    ends = 1.0 / (1.0 + np.exp(-(centre[free] + np.outer((-1.0, 1.0), half))))
    return {BurstModel._fields[place]: (float(low), float(high)) for place, low, high in zip(free, *ends, strict=True)}
