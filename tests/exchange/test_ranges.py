"""Values out of the range of their attribute: refused where they are recorded and, by the same rule, where they arrive.

The codec has a form for each, so nothing is ever sent as another value; no vehicle may record one, though.
"""

import pytest

from exchange.packets import Fragment, ItemUid
from stress.conformance.radio import MAPPED_CELL, TBOX, ManagerFleet, bay, cells
from worldmodel import STATUS, FactError, PropertyValue

POSITION = TBOX.attribute_named("position")
FIELD = TBOX.attributes[MAPPED_CELL].fields[0]
OUTSIDE = [FIELD.minimum - FIELD.resolution, FIELD.maximum + FIELD.resolution, FIELD.maximum + 1e6 * FIELD.resolution]


def packet_with(fleet: ManagerFleet, value: float) -> bytes:
    """A packet of node 0 with a sound item, and one that has this value."""
    odd = Fragment(0, 1, 0.0, (PropertyValue(bay(2), MAPPED_CELL, value),))
    return fleet.codec.encode(0, [0, 0], [Fragment(0, 0, 0.0, cells(2, 1)), odd])


@pytest.mark.parametrize("value", OUTSIDE)
def test_a_value_out_of_range_is_refused_by_name_where_it_is_recorded(value: float) -> None:
    with pytest.raises(FactError, match=r"mappedCell of instance 2: .* is outside"):
        ManagerFleet(2).models[0].record([(bay(2), MAPPED_CELL, value)], 0.0)


@pytest.mark.parametrize("value", OUTSIDE)
def test_a_value_out_of_range_refuses_its_packet_and_nothing_of_it_is_held(value: float) -> None:
    fleet = ManagerFleet(2)
    reception = fleet.deliver(1, packet_with(fleet, value), 1.0)
    assert f"mappedCell is {value}, out of its range" in str(reception.fault)
    assert fleet.managers[1].n_faults == 1
    assert reception.blocks == ()
    assert not fleet.managers[1].holds(ItemUid(0, 0, 0))
    assert not fleet.managers[1].holds(ItemUid(0, 0, 1))


@pytest.mark.parametrize("east_off", [0.0, -1.0, 1.0])
@pytest.mark.parametrize("north_off", [0.0, -1.0, 1.0])
def test_a_place_is_in_range_if_both_its_numbers_are(east_off: float, north_off: float) -> None:
    """By as much as a step beyond either end."""
    place = tuple(
        (field.minimum if off < 0.0 else field.maximum) + off * field.resolution
        for field, off in zip(POSITION.fields, (east_off, north_off), strict=True)
    )
    fleet = ManagerFleet(2)
    status = Fragment(0, STATUS, 0.0, (PropertyValue(0, POSITION.uid, place),))
    reception = fleet.deliver(1, fleet.codec.encode(0, [0, 0], [status]), 1.0)
    assert (reception.fault is None) == (east_off == north_off == 0.0)


@pytest.mark.parametrize("value", [FIELD.minimum, FIELD.maximum])
def test_the_bounds_are_in_range_at_both_ends(value: float) -> None:
    fleet = ManagerFleet(2)
    fleet.models[0].record([(bay(2), MAPPED_CELL, value)], 0.0)
    reception = fleet.deliver(1, packet_with(fleet, value), 1.0)
    assert reception.fault is None
    assert len(reception.blocks) == 2
