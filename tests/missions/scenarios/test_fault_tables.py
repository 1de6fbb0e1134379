"""Tables of faults, bans and limits of world models: meaning, and refusals with their line."""

import pytest
from small_mission import SMALL, line_of

from missions.document import Document
from missions.errors import ConfigurationError
from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from missions.scenarios.faults import DeclaredFault, kind_named
from missions.scenarios.loading import scenario_from
from missions.scenarios.scenario import Scenario

LOST = 'kind = "lost"\nvehicle = "Diver"\nat_s = 300.0\n'
JOINS = 'kind = "joins"\nvehicle = "Diver"\nat_s = 300.0\n'


def with_faults(*tables: str) -> str:
    return SMALL + "".join(f"\n[[fault]]\n{table}" for table in tables)


def read(*tables: str) -> Scenario:
    return scenario_from(Document.of_text(with_faults(*tables), "pond.toml"))


def refused(*tables: str) -> list[str]:
    """Messages about these tables, one line each."""
    with pytest.raises(ConfigurationError) as caught:
        read(*tables)
    return str(caught.value).splitlines()


def declared(kind: str, **keys: object) -> DeclaredFault:
    return kind_named(kind)(kind=kind, **keys)


# What they mean -----------------------------------------------------------------------------------


@pytest.mark.parametrize(("table", "expected"), [
    (LOST, declared("lost", vehicle="Diver", at_s=300.0)),
    ('kind = "slow"\nvehicle = "any"\nat_s = [300, 900.5]\nuntil_s = 1000\nfactor = 0.25',
     declared("slow", vehicle="any", at_s=(300.0, 900.5), until_s=1000.0, factor=0.25)),
])  # fmt: skip
def test_table_is_read_as_its_declared_fault(table: str, expected: DeclaredFault) -> None:
    text = with_faults(table).replace('playable_roles = ["Hand",', 'playable_roles = ["Skipper", "Hand",')
    (found,) = scenario_from(Document.of_text(text, "pond.toml")).fault
    assert found == expected


# Set from outside ---------------------------------------------------------------------------------


def test_faults_can_be_set_as_a_list_or_by_key() -> None:
    tables = 'fault=[{kind="lost",vehicle="AUV01",at_s=300},{kind="mute",vehicle="any",rate_per_h=1}]'
    scenario = load("mapping-rendezvous", [("--set", tables), ("--set", "fault.1.at_s=[100,200]")])
    assert [table.vehicle for table in scenario.fault] == ["AUV01", "any"]
    assert scenario.fault[0].at_s == (100.0, 200.0)


# What is refused ----------------------------------------------------------------------------------


@pytest.mark.parametrize(("table", "key", "says"), [
    ('kind = "dead"\nvehicle = "Diver"\nat_s = 3', "kind",
     "allowed: lost, mute, deaf, slow, sensor, joins, biased, restarts, drains, package.module:Class; did you"),
    ('kind = "lost"\nvehicle = "Divr"\nat_s = 3', "vehicle", "Boat, Diver, any, head of GROUP; did you mean 'Diver'"),
    ('kind = "lost"\nat_s = 3', "vehicle", "missing"),
    ('kind = "lost"\nvehicle = "Diver"', "at_s", "or give rate_per_h"),
    ('kind = "lost"\nvehicle = "Diver"\nat_s = 3\nrate_per_h = 1', "rate_per_h", "leave one out"),
    ('kind = "lost"\nvehicle = "Diver"\nat_s = -1', "at_s", "0 or more, or [earliest, latest]"),
    ('kind = "lost"\nvehicle = "Diver"\nat_s = 30\nuntil_s = 30', "until_s", "must be above at_s = 30"),
    ('kind = "lost"\nvehicle = "Diver"\nat_s = 3\nfactor = 0.5', "factor", "not used by kind lost, only by slow"),
    ('kind = "sensor"\nvehicle = "Diver"\nat_s = 3\nsensor = "sonar"', "sensor", "allowed: mapping"),
    ('kind = "sensor"\nvehicle = "Boat"\nat_s = 3', "vehicle", "has no sensor"),
    ('kind = "sensor"\nvehicle = "head of Team"\nat_s = 3', "vehicle", "has no sensor"),
    ('kind = "lost"\nvehicle = "Diver"\nat_s = 1200', "at_s", "must be below scenario.duration_s = 1200"),
    ('kind = "joins"\nvehicle = "any"\nat_s = 3', "vehicle", "has to be named: Boat, Diver"),
    ('kind = "joins"\nvehicle = "Diver"\nrate_per_h = 3', "rate_per_h", "give at_s"),
    (LOST + "untill_s = 400", "untill_s", "did you mean 'until_s'"),
])  # fmt: skip
def test_wrong_key_is_one_message_with_its_line(table: str, key: str, says: str) -> None:
    text = with_faults(table)
    header = line_of(text, "[[fault]]")
    given = [number for number, line in enumerate(table.splitlines(), header + 1) if line.startswith(f"{key} =")]
    (said,) = refused(table)
    assert said.startswith(f"pond.toml:{given[0] if given else header}: fault.1.{key}")
    assert says in said


@pytest.mark.parametrize(("first", "second", "says"), [
    (LOST, LOST, "lost twice, here and by fault.1"),
    (LOST + "until_s = 400", LOST.replace("300.0", "[399, 500]"), "lost twice"),
    (JOINS, JOINS.replace("300.0", "500.0"), "joins twice, here and by fault.1"),
])  # fmt: skip
def test_vehicle_lost_twice_without_return_or_joining_twice_is_refused(first: str, second: str, says: str) -> None:
    (said,) = refused(first, second)
    assert 'fault.2.vehicle = "Diver"' in said
    assert says in said


def test_returned_vehicle_may_be_lost_again() -> None:
    assert len(read(LOST + "until_s = 400", LOST.replace("300.0", "[400, 500]")).fault) == 2
    assert len(read(LOST, LOST.replace("lost", "mute"), LOST.replace("lost", "deaf")).fault) == 3


def test_more_random_faults_than_vehicles_are_refused() -> None:
    """In the pond only the diver has a sensor or a job."""
    lost = LOST.replace("Diver", "any")
    assert len(read(lost, lost.replace("lost", "mute")).fault) == 2
    (said,) = refused(lost, lost)
    assert "fault.2.vehicle" in said
    assert said.endswith("are Diver")


def test_waiting_limits_of_blocks_reach_every_vehicle() -> None:
    loaded = load("mapping-rendezvous", [("--set", "worldmodel={waiting_s=30.0, waiting_blocks=5}")])
    for vehicle in assemble(resolved(loaded), 1).vehicles:
        arrivals = vehicle.beliefs.model.arrivals
        assert (arrivals.waiting_s, arrivals.waiting_blocks) == (30.0, 5)
