"""The seafloor as it really is in one run: things that no vehicle knows of.

Each cell is drawn by seed and number, in a stream of its own, by the probabilities of the prior: so the prior is right,
and no strategy, loss or fault moves a thing.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from exchange.acoustics import loss
from missions.arrows.grid import Array, CellGrid
from missions.arrows.scenario import ArrowsScenario
from remoras.work import Point


@dataclass(frozen=True)
class Thing:
    """Something that lies in a cell.

    Attributes:
        kind: what it is: number of the kind, from 1 on; name: of the kind.
        position_m: where it lies.
    """

    kind: int
    name: str
    position_m: Point


@dataclass(frozen=True, eq=False)
class Seafloor:
    """What detectors perceive.

    Attributes:
        grid: the cells; things: by cell.
        scenario: has what detectors do.
        rates: of contacts, by detector and kind.
        seed: of the run.
    """

    grid: CellGrid
    things: dict[int, Thing]
    scenario: ArrowsScenario = field(repr=False)
    rates: Array = field(repr=False)
    seed: int


def draw_seafloor(grid: CellGrid, prior: Array, scenario: ArrowsScenario, rates: Array, seed: int) -> Seafloor:
    """The seafloor of the run with that seed."""
    names, things = [kind.name for kind in scenario.kinds], dict[int, Thing]()
    occupied = (prior[0] < 1.0).nonzero()[0]
    for cell in map(int, occupied):
        share = loss.uniform(seed, loss.FINDS, cell, 0, 0)
        for number, name in enumerate(names, 1):
            share -= float(prior[number, cell])
            if share < 0.0:
                x_m, y_m = grid.centre_m(cell)
                east, north = (loss.uniform(seed, loss.FINDS, cell, 0, which) - 0.5 for which in (1, 2))
                things[cell] = Thing(number, name, (x_m + east * grid.cell_m, y_m + north * grid.cell_m))
                break
    return Seafloor(grid, things, scenario, rates, seed)
