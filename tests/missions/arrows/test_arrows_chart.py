"""Cells and their numbers on the wire, and the map that a vehicle makes of what it heard."""

import random

from hypothesis import given
from hypothesis import strategies as st
from searching import Facts, mission

from missions.arrows.belief_map import CONTACT, SWEPT
from missions.arrows.seafloor import CellGrid, contact_code, contact_of, swept_code, swept_of

GRID = CellGrid(-10.0, 5.0, 10.0, 7, 9)


def test_every_cell_is_in_one_tile() -> None:
    cells = [cell for tile in range(GRID.n_tiles) for cell in GRID.cells_of(tile, 0xFFFF)]
    assert sorted(cells) == list(range(GRID.n_cells))


@given(st.integers(0, GRID.n_cells - 1))
def test_a_cell_is_found_by_its_centre_and_by_its_bit(cell: int) -> None:
    assert GRID.cell_at(GRID.centre_m(cell)) == cell
    tile, bit = GRID.tile_of(cell)
    assert list(GRID.cells_of(tile, 1 << bit)) == [cell]


@given(st.integers(0, 31), st.integers(0, 1), st.integers(0, 255), st.integers(0, 65535))
def test_passes_come_out_as_they_went_in(n_pass: int, detector: int, tile: int, mask: int) -> None:
    assert swept_of(swept_code(n_pass, detector, tile, mask)) == (detector, tile, mask)


@given(st.integers(0, 63), st.integers(0, 1), st.integers(0, 4095))
def test_contacts_come_out_as_they_went_in(n_look: int, detector: int, cell: int) -> None:
    assert contact_of(contact_code(n_look, detector, cell)) == (detector, cell)


@given(st.floats(-20.0, 80.0), st.floats(-5.0, 100.0), st.floats(0.0, 40.0))
def test_cells_in_range_are_all_those_and_no_others(x_m: float, y_m: float, range_m: float) -> None:
    near = set(GRID.near((x_m, y_m), range_m))
    for cell in range(GRID.n_cells):
        at_m = GRID.centre_m(cell)
        squared = (at_m[0] - x_m) ** 2 + (at_m[1] - y_m) ** 2
        if abs(squared - range_m**2) > 1e-6:
            assert (cell in near) == (squared < range_m**2)


def looks(seed: int) -> list[tuple[str, str, int]]:
    draw = random.Random(seed)
    swept = [
        ("swept", "A", swept_code(n, draw.randrange(2), draw.randrange(40), draw.randrange(65536))) for n in range(30)
    ]
    return [*swept, *(("contact", "B", contact_code(n, 0, draw.randrange(600))) for n in range(9))]


def test_maps_are_the_same_bytes_whatever_the_order_and_the_doubles() -> None:
    """Vehicles that hear the same looks in another order, in other portions, or twice, have the same map."""
    told = looks(1)
    charts = []
    for order in range(4):
        draw, chart = random.Random(order), mission().chart()
        facts = Facts({})
        shuffled = told + told[: 5 * order]
        draw.shuffle(shuffled)
        for attribute, vehicle, code in shuffled:
            facts.told.setdefault((attribute, vehicle), set()).add(code)
            facts.n_told += 1
            if draw.random() < 0.3:
                chart.update(facts, ("A", "B"))
        chart.update(facts, ("A", "B"))
        charts.append(chart.shares.tobytes())
    assert len(set(charts)) == 1
    assert charts[0] != mission().chart().shares.tobytes()


def test_what_somebody_banned_said_counts_no_more() -> None:
    facts, chart = Facts({}), mission().chart()
    for attribute, vehicle, code in looks(2):
        facts.told.setdefault((attribute, vehicle), set()).add(code)
    facts.n_told = 1
    chart.update(facts, ("A", "B"))
    del facts.told["contact", "B"]
    facts.n_told = 2
    chart.update(facts, ("A", "B"))
    alone = mission().chart()
    alone.add(SWEPT, facts.told["swept", "A"])
    assert chart.shares.tobytes() == alone.shares.tobytes()
    alone.add(CONTACT, [contact_code(0, 0, 7)])
    assert chart.shares.tobytes() != alone.shares.tobytes()
