"""Belief map of each vehicle: Bayesian updates of cells by detections.

Each cell holds at most one thing: nothing, or one of several kinds. Given the content, observations are independent,
and so are cells. The posterior is prior times likelihoods, cell by cell::

    P(k | observations)  ~  P(k) * prod over detectors d of  p_dk^yes_d * (1 - p_dk)^no_d

p_dk is the rate of detections of kind k by d (for nothing: its false alarms); yes_d and no_d count its answers at the
cell. Only these counts matter, so vehicles with the same observations have bitwise equal maps in any order of
reception. Only + - * / and exact float operations are used, for equal bytes on every machine.

Information is in bits. That of a future observation is the mutual information of its answer and the cell's content.
That of past observations is the Kullback-Leibler divergence of the map from the prior; its expectation is the former
(Cover and Thomas, Elements of Information Theory, chapter 2).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from exchange.arithmetic import LN2
from missions.arrows.scenario import SITES
from missions.arrows.seafloor import N_DETECTORS, Array, CellGrid, contact_of, summed, swept_of
from remoras.beliefs import Known

Counts = npt.NDArray[np.int64]
SMALLEST = 1e-250
"""Lower limit of weights, so that later observations can revise them."""
N_TERMS = 12
"""Terms of the logarithm's series; the error is below 1e-15."""


def log2_of(x: Array) -> Array:
    """Binary logarithm of numbers >= 0; 0 maps to 0, as it only occurs in products with 0.

    By the series of artanh, z + z^3 / 3 + ..., with z = (m - 1) / (m + 1) of the mantissa m.

    >>> log2_of(np.array([0.0, 0.25, 1.0, 8.0])).tolist()
    [0.0, -2.0, 0.0, 3.0]
    """
    mantissa, exponent = np.frexp(np.where(x > 0.0, x, 1.0))
    is_low = mantissa < 0.7071067811865476
    mantissa, exponent = np.where(is_low, 2.0 * mantissa, mantissa), exponent - is_low
    z = (mantissa - 1.0) / (mantissa + 1.0)
    squared, series = z * z, np.zeros_like(z)
    for term in range(N_TERMS, -1, -1):
        series = series * squared + 1.0 / (2 * term + 1)
    return np.asarray(exponent + (2.0 / LN2) * z * series)


def posterior(prior: Array, p_yes: Array, n_yes: Counts, n_no: Counts) -> Array:
    """Posterior of each cell, shape (kinds, cells); columns sum to 1.

    Args:
        prior: shape (kinds, cells), columns sum to 1; the first kind is nothing.
        p_yes: detection rates, shape (detectors, kinds), in (0, 1).
        n_yes, n_no: answers, shape (detectors, cells).
    """
    weights = prior.copy()
    for detector, rates in enumerate(p_yes):
        for counts, chances in ((n_yes[detector], rates), (n_no[detector], 1.0 - rates)):
            most = int(counts.max(initial=0))
            if most == 0:
                continue
            powers = np.ones((most + 1, len(chances)))
            for n in range(1, most + 1):
                powers[n] = powers[n - 1] * chances
                powers[n] /= powers[n].max()  # only ratios matter: avoids underflow
            weights = np.maximum(weights * powers[counts].T, SMALLEST)
            weights /= _total(weights)
    return np.asarray(weights / _total(weights), dtype=np.float64)


def _total(weights: Array) -> Array:
    """Sum over kinds in a fixed order."""
    total: Array = weights[0].copy()
    for row in weights[1:]:
        total += row
    return total


def look_information(chart: Array, rates: Array) -> Array:
    """Mutual information (bits), shape (cells,), of an observation and each cell's content.

    ``chart`` has shape (kinds, cells); ``rates`` are detection rates in (0, 1) by kind.
    """
    p_yes = np.zeros(chart.shape[1])
    told = np.zeros(chart.shape[1])
    sure = rates * log2_of(rates) + (1.0 - rates) * log2_of(1.0 - rates)
    for share, rate, bits in zip(chart, rates, sure, strict=True):
        p_yes += share * rate
        told += share * bits
    p_no = 1.0 - p_yes
    return np.asarray(np.maximum(told - p_yes * log2_of(p_yes) - p_no * log2_of(p_no), 0.0))


