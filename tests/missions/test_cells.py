"""Cells share the slots of one sea, and gateways pass facts on from one to the next."""

from __future__ import annotations

import copy
import itertools
from collections import Counter
from typing import Any

import pytest
from sampling import sampled

from benchmarks.cells import raw_of, scenario_of
from exchange.acoustics import loss
from exchange.packets import Fragment
from exchange.policies import POLICIES
from exchange.schedule import TdmaSchedule
from exchange.wire.codec import Codec
from missions.errors import ConfigurationError
from missions.features.cells import Plan, coloured
from missions.runs.assembly import assemble
from missions.runs.results import MemoryResults
from missions.runs.run import Run, run
from missions.runs.setup import resolved
from missions.runs.summary import summary
from missions.scenarios import Scenario, load
from remoras.fleet import Fleet
from remoras.flotilla import Address, Flotilla
from remoras.separation import boxes_apart_m
from worldmodel import PropertyValue, core_ontology_paths, read_tbox

BASE = "mapping-rendezvous"
FIRST, SECOND = "Gateway c0r0 to c1r0", "Gateway c1r0 to c0r0"


def in_a_row(n_cells: int = 3, size: int = 6, hops: int = 2, **joined: bool) -> dict[str, Any]:
    """Tables of cells in a row, each joined with the next; the last takes longest."""
    raw = raw_of(n_cells, 1, size, hops=hops, **joined)
    for vehicle in raw["vehicle"]:
        if vehicle["name"] in raw["cell"][-1]["vehicles"]:
            vehicle["survey_speed_mps"] *= 0.6
    return raw


def cell_of(scenario: Scenario) -> dict[str, str]:
    return {name: cell.name for cell in scenario.of_feature("cell") for name in cell.vehicles}


def heard_from_afar(made: Run) -> Counter[tuple[str, str]]:
    """How many items vehicles of a cell have of vehicles of another, by that and their own."""
    cells = cell_of(made.scenario)
    return Counter(
        (cells[origin], cells[name])
        for _, name, _, origin, event in made.recorder.knowledge
        if event == "received" and cells[name] != cells[origin]
    )


def done(*settings: str, raw: dict[str, Any] | None = None, seed: int = 1) -> Run:
    lossy = [] if any("channel.per" in setting for setting in settings) else ["channel.per=0.2"]
    return run(scenario_of(raw or in_a_row(), *lossy, *settings), seed)


@pytest.fixture(scope="module")
def three() -> Run:
    """Three cells in a row that complete their missions."""
    return done()


# One cell ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("strategy", ["remoras", "cbba"])
def test_one_cell_gives_the_bytes_of_a_fleet_without(strategy: str) -> None:
    settings = ["fleet.size=10", f"strategy.name={strategy}", "channel.per=0.3", "scenario.duration_s=700.0"]
    settings.append("fault=[{kind='restarts', vehicle='AUV01', at_s=120.0, until_s=260.0, memory='kept'}]")
    plain = load(BASE, [("--set", setting) for setting in settings])
    raw = load(BASE, [("--set", settings[0])]).model_dump(mode="json", exclude_none=True)
    names = {kind: [entry["name"] for entry in raw[kind]] for kind in ("vehicle", "group")}
    raw["cell"] = [{"name": "all", "vehicles": names["vehicle"], "groups": names["group"]}]
    one = scenario_of(raw, *settings[1:])
    assert isinstance(assemble(resolved(one), 5), Flotilla)
    of_fleet, of_cell = (run(scenario, 5) for scenario in (plain, one))
    for table in of_fleet.recorder.tables:
        assert list(of_cell.recorder.rows(table)) == list(of_fleet.recorder.rows(table)), table
    assert summary(of_cell) == summary(of_fleet)
    assert len(of_fleet.recorder.packets) > 200


# Facts ---------------------------------------------------------------------------------------------


