"""The scripts of the page answer what the tables of a run say: where, who, what was heard, what was known, why."""

import math
import random
from pathlib import Path
from typing import Any

import pytest
from replayed import LOSSY, asked, data_of, recorded

from exchange.packets import name_of
from missions.runs.results import Results
from missions.scenarios.parts import mission_of

FAULTS = (
    "fault=[{kind='deaf',vehicle='AUV01',at_s=150,until_s=900},{kind='lost',vehicle='AUV02',at_s=500,until_s=1100},"
    "{kind='mute',vehicle='ASV00',at_s=300,until_s=700},{kind='joins',vehicle='AUV00',at_s=60}]",
    "communication.lease_frames=30",
    "scenario.duration_s=1200",
)
EMPTY = ("vehicle.AUV01.energy_j=60000", "vehicle.ASV00.energy_j=20000", "scenario.duration_s=600")
MANY = ("fleet.size=8", "scenario.duration_s=300")
"""Eight vehicles divide so many jobs that what their head says does not fit one packet."""
TEAMS = (
    "fault=[{kind='lost',vehicle='ASV00',at_s=600}]", "communication.lease_frames=15", "scenario.duration_s=1000",
)  # fmt: skip
"""A team sets aside what concerns another, and the new head of all takes it up."""
CASES = {
    "teams": ("mapping-three-teams", TEAMS),
    "lossy": ("mapping-rendezvous", ()),
    "faults": ("mapping-rendezvous", FAULTS),
    "empty batteries": ("mapping-rendezvous", EMPTY),
    "bound": ("mapping-rendezvous", (*EMPTY, "strategy.name='oracle'")),
    "many": ("mapping-patches", MANY),
}
MOMENTS = 20


@pytest.fixture(scope="module", params=CASES)
def case(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Results, bytes, Path]:
    """A run at PER 0.6, what a page holds of it, and a folder."""
    name, settings = CASES[request.param]
    folder = tmp_path_factory.mktemp("model")
    results = recorded(folder / "run", LOSSY, *settings, scenario=name, seed=3)
    return results, data_of(results), folder


def moments_s(results: Results) -> list[float]:
    end_s = float(results.summary["mission_time_s"])
    return sorted(random.Random(n).uniform(0.0, end_s) for n in range(MOMENTS))


KNOWN = """([run], times) => times.map((t) => run.vehicles.map((_, v) => {
  const mind = run.mind(v, t);
  return {
    blocks: [...new Set(
      run.items.filter((item, n) => item.kind !== "status" && run.heard_s(v, n) <= t).map((item) => item.block)
    )],
    peers: mind.peers.map((one) => [run.vehicles[one.v].name, one.x, one.y]),
    roles: mind.roles.map((one) => [one.group, one.role, run.vehicles[one.v].name]),
    absent: mind.absent.map((p) => run.vehicles[p].name),
    places: mind.places.map((p) => run.world.places[p].name),
    tiles: Array.from(mind.tilesKnown_s).flatMap((since_s, tile) => (since_s <= t ? [tile] : [])),
  };
}))"""


def known_by(results: Results, vehicle: str, at_s: float, names: list[str]) -> dict[str, Any]:
    """The same from the vehicle's world model, rebuilt."""
    known, mission = results.known(vehicle, at_s), mission_of(results.scenario)
    positions = {name: known.value(name, "position") for name in names if name != vehicle}
    tiles: set[int] = set()
    first, model, places = 0, known.model, {place.name for place in mission.places}
    for place in mission.places:
        if place.tiles is None:
            continue
        subject, attribute = model.instance_named(place.name).uid, model.tbox.attribute_named(place.tiles.attribute).uid
        values = {int(entry.fact.value) for entry in model.history(subject, attribute)}
        tiles |= {first + value for value in values}
        first += len(place.tiles.squares)
    done = {job.name: job.done for job in mission.jobs.values()}
    return {
        "blocks": {name_of(block) for block in (*known.model.blocks(), *known.model.private_blocks())},
        "peers": {(name, *at_m) for name, at_m in positions.items() if at_m is not None},
        "roles": {(one.group, one.role, one.vehicle) for one in known.organisation.assignments},
        "absent": set(known.absent),
        "places": {name for name, (what, of) in done.items() if name in places and known.value(of, what) is not None},
        "tiles": tiles,
    }


@pytest.mark.slow
def test_what_each_vehicle_knew_is_what_is_rebuilt_of_its_world_model(case: tuple[Results, bytes, Path]) -> None:
    results, data, folder = case
    names = [vehicle.name for vehicle in results.scenario.vehicle]
    times_s = moments_s(results)
    told = asked([data], KNOWN, folder, times_s)
    n_known = 0
    for at_s, minds in zip(times_s, told, strict=True):
        for name, mind in zip(names, minds, strict=True):
            said = {key: {tuple(one) if isinstance(one, list) else one for one in of} for key, of in mind.items()}
            assert said == known_by(results, name, at_s, names), (name, at_s)
            n_known += len(said["blocks"])
    assert n_known > 100 * len(names)


