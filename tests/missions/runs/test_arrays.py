"""Columns as Arrow arrays are, to the last bit of a stream of them, what pyarrow makes of the same values itself."""

import io
import subprocess
import sys
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from missions.errors import OutputError
from missions.runs.tables import DIGITS, STEPS, TYPES, WHOLE, arrow_table, column_array, constant_array, numbers_array
from remoras.recorder import KINDS, TRAJECTORIES, Column, Rows, Table

TEXT = st.text(max_size=4)
OF_KIND: dict[str, st.SearchStrategy[Any]] = {
    "float": st.floats(), "int": st.integers(-(2**63), 2**63 - 1), "str": TEXT, "bool": st.booleans(),
    "list": st.lists(TEXT, max_size=3), "floats": st.lists(st.floats(), max_size=3),
    "ints": st.lists(st.integers(-(2**63), 2**63 - 1), max_size=3),
}  # fmt: skip
UNITS = ["", "s", "m", "J", "1", "bit"]


def kept(values: pa.Array, unit: str) -> pa.Array:
    """Numbers to the step of their unit, by pyarrow alone."""
    numbers = values.to_numpy(zero_copy_only=False)
    if unit in WHOLE:
        with np.errstate(all="ignore"):
            return pa.array(np.rint(numbers), mask=~np.isfinite(numbers)).cast(pa.int64())
    if unit in STEPS:
        numbers = np.rint(numbers / STEPS[unit]) * STEPS[unit] + 0.0
    elif unit in DIGITS:
        numbers = np.round(numbers, DIGITS[unit])
    else:
        return values
    return pa.array(numbers, mask=np.asarray(values.is_null())) if values.null_count else pa.array(numbers)


def expected(values: list[Any], column: Column) -> pa.Array:
    array = pa.array(values, TYPES[column.kind])
    if column.kind == "float":
        return kept(array, column.unit)
    if column.kind == "floats":
        return pa.ListArray.from_arrays(array.offsets, kept(array.values, column.unit))
    return array


def stream(table: pa.Table) -> bytes:
    content = io.BytesIO()
    with pa.ipc.new_stream(content, table.schema) as out:
        out.write_table(table)
    return content.getvalue()


def streamed(array: pa.Array) -> bytes:
    return stream(pa.Table.from_arrays([array], names=["a"]))


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("kind", KINDS)
@given(data=st.data())
def test_a_column_is_what_pyarrow_makes_of_it(kind: str, data: st.DataObject):
    value = OF_KIND[kind] if kind in ("list", "floats", "ints") else st.one_of(st.none(), OF_KIND[kind])
    if kind in ("float", "floats"):
        value = st.one_of(st.none(), st.floats(-1e12, 1e12)) if kind == "float" else st.lists(st.floats(-1e12, 1e12))
    values = data.draw(st.one_of(st.lists(value, max_size=20), st.lists(OF_KIND[kind], max_size=20)))
    unit = data.draw(st.sampled_from(UNITS)) if kind in ("float", "floats") else ""
    if unit == "J":
        values = [None if isinstance(v, float) and abs(v) > 1e15 else v for v in values]
        values = [[e for e in v if abs(e) < 1e15] if isinstance(v, list) else v for v in values]
    column = Column("a", kind, unit)
    rows = Rows((value,) for value in values)
    if data.draw(st.booleans()):
        rows.pack()
    made = arrow_table(Table("odd", (column,)), rows)
    assert streamed(made.column(0).combine_chunks()) == streamed(expected(values, column))


def test_trajectories_are_in_the_order_of_the_vehicles_and_of_time():
    names = ["b", "a", "c", "a", "b", "a"]
    rows = Rows((float(n), name, *[n * 0.5] * 6) for n, name in enumerate(names))
    plain = [*rows]
    packed = arrow_table(TRAJECTORIES, rows, "key")
    assert packed.column("vehicle").to_pylist() == sorted(names)
    assert packed.column("time_s").to_pylist() == [1.0, 3.0, 5.0, 0.0, 4.0, 2.0]
    assert stream(packed) == stream(arrow_table(TRAJECTORIES, plain, "key"))


def test_the_key_is_the_same_in_all_rows():
    assert streamed(constant_array("kéy", 3)) == streamed(pa.array(["kéy"] * 3))
    assert streamed(constant_array("key", 0)) == streamed(pa.array([], pa.string()))


@pytest.mark.parametrize(
    ("kind", "value"),
    [("float", "far"), ("str", 7), ("bool", "yes"), ("list", 3), ("floats", ["x"]), ("int", 2**70)],
)
def test_a_value_that_does_not_fit_is_told_with_its_table(kind: str, value: object):
    with pytest.raises((OutputError, OverflowError)):
        arrow_table(Table("odd", (Column("a", kind),)), [(value,)])


def test_a_row_that_is_too_short_is_told_with_its_table():
    with pytest.raises(OutputError, match="table odd: a row does not fit its columns a \\(int\\), b \\(int\\)"):
        arrow_table(Table("odd", (Column("a", "int"), Column("b", "int"))), Rows([(1, 2), (3,)]))


def test_what_is_no_float_but_a_number_is_taken_as_before():
    def keep(numbers: Any, missing: Any) -> pa.Array:
        return numbers_array(numbers, pa.float64(), missing)

    values = [1, 2.5, np.float64(3.5), None]
    assert streamed(column_array(values, "float", keep)) == streamed(pa.array(values, pa.float64()))


def test_a_run_that_is_written_loads_no_pandas(tmp_path):
    code = (
        "import sys; from pathlib import Path; from missions.runs.results import write_results;"
        "from missions.runs.run import run; from missions.scenarios import load;"
        "write_results(run(load('mapping-rendezvous', [('--set', 'scenario.duration_s=60')])), Path(sys.argv[1]));"
        "print({'pandas', 'scipy', 'networkx', 'matplotlib'} & sys.modules.keys())"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "out")], capture_output=True, text=True, check=True
    )
    assert done.stdout == "set()\n"