def test_a_fact_comes_two_cells_far_under_its_origin(three: Run) -> None:
    assert three.completed
    heard = heard_from_afar(three)
    assert heard["c0r0", "c1r0"] > 0
    assert heard["c0r0", "c2r0"] > 0
    last = "AUV01 c2r0"
    model = MemoryResults(three).known(last, three.end_s).model
    area_done = model.tbox.attribute_named("areaDone").uid
    names = {instance.uid: instance.name for instance in model.common_instances}
    found = {
        names[known.fact.subject]: (names[known.origin], known.time_s)
        for instance in model.common_instances
        for known in model.facts_of(instance.uid, area_done)
    }
    told = {
        row[4]: (row[1], row[2]) for row in three.recorder.items if row[5] == "areaDone" and "Gateway" not in row[1]
    }
    assert {name for name in found if name.endswith("c0r0")}
    assert found == {name: told[name] for name in found}


def test_nothing_comes_farther_than_it_may() -> None:
    heard = heard_from_afar(done(raw=in_a_row(hops=1)))
    assert heard["c0r0", "c1r0"] > 0
    assert not heard["c0r0", "c2r0"]


def test_nothing_passes_a_gateway_that_is_lost(three: Run) -> None:
    lost = done(f"fault=[{{kind='lost', vehicle='{FIRST}', at_s=60.0}}]")
    heard = heard_from_afar(lost)
    assert not any("c0r0" in pair for pair in heard)
    assert heard["c1r0", "c2r0"] > 0
    assert lost.completed


def test_nothing_comes_from_cells_that_are_not_joined() -> None:
    assert not heard_from_afar(done("scenario.duration_s=900.0", raw=in_a_row(2, joined=False)))


def test_nobody_takes_a_fact_in_twice(three: Run) -> None:
    received = Counter((row[1], row[2]) for row in three.recorder.knowledge if row[4] == "received")
    assert set(received.values()) == {1}


def test_what_is_told_is_what_may_be_passed_on(three: Run) -> None:
    attribute = {row[0]: row[5] for row in three.recorder.items}
    cells = cell_of(three.scenario)
    for _, name, item, origin, event in three.recorder.knowledge:
        if event == "received" and cells[name] != cells[origin]:
            assert attribute[item] == "areaDone"


FAULTS = {
    "a gateway forgets": f"kind='restarts', vehicle='{FIRST}', at_s=700.0, until_s=900.0, memory='lost'",
    "a gateway remembers": f"kind='restarts', vehicle='{FIRST}', at_s=700.0, until_s=900.0, memory='kept'",
    "a gateway is deaf": f"kind='deaf', vehicle='{FIRST}', at_s=400.0, until_s=900.0",
    "a gateway is mute": f"kind='mute', vehicle='{FIRST}', at_s=400.0, until_s=900.0",
    "a gateway is away": f"kind='lost', vehicle='{FIRST}', at_s=700.0, until_s=1200.0",
    "a member forgets": "kind='restarts', vehicle='AUV01 c1r0', at_s=700.0, until_s=900.0, memory='lost'",
    "anybody": "kind='lost', vehicle='any', at_s=500.0, until_s=900.0",
}


RESTARTS = ("a gateway forgets", "a gateway remembers")


@pytest.mark.parametrize(
    ("fault", "policy"),
    sampled(
        [
            *((fault, "ack") for fault in FAULTS),
            *itertools.product(RESTARTS, ("ack-repeat", "m-ack", "mps-ack-repeat")),
        ],
        *((fault, "ack") for fault in FAULTS),
        *zip(RESTARTS, ("mps-ack-repeat", "m-ack"), strict=True),
    ),
)
def test_nobody_believes_what_is_false(fault: str, policy: str) -> None:
    settings = [f"fault=[{{{FAULTS[fault]}}}]", f"communication.policy={policy}", "channel.per=0.4"]
    made = done(*settings, "scenario.duration_s=2200.0", raw=in_a_row(2), seed=4)
    assert made.n_false_beliefs == 0
    assert "bad packet" not in {row[2] for row in made.recorder.faults}
    if not fault.startswith("anybody"):
        assert heard_from_afar(made)["c0r0", "c1r0"] > 0


