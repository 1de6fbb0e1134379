"""The recorder: tables are declared by who writes them, once, and rows stay as they were given."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from remoras.errors import PluginError
from remoras.recorder import KINDS, TABLES, TIME, VEHICLE, Column, Recorder, Table

DEPTHS = Table("depths", (TIME, VEHICLE, Column("depth_m", "float", "m")))


def test_every_run_has_its_tables_and_those_declared_behind_them() -> None:
    recorder = Recorder([DEPTHS])
    assert list(recorder.tables.values()) == [*TABLES, DEPTHS]
    assert all(recorder.rows(name) == [] for name in recorder.tables)


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table.name)
def test_the_fields_of_a_recorder_are_its_tables(table: Table) -> None:
    recorder = Recorder()
    row = tuple(range(len(table.columns)))
    getattr(recorder, table.name).append(row)
    assert recorder.rows(table.name) == [row]


@pytest.mark.parametrize("table", [*TABLES, DEPTHS], ids=lambda table: table.name)
def test_columns_have_names_of_their_own_kinds_that_can_be_written_and_units_that_their_names_say(table: Table) -> None:
    assert len(set(table.column_names)) == len(table.columns)
    units = {"s": "s", "m": "m", "rad": "rad", "mps": "m/s", "j": "J", "bits": "bit"}
    for column in table.columns:
        assert column.kind in KINDS
        suffix = column.name.rpartition("_")[2]
        assert "_" not in column.name or suffix not in units or column.unit == units[suffix]


def test_what_several_declare_alike_is_declared_once_and_shared() -> None:
    """Two vehicles with the same sensor write to one table."""
    recorder = Recorder([DEPTHS, Table("depths", DEPTHS.columns)])
    recorder.rows("depths").append((0.0, "A", 5.0))
    recorder.declare(DEPTHS)
    assert recorder.rows("depths") == [(0.0, "A", 5.0)]
    assert list(recorder.tables).count("depths") == 1


@pytest.mark.parametrize("columns", [DEPTHS.columns[:2], (*DEPTHS.columns[:2], Column("depth_m", "float", "ft"))])
def test_two_tables_of_one_name_with_other_columns_or_units_are_refused(columns: tuple[Column, ...]) -> None:
    with pytest.raises(
        PluginError, match=r"table 'depths' is declared twice, once with the columns time_s, vehicle, d"
    ):
        Recorder([DEPTHS, Table("depths", columns)])
    with pytest.raises(PluginError, match=r"table 'packets' is declared twice.*rename one"):
        Recorder([Table("packets", columns)])


def test_a_refused_table_leaves_the_recorder_as_it_was() -> None:
    recorder = Recorder([DEPTHS])
    recorder.rows("depths").append((0.0, "A", 5.0))
    with pytest.raises(PluginError):
        recorder.declare(Table("depths", ()))
    assert recorder.tables["depths"] == DEPTHS
    assert recorder.rows("depths") == [(0.0, "A", 5.0)]


def test_a_table_that_nobody_declared_is_empty_and_keeps_nothing() -> None:
    recorder = Recorder()
    recorder.rows("depths").append((0.0, "A", 5.0))
    assert recorder.rows("depths") == []
    assert "depths" not in recorder.tables


@given(st.lists(st.tuples(st.sampled_from(["packets", "roles", "depths"]), st.integers()), max_size=20))
def test_rows_are_kept_in_their_order_and_apart(written: list[tuple[str, int]]) -> None:
    recorder, other = Recorder([DEPTHS]), Recorder([DEPTHS])
    for name, value in written:
        recorder.rows(name).append((value,))
    for name in recorder.tables:
        assert recorder.rows(name) == [(value,) for table, value in written if table == name]
        assert other.rows(name) == []


@pytest.mark.parametrize("name", ["", "../depths", "a/b", "a\\b", ".hidden"])
def test_a_table_whose_name_is_none_for_a_file_is_refused(name: str) -> None:
    with pytest.raises(PluginError, match="its name is that of a file"):
        Table(name, (TIME, VEHICLE))


@pytest.mark.parametrize(("columns", "says"), [((TIME, TIME), "listed 2 times"), ((Column("key", "str"),), "sweeps")])
def test_columns_that_contradict_each_other_are_refused(columns: tuple[Column, ...], says: str) -> None:
    with pytest.raises(PluginError, match=rf"table 'depths', column '(time_s|key)': .*{says}"):
        Table("depths", columns)