WHERE = """([run], times) => times.map((t) => run.vehicles.map((_, v) => {
  const at = run.at(v, t), bars = run.bars(v).filter((bar) => bar.from_s <= t && t < bar.to_s);
  return {
    at: [at.x, at.y, at.heading, at.speed],
    held: bars.filter((bar) => !bar.driving).map((bar) => [bar.group, bar.role]),
    driving: bars.filter((bar) => bar.driving).map((bar) => [bar.group, bar.role]),
  };
}))"""


def roles_at(rows: list[dict[str, Any]], vehicle: str, at_s: float) -> tuple[set[Any], set[Any]]:
    held: set[Any] = set()
    driving: set[Any] = set()
    for row in rows:
        if row["vehicle"] == vehicle and row["time_s"] <= at_s:
            key = row["group"], row["role"]
            if row["event"] in ("assigned", "left"):
                (held.add if row["event"] == "assigned" else held.discard)(key)
            if row["event"] != "assigned":
                (driving.add if row["event"] == "active" else driving.discard)(key)
    return held, driving


def out_s(results: Results) -> dict[str, list[tuple[float, float]]]:
    """From when to when each vehicle was lost, away or without energy, of the table of faults."""
    spells: dict[str, list[tuple[float, float]]] = {vehicle.name: [] for vehicle in results.scenario.vehicle}
    for row in results.table("faults").to_pylist():
        if row["kind"] in ("lost", "joins", "energy"):
            if row["detail"] == "over":
                spells[row["vehicle"]].append((spells[row["vehicle"]].pop()[0], row["time_s"]))
            else:
                spells[row["vehicle"]].append((row["time_s"], math.inf))
    return spells


def is_out(spells: list[tuple[float, float]], at_s: float) -> bool:
    return any(from_s <= at_s < to_s for from_s, to_s in spells)


SILENCES = "([run]) => new R.Facts(run, new Map()).silences"


def test_a_vehicle_that_is_out_of_the_mission_is_not_deaf(case: tuple[Results, bytes, Path]) -> None:
    results, data, folder = case
    told = asked([data], SILENCES, folder, more=("facts.js",))
    assert len(told) == len(results.scenario.vehicle)
    for vehicle, spells in zip(results.scenario.vehicle, told, strict=True):
        for from_s, to_s in out_s(results)[vehicle.name]:
            assert all(one["to_s"] <= from_s or to_s <= one["from_s"] for one in spells), vehicle.name


FLAGS = "([run]) => new R.Facts(run, new Map()).flags.map((of) => of.map((one) => [one.time_s, one.text]))"


def test_a_flag_says_whether_a_fault_begins_or_is_over(case: tuple[Results, bytes, Path]) -> None:
    results, data, folder = case
    names = [vehicle.name for vehicle in results.scenario.vehicle]
    told = dict(zip(names, asked([data], FLAGS, folder, more=("facts.js",)), strict=True))
    for row in results.table("faults").to_pylist():
        flags = [text for at_s, text in told[row["vehicle"]] if at_s == row["time_s"]]
        began, over = ("away", "joins") if row["kind"] == "joins" else (row["kind"], f"{row['kind']} no more")
        assert (over if row["detail"] == "over" else f"⚠ {began}") in flags


TURNS = "([run]) => run.events.filter((one) => one.kind === 'role').map((one) => [one.time_s, one.vehicle, one.text])"


def test_the_list_of_events_says_all_that_drives_a_vehicle(case: tuple[Results, bytes, Path]) -> None:
    """The last of them says what does: of roles that begin and end the list has either."""
    results, data, folder = case
    roles, end_s = results.table("roles").to_pylist(), float(results.summary["mission_time_s"])
    turns, spells = asked([data], TURNS, folder), out_s(results)
    for at_s in (one for one in moments_s(results) if one < end_s):
        for v, vehicle in enumerate(results.scenario.vehicle):
            so = " + ".join(sorted(role for _, role in roles_at(roles, vehicle.name, at_s)[1]))
            last = [text for time_s, of, text in turns if of == v and time_s <= at_s]
            if is_out(spells[vehicle.name], at_s):
                continue
            if so:
                assert last[-1] == f"{vehicle.name} is driven by {so}", at_s
            else:
                assert not last or last[-1].startswith("nothing drives"), at_s
    assert len(turns) > 4


