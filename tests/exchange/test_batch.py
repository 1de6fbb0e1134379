"""Tables of observations as bytes: what comes out is what a packet would have carried."""

import random
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exchange import Observations, decode_observations, encode_observations
from exchange.errors import ConfigurationError, PeerFault
from remoras.testing.policies import MAPPED_CELL, POSITION, TBOX, codec_of, instances
from worldmodel import ValueKind

N_NODES = 4
CODEC = codec_of(N_NODES)
LOCATION = TBOX.attribute_named("location").uid


def table(attribute: int, n_rows: int, seed: int = 0) -> Observations:
    """Seeded observations, values on their grid."""
    draws, kind = np.random.default_rng(seed), TBOX.attributes[attribute]
    times_s = np.array([CODEC.fragments.time.decode(int(n)) for n in draws.integers(0, 144_001, n_rows)])
    if kind.fields:
        columns = [[field.decode(int(n)) for n in draws.integers(0, field.n_values, n_rows)] for field in kind.fields]
    else:
        columns = [list(draws.integers(0, CODEC.fragments.facts.count(attribute), n_rows))]
    sigmas = None
    if kind.uncertainty is not None:
        grid = kind.uncertainty
        sigmas = np.array([grid.decode(int(n)) for n in draws.integers(0, grid.n_values, n_rows)])
        sigmas[::3] = np.nan
    return Observations(
        attribute,
        draws.integers(0, N_NODES, n_rows),
        draws.integers(0, 4, n_rows),
        draws.integers(0, 1 << 14, n_rows),
        times_s,
        draws.integers(0, len(instances(N_NODES)), n_rows),
        np.array(columns, np.float64).reshape(max(1, len(kind.fields)), n_rows).T,
        sigmas,
    )


def assert_same(one: Observations, other: Observations) -> None:
    assert one.attribute == other.attribute
    for name in ("origins", "epochs", "sequences", "times_s", "subjects", "values"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), name)
    if one.uncertainties is not None or other.uncertainties is not None:
        np.testing.assert_array_equal(one.uncertainties, other.uncertainties)


@pytest.mark.parametrize("attribute", [kind.uid for kind in TBOX.attributes])
def test_a_table_of_any_attribute_arrives_as_it_was_sent(attribute: int):
    told = table(attribute, 100)
    assert_same(decode_observations(CODEC, encode_observations(CODEC, told)), told)


@pytest.mark.parametrize("n_rows", [0, 1, 2, 7, (1 << 14) - 1, 1 << 14, (1 << 14) + 1])
def test_a_table_may_have_any_number_of_rows(n_rows: int):
    """Also more than are packed at once."""
    told = table(POSITION, n_rows)
    data = encode_observations(CODEC, told)
    record_bits = 2 + 8 + 14 + 18 + 3 + 32  # origin, epoch, sequence, time, one of 8 instances, a place
    assert len(data) == 10 + -(-n_rows * record_bits // 8)
    assert_same(decode_observations(CODEC, data), told)


@given(st.floats(-10_000.0, 10_000.0), st.floats(0.0, 14_400.0))
def test_values_are_rounded_as_in_packets(east_m: float, time_s: float):
    column = np.zeros(1, np.int64)
    told = Observations(POSITION, column, column, column, np.array([time_s]), column, np.array([[east_m, 0.0]]))
    received = decode_observations(CODEC, encode_observations(CODEC, told))
    field, time = TBOX.attributes[POSITION].fields[0], CODEC.fragments.time
    assert received.values[0, 0] == field.quantise(east_m)
    assert received.times_s[0] == time.decode(time.encode(time_s))


@pytest.mark.parametrize(
    ("column", "value", "why"),
    [
        ("origins", 4, "origins of row 3 does not fit 2 bits"),
        ("sequences", 1 << 14, "sequences of row 3 does not fit 14 bits"),
        ("times_s", -1.0, "times_s of row 3"),
        ("values", 10_001.0e3, "values of row 3 does not fit 16 bits: send it in a packet"),
        ("values", np.nan, "values of row 3"),
        ("subjects", -1, "subjects of row 3"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_row(column: str, value: float, why: str):
    told = table(POSITION, 10)
    getattr(told, column)[3] = value
    with pytest.raises(ConfigurationError, match=why):
        encode_observations(CODEC, told)


def test_columns_of_another_length_or_shape_are_refused():
    told = table(POSITION, 10)
    columns = {name: getattr(told, name) for name in ("origins", "epochs", "sequences", "times_s", "subjects")}
    with pytest.raises(ConfigurationError, match="column epochs has 9 rows, times_s has 10"):
        encode_observations(CODEC, Observations(POSITION, **{**columns, "epochs": told.epochs[1:]}, values=told.values))
    with pytest.raises(ConfigurationError, match=r"shape \(10, 1\); allowed: \(n, 2\)"):
        encode_observations(CODEC, Observations(POSITION, **columns, values=told.values[:, :1]))


def test_a_table_that_was_cut_short_or_is_of_another_fleet_is_refused():
    data = encode_observations(CODEC, table(MAPPED_CELL, 20))
    for short in (b"", data[:9], data[:-1], data + b"\0"):
        with pytest.raises(PeerFault):
            decode_observations(CODEC, short)
    with pytest.raises(PeerFault, match="definition hash"):
        decode_observations(codec_of(5), data)
    with pytest.raises(PeerFault, match="attribute 65535"):
        decode_observations(CODEC, data[:4] + b"\xff\xff" + data[6:])


@given(st.randoms(use_true_random=False), st.integers(0, 6), st.sampled_from([MAPPED_CELL, POSITION, LOCATION]))
def test_random_bytes_are_a_table_or_a_fault(dice: random.Random, n_rows: int, attribute: int):
    size = len(encode_observations(CODEC, table(attribute, n_rows))) - 10
    head = CODEC.definition + attribute.to_bytes(2, "big") + n_rows.to_bytes(4, "big")
    with suppress(PeerFault):
        assert len(decode_observations(CODEC, head + dice.randbytes(size))) == n_rows


def test_kinds_without_numbers_are_checked():
    """Of 8 instances and the classes of the TBox, links and types have names; a table of more is no table."""
    kind = next(one for one in TBOX.attributes if one.kind is ValueKind.SYMBOL)
    column = np.zeros(1, np.int64)
    told = Observations(kind.uid, column, column, column, np.zeros(1), column, np.array([[float(len(kind.symbols))]]))
    if len(kind.symbols).bit_count() > 1:  # its bits have room for one more
        with pytest.raises(PeerFault, match=f"{kind.name} {len(kind.symbols)} of row 0"):
            decode_observations(CODEC, encode_observations(CODEC, told))
