"""Names of items, as tables and reports show them."""

from fleet_radio import cells

from exchange.packets import Fragment, ItemUid


def test_an_item_is_named_by_origin_and_sequence_and_its_part_only_behind_the_first():
    assert str(ItemUid(2, 17, 0)) == "2-17"
    assert str(ItemUid(2, 17, 3)) == "2-17.3"


def test_names_of_a_fleet_never_collide():
    names = {
        str(ItemUid(origin, sequence, part)) for origin in range(12) for sequence in range(12) for part in range(4)
    }
    assert len(names) == 12 * 12 * 4


def test_a_fragment_knows_its_item():
    fragment = Fragment(3, 5, 1.0, cells(4, 1), index=2, count=4)
    assert fragment.uid == ItemUid(3, 5, 2) == (3, 5, 2)