def drawn_faults(seed: int, names: list[str]) -> list[dict[str, Any]]:
    """Four faults that a seed draws, each of another vehicle or none of them at once."""

    def uniform(what: int, number: int) -> float:
        return loss.uniform(seed, loss.FAULTS, what, number, 0)

    found = []
    for number, name in enumerate(sorted(names, key=lambda name: uniform(9, names.index(name)))[:4]):
        kind = ("restarts", "lost", "deaf", "mute")[int(4 * uniform(1, number))]
        at_s = round(50.0 + 300.0 * uniform(2, number))
        table: dict[str, Any] = {"kind": kind, "vehicle": name, "at_s": at_s, "until_s": at_s + 40.0 + 10.0 * number}
        if kind == "restarts":
            table["memory"] = "kept" if uniform(3, number) < 0.5 else "lost"
        found.append(table)
    return found


@pytest.mark.parametrize("seed", sampled(range(1, 9), 1, 4, 6))
def test_whatever_befalls_them_what_comes_from_afar_is_what_was_told_there(seed: int) -> None:
    """All that is mapped goes on: no false belief, no packet refused, no fact that its origin did not tell."""
    raw = in_a_row(3, 7)
    raw["cells"]["relays"] = ["areaDone", "mappedCell"]
    seconds = {table["vehicles"][1] for table in raw["gateway"]}
    raw["fault"] = drawn_faults(seed, [entry["name"] for entry in raw["vehicle"] if entry["name"] not in seconds])
    policy = ("ack", "ack-repeat", "m-ack", "mps-ack", "mps-ack-repeat", "m-ack-repeat")[seed % 6]
    strategy = ("remoras", "cbba", "contract-net")[seed % 3]
    settings = f"communication.policy={policy}", f"strategy.name={strategy}", f"channel.per={0.1 * (seed % 5)}"
    made = done(*settings, "scenario.duration_s=700.0", raw=raw, seed=seed)
    assert made.n_false_beliefs == 0
    assert not {row[2] for row in made.recorder.faults} & {"bad packet", "another definition", "slot conflict"}
    heard, cells = heard_from_afar(made), cell_of(made.scenario)
    assert sum(heard.values()) > 30
    told_s = {row[0]: (row[1], row[3]) for row in made.recorder.items if row[7] == "told"}
    for time_s, name, item, origin, event in made.recorder.knowledge:
        if event == "received" and cells[name] != cells[origin]:
            assert told_s[item][0] == origin
            assert told_s[item][1] <= time_s
    held: Counter[tuple[str, str]] = Counter(
        (row[1], row[2]) for row in made.recorder.knowledge if row[4] == "received"
    )
    anew = {table["vehicle"] for table in raw["fault"] if table["kind"] == "restarts"}
    anew |= {second for first, second in Plan(made.scenario).gateways if first in anew}
    assert {name for (name, _), times in held.items() if times > 1} <= anew


def test_who_forgets_is_told_anew_what_came_from_afar() -> None:
    """Cause taken out: who restarts after the facts have come has them again, from who brings them or from others."""
    forgets = "fault=[{kind='restarts', vehicle='AUV02 c1r0', at_s=1900.0, until_s=1950.0, memory='lost'}]"
    made = done(forgets, "scenario.duration_s=2900.0", "mission.meeting_deadline_s=5000.0", raw=in_a_row(2), seed=2)
    cells = cell_of(made.scenario)
    times_s = [
        row[0]
        for row in made.recorder.knowledge
        if row[1] == "AUV02 c1r0" and row[4] == "received" and cells[row[3]] == "c0r0"
    ]
    assert any(time_s < 1900.0 for time_s in times_s)
    assert any(time_s > 1950.0 for time_s in times_s)


# Slots ---------------------------------------------------------------------------------------------


def test_packets_of_cells_near_each_other_are_never_under_way_at_once(three: Run) -> None:
    plan, cells = Plan(three.scenario), cell_of(three.scenario)
    number = {cell.name: n for n, cell in enumerate(plan.cells)}
    packets = sorted(three.recorder.packets, key=lambda row: row[1])
    travel_s = three.scenario.communication.range_m / 1500.0
    shared = 0
    for before, after in itertools.pairwise(packets):
        if after[1] < before[8] + travel_s - 1e-6:
            one, other = (number[cells[row[2]]] for row in (before, after))
            assert plan.colours[one] == plan.colours[other]
            assert one != other
            shared += 1
    assert plan.colours == [0, 1, 0]
    assert shared > 100
    assert not any(row[15] for row in packets)


