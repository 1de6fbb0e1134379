"""Network coding: GF(256), its coefficients, and decoding."""

from hypothesis import given
from hypothesis import strategies as st

from exchange.policy.coding import (
    MOST_ROWS,
    Decoder,
    added,
    coefficient,
    inverse,
    scaled,
    symbol,
    symbol_key,
    times,
)

NUMBERS = st.integers(0, 255)


def by_polynomials(a: int, b: int) -> int:
    """Product of polynomials, reduced bit by bit: the definition."""
    total = 0
    for bit in range(8):
        if b >> bit & 1:
            total ^= a << bit
    for bit in range(14, 7, -1):
        if total >> bit & 1:
            total ^= 0x11D << bit - 8
    return total


@given(NUMBERS, NUMBERS, NUMBERS)
def test_gf256_satisfies_the_field_axioms(a: int, b: int, c: int) -> None:
    assert times(a, b) == by_polynomials(a, b) == times(b, a)
    assert times(a, b ^ c) == times(a, b) ^ times(a, c)
    assert times(times(a, b), c) == times(a, times(b, c))
    assert a == 0 or times(a, inverse(a)) == 1


def test_one_symbol_per_missing_item_nearly_always_decodes() -> None:
    """A random square matrix over 256 numbers is singular about once in 255; these have no zeros, and little else."""
    items = {(number % 3, number): bytes([number, 7 * number % 256, 1]) for number in range(6)}
    n_decoded = 0
    for slot in range(300):
        decoder = Decoder()
        found: dict[tuple[int, int], bytes] = {}
        for place in range(6):
            key = symbol_key(slot, place)
            unknown = {name: coefficient(key, *name) for name in items}
            found |= decoder.add(unknown, symbol(items, key, 3))
        assert all(data == items[name] for name, data in found.items())
        n_decoded += len(found) == 6
    assert 290 <= n_decoded < 300


@given(st.data())
def test_decoded_items_equal_the_sent_items(data: st.DataObject) -> None:
    """Any items, in any symbols, with some learned otherwise in between: what is found is right."""
    n_items = data.draw(st.integers(1, 6))
    items = {(0, number): data.draw(st.binary(min_size=1, max_size=4)) for number in range(n_items)}
    decoder = Decoder()
    known: dict[tuple[int, int], bytes] = {}
    for slot in range(data.draw(st.integers(1, 12))):
        found: dict[tuple[int, int], bytes] = {}
        if data.draw(st.booleans()):
            over = {name: items[name] for name in sorted(data.draw(st.sets(st.sampled_from(sorted(items)))))}
            key = symbol_key(slot, 0)
            rest = symbol(over, key, 4)
            for name in over.keys() & known.keys():
                rest = added(rest, scaled(known[name], coefficient(key, *name)))
            found = decoder.add({name: coefficient(key, *name) for name in over if name not in known}, rest)
        else:
            name = data.draw(st.sampled_from(sorted(items)))
            if name not in known:
                known[name] = items[name].ljust(4, b"\0")
                found = decoder.learn(name, known[name])
        for name, content in found.items():
            assert name not in known
            assert content == items[name].ljust(4, b"\0")
            known[name] = content
        assert len(decoder) <= n_items - len(known)


def test_undecoded_symbols_are_bounded_in_number() -> None:
    decoder = Decoder()
    for number in range(2 * MOST_ROWS):
        assert decoder.add({number: 1, number + 1000: 2}, b"x") == {}
    assert len(decoder) == MOST_ROWS