def entropy(chart: Array) -> Array:
    """Entropy of each cell (bits), shape (cells,).

    >>> entropy(np.array([[0.5, 1.0], [0.5, 0.0]])).tolist()
    [1.0, 0.0]
    """
    found = np.zeros(chart.shape[1])
    for share in chart:
        found -= share * log2_of(share)
    return found


def divergence(chart: Array, other: Array) -> float:
    """Kullback-Leibler divergence of a map from another, summed over cells (bits)."""
    told = np.zeros(chart.shape[1])
    for share, before in zip(chart, other, strict=True):
        told += share * (log2_of(share) - log2_of(before))
    return summed(told)


def disagreement(charts: list[Array]) -> float:
    """Jensen-Shannon divergence of equally weighted maps, summed over cells (bits).

    >>> one, other = np.array([[1.0], [0.0]]), np.array([[0.0], [1.0]])
    >>> disagreement([one, one]), disagreement([one, other])
    (0.0, 1.0)
    """
    if len(charts) < 2:
        return 0.0
    mean = charts[0].copy()
    for chart in charts[1:]:
        mean += chart
    mean /= len(charts)
    within = entropy(charts[0])
    for chart in charts[1:]:
        within += entropy(chart)
    return max(0.0, summed(entropy(mean) - within / len(charts)))


SWEPT, CONTACT = "swept", "contact"
"""Attributes of vehicles: observations without and with a detection."""


class Chart:
    """Map updated from known facts.

    Args:
        prior: shape (1 + kinds, n_cells); the first row is nothing.
        rates: detection rates, shape (detectors, 1 + kinds).
        names: of the kinds, nothing first.
    """

    def __init__(self, grid: CellGrid, prior: Array, rates: Array, names: Sequence[str]) -> None:
        self.grid, self.prior, self.rates, self.names = grid, prior, rates, names
        self._sites = [number for number, name in enumerate(names) if name in SITES]
        self._n_told = -1
        self._seen: dict[tuple[str, str], set[int]] = {}
        self._clear()

    def _clear(self) -> None:
        self._seen.clear()
        self._n_yes = np.zeros((N_DETECTORS, self.grid.n_cells), dtype=np.int64)
        self._n_no = self._n_yes.copy()
        self._shares: Array | None = self.prior

    @property
    def shares(self) -> Array:
        """Posterior, shape (1 + kinds, n_cells); columns sum to 1."""
        if self._shares is None:
            self._shares = posterior(self.prior, self.rates, self._n_yes, self._n_no)
        return self._shares

    @property
    def holds_find(self) -> npt.NDArray[np.bool_]:
        """Cells with a detection by any vehicle, shape (n_cells,)."""
        return np.asarray(self._n_yes.any(axis=0))

    def sites(self, shares: Array) -> Array:
        """Sum of the site kinds in ``shares`` of shape (1 + kinds, ...)."""
        total: Array = np.zeros_like(shares[0])
        for number in self._sites:
            total = total + shares[number]
        return total

    def update(self, facts: Known, vehicles: Sequence[str]) -> None:
        """Add known observations of some vehicles; recompute after an exclusion."""
        if facts.n_told == self._n_told:
            return
        for attribute in (SWEPT, CONTACT):
            for vehicle in vehicles:
                known, seen = facts.values((attribute, vehicle)), self._seen.get((attribute, vehicle), set())
                if len(known) < len(seen):  # an origin is excluded now
                    self._clear()
                    self.update(facts, vehicles)
                    return
                if len(known) > len(seen):
                    new = known - seen
                    self.add(attribute, new)
                    self._seen[attribute, vehicle] = seen | new
        self._n_told = facts.n_told

    def add(self, attribute: str, codes: Iterable[int]) -> None:
        """Add observation codes, each once."""
        for code in codes:
            if attribute == CONTACT:
                detector, cell = contact_of(int(code))
                if cell < self.grid.n_cells:
                    self._n_yes[detector, cell] += 1
            else:
                detector, tile, mask = swept_of(int(code))
                for cell in self.grid.cells_of(tile, mask):
                    self._n_no[detector, cell] += 1
        self._shares = None