def test_packets_of_one_colour_meet_where_they_reach_each_other() -> None:
    """The two outer cells speak at once; were their packets noise farther than it is checked, many would be lost."""
    scenario = scenario_of(in_a_row(), "scenario.duration_s=300.0")
    fleets = [assemble(resolved(scenario), 1) for _ in range(2)]
    assert isinstance(fleets[1], Flotilla)
    fleets[1]._water = fleets[1]._water._replace(interference_m=1e5)
    for fleet in fleets:
        fleet.run()
    met = [[row for row in fleet.recorder.packets if row[15]] for fleet in fleets]
    cells = cell_of(scenario)
    assert not met[0]
    assert {cells[row[2]] for row in met[1]} == {"c0r0", "c2r0"}
    assert len(met[1]) > 20


def test_colours_are_as_few_as_greed_finds() -> None:
    ring = [[1, 4], [0, 2], [1, 3], [2, 4], [3, 0]]
    assert coloured(ring, [None] * 5) == [0, 1, 0, 1, 2]
    assert coloured(ring, [3, None, None, None, None]) == [3, 0, 1, 0, 1]
    assert boxes_apart_m((0.0, 0.0, 1.0, 1.0), (0.5, 3.0, 2.0, 4.0)) == 2.0


def test_a_packet_goes_when_the_turn_of_its_cell_has_come() -> None:
    schedule = TdmaSchedule(4, packet_s=1.0, guard_s=5.0, phase_s=2.5)
    assert [schedule.sends_s(slot, 0.0) for slot in (0, 1, 5)] == [2.5, 8.5, 32.5]
    assert schedule.slot_at(schedule.sends_s(5, 0.0)) == 5
    with pytest.raises(Exception, match="guard_s >= phase_s"):
        TdmaSchedule(4, packet_s=1.0, guard_s=2.0, phase_s=2.5)


# On the wire ---------------------------------------------------------------------------------------


def test_origins_beyond_the_nodes_have_numbers_behind_theirs() -> None:
    tbox = read_tbox(*core_ontology_paths())
    codecs = [Codec(tbox, 40, 4, POLICIES["ack"], 64, 600.0, n_beyond=beyond) for beyond in (0, 0, 5)]
    position = tbox.attribute_named("available").uid
    fragment = Fragment(8, 3, 12.0, (PropertyValue(1, position, True),))
    data = codecs[2].encode(1, [0] * 4, [fragment], slot_start_s=20.0)
    assert codecs[2].decode(data, 0, 20.0).fragments == (fragment,)
    assert codecs[0].definition == codecs[1].definition != codecs[2].definition
    with pytest.raises(Exception, match="origin 8 is not one of 4"):
        codecs[0].encode(1, [0] * 4, [fragment], slot_start_s=20.0)


# Gateways ------------------------------------------------------------------------------------------


def test_a_gateway_is_one_body_at_two_addresses() -> None:
    fleet = assemble(resolved(scenario_of(in_a_row(2), "scenario.duration_s=200.0")), 1)
    assert isinstance(fleet, Flotilla)
    first, second = (
        next(vehicle for of in fleet.fleets for vehicle in of.vehicles if vehicle.name == name)
        for name in (FIRST, SECOND)
    )
    assert isinstance(second, Address)
    assert second.functional is first.functional
    before_j = first.functional.motion.energy_j
    second.functional.transmitted(512)
    assert first.functional.motion.energy_j > before_j
    fleet.run()
    tracked = {row[1] for row in fleet.recorder.trajectories}
    spoken = {row[2] for row in fleet.recorder.packets}
    assert FIRST in tracked
    assert SECOND not in tracked
    assert {FIRST, SECOND} <= spoken
    assert SECOND not in [vehicle.name for vehicle in fleet.vehicles]


