"""Names of items, statuses and private items, as in tables and reports."""

import pytest

from benchmarks.manager_fleet import POSITION, cells
from exchange.packets import ItemUid, guid_of, name_of
from worldmodel import STATUS, Block, PropertyValue


def test_an_item_name_has_origin_sequence_and_later_fragment_numbers():
    assert str(ItemUid(2, 17, 0)) == "2-17"
    assert str(ItemUid(2, 17, 3)) == "2-17.3"
    assert str(ItemUid(2, 17, 3, 1)) == "2.e1-17.3"  # a later epoch alone is named


def test_a_status_name_has_attribute_subject_and_time():
    status = Block(2, STATUS, 12.3, (PropertyValue(5, POSITION, (0.0, 0.0)),))
    assert name_of(status) == f"2@12.3:5.{POSITION}"
    assert name_of(status._replace(time_s=12.0)) == f"2@12:5.{POSITION}"


def test_private_items_are_numbered_separately():
    kept = Block(2, STATUS - 1, 12.3, cells(4, 1))
    assert [name_of(kept), name_of(kept._replace(sequence=-9, epoch=3))] == ["2-p1", "2.e3-p8"]


@pytest.mark.parametrize("sequence", [0, 17, STATUS, STATUS - 1, STATUS - 40])
@pytest.mark.parametrize("epoch", [0, 3])
def test_an_item_name_identifies_its_block(sequence: int, epoch: int):
    """Of a status it says the origin, no epoch: that has time in its place."""
    block = Block(11, sequence, 0.1, cells(4, 1), 0 if sequence == STATUS else epoch)
    assert guid_of(name_of(block)) == block.guid
