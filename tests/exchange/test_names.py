"""Attribute codes: short for exchanged attributes whatever the ontology, and defined for all."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exchange.errors import PeerFault
from exchange.policy.planning import width
from exchange.wire.factcodec import AttributeNames


class Taker:
    """Takes bits off the front, as a packet's reader does."""

    def __init__(self, bits: int, size: int) -> None:
        self.bits, self.left = bits, size

    def __call__(self, size: int) -> int:
        self.left -= size
        assert self.left >= 0
        return self.bits >> self.left & (1 << size) - 1


def uid_in(names: AttributeNames, take: Taker) -> int:
    name = take(names.short_bits)
    return names.exchanged[name] if name < len(names.exchanged) else names.read_other(name, take)


@given(st.data(), st.integers(1, 80))
def test_every_attribute_code_decodes_to_its_attribute(data: st.DataObject, n: int) -> None:
    exchanged = data.draw(st.none() | st.sets(st.integers(0, n - 1)))
    names = AttributeNames(n, exchanged)
    for uid in range(n):
        take = Taker(names.names[uid], names.sizes[uid])
        assert uid_in(names, take) == uid
        assert take.left == 0


def test_unexchanged_attributes_do_not_lengthen_attribute_codes() -> None:
    # 18 and the one name for all others: 5 bits. Of 36 or 50 attributes without short names: 6.
    exchanged = range(10, 28)
    assert {AttributeNames(n, exchanged).sizes[12] for n in (30, 36, 50, 400)} == {5}
    assert [width(n) for n in (36, 50)] == [6, 6]
    assert AttributeNames(50, exchanged).sizes[3] == 5 + 6
    assert AttributeNames(50).sizes == (6,) * 50


@pytest.mark.parametrize(
    ("bits", "size"),
    [
        pytest.param(3, 2, id="no name"),
        pytest.param(2 << 3 | 0, 5, id="the long name of what has a short one"),
        pytest.param(2 << 3 | 7, 5, id="no uid"),
    ],
)
def test_unknown_attribute_codes_are_a_fault_of_the_peer(bits: int, size: int) -> None:
    names = AttributeNames(6, exchanged=(0, 4))  # 0, 1, then 2 for others; 3 is free
    with pytest.raises(PeerFault, match="is not in the TBox"):
        uid_in(names, Taker(bits, size))
