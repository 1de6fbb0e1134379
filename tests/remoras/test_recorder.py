"""The recorder: tables are declared by who writes them, once, and rows stay as they were given."""

import pytest

from remoras.errors import PluginError
from remoras.recorder import KINDS, TABLES, TIME, VEHICLE, Column, Recorder, Table

DEPTHS = Table("depths", (TIME, VEHICLE, Column("depth_m", "float", "m")))


@pytest.mark.parametrize("table", [*TABLES, DEPTHS], ids=lambda table: table.name)
def test_columns_have_names_of_their_own_kinds_that_can_be_written_and_units_that_their_names_say(table: Table) -> None:
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
def test_a_table_whose_name_is_none_for_a_file_is_refused(name: str) -> None:
    with pytest.raises(PluginError, match="its name is that of a file"):
        Table(name, (TIME, VEHICLE))


@pytest.mark.parametrize(("columns", "says"), [((TIME, TIME), "listed 2 times"), ((Column("key", "str"),), "sweeps")])
def test_columns_that_contradict_each_other_are_refused(columns: tuple[Column, ...], says: str) -> None:
    with pytest.raises(PluginError, match=rf"table 'depths', column '(time_s|key)': .*{says}"):
        Table("depths", columns)
