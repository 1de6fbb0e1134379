"""Final exchange after the mission: all vehicles in contact end with identical knowledge."""

from typing import Any

from missions.runs.assembly import assemble
from missions.runs.results import MemoryResults
from missions.runs.run import run, settled_of
from missions.runs.setup import resolved
from missions.scenarios import Scenario, load
from remoras.fleet.final_exchange import Settled

CUT = "scenario.duration_s=900"
"""The mission is ended in its midst, with much that is still to be told."""
SETTLED = "scenario.settle_s=900"


def scenario(*settings: str) -> Scenario:
    return load("mapping-rendezvous", [("--set", one) for one in ("channel.per=0.4", *settings)])


def test_a_deaf_vehicle_prolongs_the_final_exchange_and_the_others_agree() -> None:
    setup = resolved(scenario(CUT, SETTLED, "fault=[{kind='deaf',vehicle='AUV02',at_s=300}]"))
    fleet = assemble(setup, 1)
    fleet.run()
    assert settled_of(setup, fleet) == Settled(900.0, False)
    others = {v.beliefs.model.state_hash() for v in fleet.vehicles if v.name != "AUV02"}
    assert len(others) == 1


def test_the_final_exchange_waits_for_discarded_blocks() -> None:
    """AUV01 gives up a block of ASV00 at the end: nothing is open, and ASV00 has to hear of it and say it again."""
    setup = resolved(load("mapping-rendezvous", [("--set", SETTLED), ("--set", "scenario.duration_s=300")]))
    fleet = assemble(setup, 1)
    fleet.run()
    assert settled_of(setup, fleet) is not None
    manager, model = fleet.vehicles[2].radio.manager, fleet.vehicles[2].beliefs.model
    manager.give_up([next(guid for guid, _ in model.items() if guid[0] == 0)])
    assert not any(vehicle.radio.manager.n_open for vehicle in fleet.vehicles)
    settled = settled_of(setup, fleet)
    assert settled.complete
    assert settled.time_s > 0.0
    assert not list(manager.postponed())


def of_mission(results: MemoryResults) -> dict[str, Any]:
    """Summary and tables, without what is said of the time after the mission, and of the machine."""
    summary = {name: one for name, one in results.summary.items() if name != "run_id"}
    tables = {name: results.table(name).to_pylist() for name in results.tables if name != "settling"}
    return {"settling_s": None, "settled": None, **summary} | tables


def test_the_final_exchange_changes_no_mission_result() -> None:
    """Every metric and every table but one is that of the run without it."""
    without = of_mission(MemoryResults(run(scenario(CUT), 1)))
    results = MemoryResults(run(scenario(CUT, SETTLED), 1))
    found = of_mission(results)
    assert (without.pop("settling_s"), without.pop("settled")) == (None, None)
    assert found.pop("settling_s") > 0.0
    assert found.pop("settled") is True
    assert found == without
    rows = results.table("settling").to_pylist()
    assert {row["event"] for row in rows} <= {"received", "acknowledged"}
    assert all(row["time_s"] >= 900.0 for row in rows)


def test_the_final_exchange_waits_for_vehicles_that_seem_absent() -> None:
    """AUV02 has not heard ASV00 for long when the mission ends, and would tell it fourteen items that it lacks."""
    silence = "channel.blackout=[{from_s=150, until_s=300, vehicle='ASV00'}]"
    cut = ("scenario.duration_s=300", SETTLED, "communication.crc_bits=32", "channel.source_level_db=120.0", silence)
    setup = resolved(load("arrows-archaeology", [("--set", one) for one in cut]))
    fleet = assemble(setup, 53)
    fleet.run()
    teller, lacking = fleet.vehicles[2].radio.manager, fleet.vehicles[0].radio.manager
    assert not any(vehicle.radio.manager.n_open for vehicle in fleet.vehicles)
    assert sum(node == 0 and not lacking.holds(uid) for node, uid in teller.postponed()) == 14
    settled = settled_of(setup, fleet)
    assert settled.complete
    assert len({vehicle.beliefs.model.state_hash() for vehicle in fleet.vehicles}) == 1