def test_places_and_roles_are_those_of_the_tables(case: tuple[Results, bytes, Path]) -> None:
    """Positions within half a step of 1/32 m, headings within one of 1.4 degrees, at ticks of the motion."""
    results, data, folder = case
    tracks = {(row["vehicle"], row["time_s"]): row for row in results.table("trajectories").to_pylist()}
    last_s = max(at_s for _, at_s in tracks)
    times_s = [min(float(round(at_s)), last_s) for at_s in moments_s(results)]
    roles, out = results.table("roles").to_pylist(), out_s(results)
    for at_s, vehicles in zip(times_s, asked([data], WHERE, folder, times_s), strict=True):
        for vehicle, told in zip(results.scenario.vehicle, vehicles, strict=True):
            row = tracks[vehicle.name, at_s]
            x_m, y_m, heading_rad, speed_mps = told["at"]
            assert math.hypot(x_m - row["x_m"], y_m - row["y_m"]) < 0.023
            turn_rad = math.remainder(heading_rad - row["heading_rad"], 2 * math.pi)
            assert abs(turn_rad) < 0.013
            assert speed_mps == pytest.approx(row["speed_mps"], abs=0.011)
            held, driving = roles_at(roles, vehicle.name, at_s)
            if at_s < float(results.summary["mission_time_s"]):
                assert {tuple(one) for one in told["held"]} == held
                drives = set() if is_out(out[vehicle.name], at_s) else driving
                assert {tuple(one) for one in told["driving"]} == drives


PACKETS = """([run]) => run.packets.map((p) => ({
  slot: p.slot, time_s: p.start_s, end_s: p.end_s, sender: run.vehicles[p.sender].name, size_bits: p.size_bits,
  heard: p.to.filter((to) => to.arrival_s !== null).map((to) => [run.vehicles[to.v].name, to.arrival_s]),
  lost: p.to.filter((to) => to.arrival_s === null).map((to) => run.vehicles[to.v].name),
  items: p.items.map((n) => run.items[n].uid), status: p.status.map((n) => run.items[n].uid),
  signals: p.signals.map((s) => [s.group + "." + s.role, s.value]),
}))"""


def test_packets_are_those_of_the_table(case: tuple[Results, bytes, Path]) -> None:
    results, data, folder = case
    rows, faults = results.table("packets").to_pylist(), results.table("faults").to_pylist()
    empty_s = {row["vehicle"]: row["time_s"] for row in faults if row["kind"] == "energy"}
    told = asked([data], PACKETS, folder)
    assert len(told) == len(rows)
    for packet, row in zip(told, rows, strict=True):
        same = ("slot", "time_s", "end_s", "sender", "size_bits")
        assert [packet[key] for key in same] == [row[key] for key in same]
        arrivals = zip(row["receivers"], row["arrivals_s"], strict=True)
        heard = {(name, at_s) for name, at_s in arrivals if at_s <= empty_s.get(name, math.inf)}
        assert {tuple(one) for one in packet["heard"]} == heard
        lost = [name for name in row["lost_by"] if row["end_s"] <= empty_s.get(name, math.inf)]
        assert sorted(packet["lost"]) == sorted(lost)  # who is without energy at its end would not have heard it
        assert packet["items"] == row["item_uids"]
        assert packet["status"] == row["status_uids"]
        pairs = zip(row["signal_roles"], row["signal_values"], strict=True)
        assert [tuple(one) for one in packet["signals"]] == list(dict.fromkeys(pairs))


COST = """([run], times) => times.map((t) => {
  const n = R.lastAt(run.cost.t, t);
  return { t: run.cost.t[n], truth: run.cost.truth[n], known: run.cost.known_mean[n], agree: run.cost.agree[n] };
})"""


def test_what_losses_cost_is_counted_from_the_tables(case: tuple[Results, bytes, Path]) -> None:
    """Cells really covered, cells that vehicles knew of, and vehicles whose view is that of all holders of roles.

    Of the vehicles those count that are in the mission.
    """
    results, data, folder = case
    names = [vehicle.name for vehicle in results.scenario.vehicle]
    n_tiles = sum(len(place.tiles.squares) for place in mission_of(results.scenario).places if place.tiles is not None)
    covered, roles = results.table("coverage").to_pylist(), results.table("roles").to_pylist()
    for told in asked([data], COST, folder, moments_s(results)[::4]):
        at_s = told["t"]
        cells = {(row["cell_x"], row["cell_y"]) for row in covered if row["time_s"] <= at_s}
        assert told["truth"] == pytest.approx(len(cells) / n_tiles)
        inside = [name for name in names if not is_out(out_s(results)[name], at_s)]
        known = {name: known_by(results, name, at_s, names) for name in inside}
        n_known = sum(len(one["tiles"]) for one in known.values())
        assert told["known"] == pytest.approx(n_known / n_tiles / max(1, len(inside)))
        so = {(*key, name) for name in inside for key in roles_at(roles, name, at_s)[0]}
        agree = [{role for role in one["roles"] if role[2] in inside} == so for one in known.values()]
        assert told["agree"] == pytest.approx(sum(agree) / max(1, len(inside)))