def test_vehicles_of_different_cells_see_each_other() -> None:
    fleet = assemble(resolved(scenario_of(in_a_row(2), "scenario.duration_s=60.0")), 1)
    assert isinstance(fleet, Flotilla)
    fleet.step()
    one, other = (next(vehicle for vehicle in of.vehicles if vehicle.name.startswith("AUV01")) for of in fleet.fleets)
    motion, beside = one.functional.motion, other.functional.motion
    beside.x_m, beside.y_m = motion.x_m + 30.0, motion.y_m
    fleet.step()
    seen = fleet.fleets[0].separation.look()[one.data.node]
    assert any(abs(neighbour.dx_m) > 20.0 for neighbour in seen)


# Scenarios -----------------------------------------------------------------------------------------


def without(raw: dict[str, Any], *keys: str) -> dict[str, Any]:
    return {key: value for key, value in raw.items() if key not in keys}


def refused(raw: dict[str, Any], *settings: str) -> list[str]:
    """Lines by which tables are refused."""
    with pytest.raises(ConfigurationError) as caught:
        scenario_of(raw, *settings)
    return str(caught.value).splitlines()


def changed(**at: Any) -> dict[str, Any]:
    """Tables of three cells, of which the first has other values."""
    raw = in_a_row()
    raw["cell"][0] |= at
    return raw


def members(raw: dict[str, Any], number: int) -> list[str]:
    found: list[str] = raw["cell"][number]["vehicles"]
    return found


def test_bad_cells_are_refused_by_line_key_and_remedy() -> None:
    raw = in_a_row()
    names = members(raw, 0)
    shared = copy.deepcopy(raw)
    shared["cell"][1]["vehicles"].append(names[1])
    one_cell = copy.deepcopy(raw)
    one_cell["gateway"][0]["vehicles"] = [FIRST, names[1]]
    again = copy.deepcopy(raw)
    again["gateway"].append({"vehicles": [names[1], members(raw, 1)[1]]})
    three = copy.deepcopy(raw)
    three["gateway"].append({"vehicles": [FIRST, members(raw, 2)[1]]})
    plays = copy.deepcopy(raw)
    next(vehicle for vehicle in plays["vehicle"] if vehicle["name"] == SECOND)["playable_roles"] = ["Performer"]
    near, beside = copy.deepcopy(raw), copy.deepcopy(raw)
    near["cells"]["interference_m"] = 2000.0
    near["cell"][0]["colour"] = near["cell"][2]["colour"] = 0
    beside["cell"][0]["colour"] = beside["cell"][1]["colour"] = 0
    twelve = raw_of(1, 1, 12)
    befalls = copy.deepcopy(raw) | {"fault": [{"kind": "lost", "vehicle": SECOND, "at_s": 5.0}]}
    wanted = {
        "vehicle.AUV00 c0r0": (changed(vehicles=[n for n in names if n != "AUV00 c0r0"]), "is in no cell: list it"),
        "cell.c0r0.vehicles = ": (changed(vehicles=[*names, "AUV0X c0r0"]), "did you mean 'AUV0"),
        "cell.c1r0.vehicles = ": (shared, "is in c0r0 and c1r0: a vehicle has one cell; let a gateway have a second"),
        "gateway.1.vehicles = ": (one_cell, "is in one cell only, c0r0: its second address has to be in another"),
        "gateway.3.vehicles = ": (again, "are joined already, and facts would go round: take a gateway away"),
        "gateway.3.vehicles =": (three, f"{FIRST} is a gateway already"),
        f"vehicle.{SECOND}.playable_roles": (plays, "allowed: playable_roles = []"),
        "cell.c2r0.colour = 0": (near, "c0r0 sends at the same time, 1050 m away with an interference of 2000 m"),
        "cell.c1r0.colour = 0": (beside, "and a gateway would have to speak in both at once: give it another colour"),
        "cell.c0r0.vehicles:": (twelve, "12 vehicles for 10 slots; make two cells of it"),
        "group.Operational c0r0": (changed(groups=["Coordination c0r0"]), "is in no cell: list it in groups"),
        "cell.c0r0.groups": (changed(groups=["Coordination c0r0", "Operational"]), "did you mean 'Operational c"),
        "cell.c0r0.x_m": (changed(x_m=[-1200.0, 9000.0]), "allowed: rising, within world.x_m"),
        "vehicle.ASV00 c0r0.start_m": (changed(x_m=[-500.0, -300.0]), "outside the waters of cell c0r0"),
        "fault.1.vehicle": (befalls, f'allowed: "{FIRST}"'),
        "cells.relays": (raw | {"cells": {"relays": ["position"]}}, "allowed: areaDone, mappedCell"),
        "cells.relays:": (raw | {"cells": {"hops": 2}}, "missing: what gateways pass on; allowed: areaDone"),
        "cells.interference_m = 500": (
            raw | {"cells": {"relays": ["areaDone"], "interference_m": 500.0}},
            "allowed: communication.range_m = 1000 or more",
        ),
        "cells:": (without(raw, "cell", "gateway"), "there are no cells: list them as [[cell]]"),
    }
    for key, (tables, text) in wanted.items():
        lines = refused(tables)
        assert any(key in line and text in line and "cells.toml:" in line for line in lines), (key, lines)


