"""The map of one vehicle: what it takes each cell to hold, by all looks that it knows of, its own and others'.

Looks come as facts. Only how often each detector found something in a cell, and how often not, counts: two vehicles
that know of the same looks have the same map, to the last bit, in whatever order they heard of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from missions.arrows.bayes import posterior
from missions.arrows.grid import N_DETECTORS, Array, CellGrid, contact_of, swept_of
from missions.arrows.scenario import SITES
from remoras.known import Known

SWEPT, CONTACT = "swept", "contact"
"""Attributes of vehicles: looks that found nothing, and looks that found something."""


class Chart:
    """A map, brought up to date from what is known.

    Args:
        grid: the cells.
        prior: shape (1 + kinds, n_cells); the first row is nothing.
        rates: of contacts by detector and kind, shape (detectors, 1 + kinds).
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
        """What each cell holds: shape (1 + kinds, n_cells), columns sum to 1."""
        if self._shares is None:
            self._shares = posterior(self.prior, self.rates, self._n_yes, self._n_no)
        return self._shares

    @property
    def holds_find(self) -> npt.NDArray[np.bool_]:
        """Cells in which somebody has found something, shape (n_cells,)."""
        return np.asarray(self._n_yes.any(axis=0))

    def sites(self, shares: Array) -> Array:
        """The part of shares of kinds, shape (1 + kinds, ...), that are sites."""
        total: Array = np.zeros_like(shares[0])
        for number in self._sites:
            total = total + shares[number]
        return total

    def update(self, facts: Known, vehicles: Sequence[str]) -> None:
        """Take in what is known of the looks of some vehicles."""
        if facts.n_told == self._n_told:
            return
        for attribute in (SWEPT, CONTACT):
            for vehicle in vehicles:
                known, seen = facts.values((attribute, vehicle)), self._seen.get((attribute, vehicle), set())
                if len(known) < len(seen):  # somebody is banned now
                    self._clear()
                    self.update(facts, vehicles)
                    return
                if len(known) > len(seen):
                    new = known - seen
                    self.add(attribute, new)
                    self._seen[attribute, vehicle] = seen | new
        self._n_told = facts.n_told

    def add(self, attribute: str, codes: Iterable[int]) -> None:
        """Take in looks, each once."""
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
