"""Conformance checks of faults (``remoras.DeclaredFault``), raising ``AssertionError``."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from missions.errors import ConfigurationError
from missions.files import toml_value
from missions.runs.assembly import assemble, faults_in
from missions.runs.setup import Setup, resolved
from missions.scenarios import load
from missions.scenarios.faults import DeclaredFault, kind_named
from remoras.condition import SOUND
from remoras.errors import PluginError
from remoras.fleet.fleet import Fleet
from remoras.testing.behaviours import passed
from remoras.testing.missions import recorded_rows

SCENARIO, VEHICLE, SEED = "mapping-rendezvous", "AUV01", 1
FROM_S, UNTIL_S, END_S = 20.0, 40.0, 60.0


def _setup(*tables: Mapping[str, Any]) -> Setup:
    settings = [f"fault={toml_value(list(tables))}", f"scenario.duration_s={END_S}", "channel.per=0.3"]
    try:
        return resolved(load(SCENARIO, [("--set", setting) for setting in settings]))
    except ConfigurationError as error:
        raise AssertionError(f"a scenario with {toml_value(dict(tables[0]))} is refused: {error}") from None


def _table(name: str, keys: Mapping[str, Any]) -> dict[str, Any]:
    kind = kind_named(name)
    table: dict[str, Any] = {"kind": name, "vehicle": VEHICLE, "at_s": FROM_S, "until_s": UNTIL_S}
    required = dict.fromkeys(set(kind.own_keys()).intersection(kind.REQUIRED), 1.0)
    merged = {**table, **required, **keys}
    return {key: value for key, value in merged.items() if key not in kind.NOT_USED}


def _sailed(setup: Setup, until_s: float) -> Fleet:
    fleet = assemble(setup, SEED)
    try:
        while fleet.running and fleet.now_s < until_s:
            fleet.step()
    except PluginError as error:
        raise AssertionError(str(error)) from None
    return fleet


def check_it_is_declared(name: str, keys: Mapping[str, Any]) -> None:
    """Check the required parts, and that a scenario accepts the fault."""
    assert kind_named(name).TEXT, "lacks TEXT, a line that describes the fault"
    _setup(_table(name, keys))


def check_its_rows(name: str, keys: Mapping[str, Any]) -> None:
    """Check the two rows of the table of faults, and that the run is deterministic."""
    setup = _setup(_table(name, keys))
    (fault,) = faults_in(setup, SEED)
    fleets = [_sailed(setup, END_S) for _ in range(2)]
    first, again = (recorded_rows(fleet.recorder) for fleet in fleets)
    rows = [(row[0], row[3]) for row in first["faults"] if row[1:3] == (VEHICLE, name)]
    due = [(fault.from_s, fault.detail), (fault.until_s, "over")]
    assert rows == due, f"its rows in the table of faults are {rows}; expected: {due}"
    assert first == again, "the same run gives other rows when repeated: draw only by the given seed"


def check_what_is_over_is_over(name: str, keys: Mapping[str, Any]) -> None:
    """Check that the vehicle is sound after the fault."""
    after = _sailed(_setup(_table(name, keys)), UNTIL_S + 5.0).named(VEHICLE)
    assert after.condition == SOUND, f"its end leaves the vehicle {after.condition}"


CHECKS: tuple[Callable[[str, Mapping[str, Any]], None], ...] = (
    check_it_is_declared,
    check_its_rows,
    check_what_is_over_is_over,
)


def conforms(name: str, keys: Mapping[str, Any] | None = None) -> Iterator[str]:
    """Run all checks of a kind and yield their names; required ``keys`` default to 1.0."""
    kind: type[DeclaredFault] = kind_named(name)
    assert issubclass(kind, DeclaredFault)
    return passed(CHECKS, name, keys or {})


def check(name: str, keys: Mapping[str, Any] | None = None) -> None:
    """Run all checks of a kind; arguments and errors as ``conforms``."""
    for _ in conforms(name, keys):
        pass
