"""The recorder: each table is declared once by its writer, and rows are not modified."""

import pytest

from remoras.errors import PluginError
from remoras.recorder import KINDS, TABLES, TIME, VEHICLE, Column, Recorder, Table

DEPTHS = Table("depths", (TIME, VEHICLE, Column("depth_m", "float", "m")))


@pytest.mark.parametrize("table", [*TABLES, DEPTHS], ids=lambda table: table.name)
def test_columns_need_unique_names_writable_types_and_matching_units(table: Table) -> None:
    assert len(set(table.column_names)) == len(table.columns)
    units = {"s": "s", "m": "m", "rad": "rad", "mps": "m/s", "j": "J", "bits": "bit"}
    for column in table.columns:
        assert column.kind in KINDS
        suffix = column.name.rpartition("_")[2]
        assert "_" not in column.name or suffix not in units or column.unit == units[suffix]


@pytest.mark.parametrize("columns", [DEPTHS.columns[:2], (*DEPTHS.columns[:2], Column("depth_m", "float", "ft"))])
def test_two_tables_of_one_name_with_other_columns_or_units_are_refused(columns: tuple[Column, ...]) -> None:
    with pytest.raises(
        PluginError, match=r"table 'depths' is declared twice, once with the columns time_s, vehicle, d"
    ):
        Recorder([DEPTHS, Table("depths", columns)])
    with pytest.raises(PluginError, match=r"table 'packets' is declared twice.*rename one"):
        Recorder([Table("packets", columns)])


@pytest.mark.parametrize("name", ["", "../depths", "a/b", "a\\b", ".hidden"])
def test_a_table_name_unfit_for_a_file_is_refused(name: str) -> None:
    with pytest.raises(PluginError, match="its name becomes a file name"):
        Table(name, (TIME, VEHICLE))


@pytest.mark.parametrize(("columns", "says"), [((TIME, TIME), "listed 2 times"), ((Column("key", "str"),), "sweeps")])
def test_columns_that_contradict_each_other_are_refused(columns: tuple[Column, ...], says: str) -> None:
    with pytest.raises(PluginError, match=rf"table 'depths', column '(time_s|key)': .*{says}"):
        Table("depths", columns)