@pytest.mark.parametrize(
    ("setting", "text"),
    [
        ("communication.mac=aloha", 'cells send in turns: allowed: "tdma"'),
        ("scenario.settle_s=100.0", "the exchange of cells ends with the mission"),
        ("communication.clocks={offset_s=0.1}", "cells do not go with clocks"),
        ("navigation={drift=0.01}", "cells do not go with navigation"),
        ("finds={number=2}", "within cell c1r0, which has to do without others"),
    ],
)
def test_what_cells_do_not_go_with_is_refused(setting: str, text: str) -> None:
    assert any(text in line for line in refused(in_a_row(2), setting))


def test_a_role_is_played_within_its_cell() -> None:
    raw = in_a_row(2)
    for vehicle in raw["vehicle"]:
        if vehicle["name"] in members(raw, 1):
            vehicle["playable_roles"] = [role for role in vehicle["playable_roles"] if role != "MissionAdministrator"]
    assert any("no vehicle is able to play it" in line and "within cell c1r0" in line for line in refused(raw))


def test_what_is_written_is_read_as_it_was(three: Run) -> None:
    raw = three.scenario.model_dump(mode="json", exclude_none=True)
    assert scenario_of(raw) == three.scenario


def test_tables_of_other_features_go_to_the_cell_that_they_name() -> None:
    ban = {"issuer": "AUV00 c1r0", "vehicle": "AUV01 c1r0", "at_s": 6.0}
    plan = Plan(scenario_of(in_a_row(2) | {"ban": [ban]}))
    assert [len(plan.scenario_of(number).of_feature("ban")) for number in range(2)] == [0, 1]


def test_a_cut_parts_those_vehicles_of_a_cell_that_it_names() -> None:
    """A side may name vehicles of several cells; nothing passes between cells anyway."""
    cut = "{from_s=30,until_s=60,between=[['AUV00 c0r0'],['AUV01 c0r0','AUV00 c1r0']]}"
    fleet = run(scenario_of(in_a_row(2), "channel.per=0", f"channel.blackout=[{cut}]", "scenario.duration_s=90"), 1)
    far = {"AUV00 c0r0": {"AUV01 c0r0"}, "AUV01 c0r0": {"AUV00 c0r0"}}
    lost = [(row[1], row[2], set(row[7])) for row in fleet.recorder.packets]
    assert {who for at_s, who, _ in lost if 30.0 <= at_s < 60.0} > set(far)
    assert all(by == (far.get(who, set()) if 30.0 <= at_s < 60.0 else set()) for at_s, who, by in lost)


def test_of_few_cells_it_is_said_why_they_are_not_done() -> None:
    reason = run(scenario_of(raw_of(5, 1, 4, joined=False), "scenario.duration_s=20.0"), 1).reason
    assert reason.startswith("c0r0: ")
    assert reason.endswith("; and 2 others")
    assert reason.count(":") == 3


def test_a_fleet_without_cells_is_the_fleet_that_it_was() -> None:
    assert type(assemble(resolved(load(BASE)), 1)) is Fleet
