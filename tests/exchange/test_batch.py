"""Tables of observations as bytes: what comes out is what a packet would have carried."""

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.manager_fleet import MAPPED_CELL, POSITION, TBOX, codec_of, instances
from exchange import Observations, decode_observations, encode_observations
from exchange.errors import ConfigurationError, PeerFault

N_NODES = 4
CODEC = codec_of(N_NODES)


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


@given(st.sampled_from(TBOX.attributes), st.integers(0, 60), st.integers(0, 9), st.randoms(use_true_random=False))
def test_a_table_arrives_as_it_was_sent_and_any_bytes_are_a_table_or_a_fault(kind, n_rows, seed, dice):
    told = table(kind.uid, n_rows, seed)
    data = encode_observations(CODEC, told)
    assert_same(decode_observations(CODEC, data), told)
    with suppress(PeerFault):
        assert len(decode_observations(CODEC, data[:10] + dice.randbytes(len(data) - 10))) == n_rows


@pytest.mark.parametrize("n_rows", [0, 1, 2, 7, (1 << 14) - 1, 1 << 14, (1 << 14) + 1])
def test_a_table_may_have_any_number_of_rows(n_rows: int):
    """Also more than are packed at once."""
    told = table(POSITION, n_rows)
    data = encode_observations(CODEC, told)
    record_bits = 2 + 8 + 14 + 18 + 3 + 32  # origin, epoch, sequence, time, one of 8 instances, a place
    assert len(data) == 10 + -(-n_rows * record_bits // 8)
    assert_same(decode_observations(CODEC, data), told)


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


def test_a_table_that_was_cut_short_or_is_of_another_fleet_is_refused():
    data = encode_observations(CODEC, table(MAPPED_CELL, 20))
    for short in (b"", data[:9], data[:-1], data + b"\0"):
        with pytest.raises(PeerFault):
            decode_observations(CODEC, short)
    with pytest.raises(PeerFault, match="definition hash"):
        decode_observations(codec_of(5), data)
    with pytest.raises(PeerFault, match="attribute 65535"):
        decode_observations(CODEC, data[:4] + b"\xff\xff" + data[6:])
