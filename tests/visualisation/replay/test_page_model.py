"""Data model of the replay page against the tables: positions, receptions, knowledge, causes of decisions."""

import math
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from replayed import LOSSY, asked, data_of, moments_s, recorded

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
    "faults": ("mapping-rendezvous", FAULTS),
    "empty batteries": ("mapping-rendezvous", EMPTY),
    "many": ("mapping-patches", MANY),
}


@pytest.fixture(scope="module", params=CASES)
def case(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Results, bytes, Path]:
    """Run at PER 0.6, its payload, and a folder."""
    name, settings = CASES[request.param]
    folder = tmp_path_factory.mktemp("model")
    results = recorded(folder / "run", LOSSY, *settings, scenario=name, seed=3)
    return results, data_of(results), folder


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
def test_knowledge_of_each_vehicle_equals_its_rebuilt_world_model(case: tuple[Results, bytes, Path]) -> None:
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


def test_vehicle_out_of_the_mission_has_no_silences(case: tuple[Results, bytes, Path]) -> None:
    results, data, folder = case
    told = asked([data], SILENCES, folder, more=("facts.js",))
    assert len(told) == len(results.scenario.vehicle)
    for vehicle, spells in zip(results.scenario.vehicle, told, strict=True):
        for from_s, to_s in out_s(results)[vehicle.name]:
            assert all(one["to_s"] <= from_s or to_s <= one["from_s"] for one in spells), vehicle.name


FLAGS = "([run]) => new R.Facts(run, new Map()).flags.map((of) => of.map((one) => [one.time_s, one.text]))"


def test_flag_tells_begin_from_end_of_a_fault(case: tuple[Results, bytes, Path]) -> None:
    results, data, folder = case
    names = [vehicle.name for vehicle in results.scenario.vehicle]
    told = dict(zip(names, asked([data], FLAGS, folder, more=("facts.js",)), strict=True))
    for row in results.table("faults").to_pylist():
        flags = [text for at_s, text in told[row["vehicle"]] if at_s == row["time_s"]]
        began, over = ("away", "joins") if row["kind"] == "joins" else (row["kind"], f"{row['kind']} no more")
        assert (over if row["detail"] == "over" else f"⚠ {began}") in flags


TURNS = "([run]) => run.events.filter((one) => one.kind === 'role').map((one) => [one.time_s, one.vehicle, one.text])"


def test_last_event_of_a_vehicle_names_its_active_roles(case: tuple[Results, bytes, Path]) -> None:
    """The list has begins and ends of roles."""
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
                assert last[-1] == f"{vehicle.name} has active role {so}", at_s
            else:
                assert not last or last[-1].endswith("has no active role: it waits"), at_s
    assert len(turns) > 4


def test_positions_and_roles_equal_those_of_the_tables(case: tuple[Results, bytes, Path]) -> None:
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


def test_packets_equal_rows_of_the_table(case: tuple[Results, bytes, Path]) -> None:
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


def test_cost_of_losses_is_counted_from_the_tables(case: tuple[Results, bytes, Path]) -> None:
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


# Packets that collided or were refused, parked peers, and estimates of links; such rows were added by hand


UNTIL_S = 300.0
COLLIDED = "collided_at"
PARKED_S, AGAIN_S = 100.0, 200.0
FATES = "([run]) => run.packets.map(({ to }) => to.map(({ v, why }) => [v, why || 'heard']))"
BETWEEN = """([run], [v, peer]) => [40, 99, 101, 160, 201].map((t) => [
  run.isParked(v, peer, t), run.linkAt(v, peer, t), run.isParked(peer, v, t),
])"""
ESTIMATES = [(50.0, "incoming", 0.25, 8), (50.0, "outgoing", 0.5, 4), (150.0, "incoming", 0.75, 16)]


def with_failures(results: Results) -> Results:
    """In every fifth slot all losses are collisions; in every seventh the first other receiver refuses the packet."""
    folder, packets = results.folder, results.table("packets")
    packets = packets.select([name for name in packets.column_names if name != COLLIDED])
    rows = packets.to_pylist()
    collided = [row["lost_by"] if row["slot"] % 5 == 0 else [] for row in rows]
    pq.write_table(
        packets.append_column(COLLIDED, pa.array(collided, pa.list_(pa.string()))), folder / "packets.parquet"
    )
    refused = [
        (row["arrivals_s"][0], row["receivers"][0], row["sender"], row["slot"] + 99, "older epoch")
        for row in rows[::7] if row["receivers"]
    ]  # fmt: skip
    _write(results, "refused", ("time_s", "vehicle", "sender", "slot", "reason"), refused)
    links = [(time_s, "AUV00", "AUV01", *more) for time_s, *more in ESTIMATES]
    _write(results, "links", ("time_s", "vehicle", "peer", "direction", "p_loss", "n"), links)
    own = [(PARKED_S, "AUV00", "AUV01", "parked"), (AGAIN_S, "AUV00", "AUV01", "heard again")]
    _write(results, "peers", ("time_s", "vehicle", "peer", "event"), own)
    return Results.read(folder)


def _write(results: Results, name: str, columns: tuple[str, ...], rows: list[tuple[Any, ...]]) -> None:
    table = pa.table([pa.array(column) for column in zip(*rows, strict=True)], names=list(columns))
    metadata = results.table("faults").schema.metadata
    pq.write_table(table.replace_schema_metadata(metadata), results.folder / f"{name}.parquet")


@pytest.fixture(scope="module")
def failing(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return with_failures(
        recorded(tmp_path_factory.mktemp("failing") / "run", LOSSY, f"scenario.duration_s={UNTIL_S:g}")
    )


def test_every_failed_reception_has_its_cause(failing: Results, tmp_path: Path) -> None:
    told = asked([data_of(failing)], FATES, tmp_path)
    names = [vehicle.name for vehicle in failing.scenario.vehicle]
    refused = {(row["vehicle"], row["time_s"]) for row in failing.table("refused").to_pylist()}
    n = {"heard": 0, "lost": 0, "collided": 0, "refused": 0}
    for row, found in zip(failing.table("packets").to_pylist(), told, strict=True):
        so = {name: "collided" if name in row["collided_at"] else "lost" for name in row["lost_by"]}
        for name, time_s in zip(row["receivers"], row["arrivals_s"], strict=True):
            so[name] = "refused" if (name, time_s) in refused else "heard"
        assert {names[v]: why for v, why in found} == so
        for why in so.values():
            n[why] += 1
    assert min(n.values()) > 5


def test_parked_peers_and_link_estimates_equal_those_of_the_tables(failing: Results, tmp_path: Path) -> None:
    names = [vehicle.name for vehicle in failing.scenario.vehicle]
    v, peer = names.index("AUV00"), names.index("AUV01")
    told = asked([data_of(failing)], BETWEEN, tmp_path, [v, peer])
    assert [parked for parked, _, _ in told] == [False, False, True, True, False]
    assert not any(other for _, _, other in told)
    early, late = {"p_loss": pytest.approx(0.25), "n": 8}, {"p_loss": pytest.approx(0.75), "n": 16}
    incoming = [link["incoming"] for _, link, _ in told]
    assert incoming == [None, early, early, late, late]
    assert told[-1][1]["outgoing"] == {"p_loss": pytest.approx(0.5), "n": 4}


# Which packets the map shows as links


RATE = 60.0
LINKS = """([run], { times, rate, selected }) => {
  const facts = new R.Facts(run, new Map());
  return times.map((t) => R.linksAt(facts, { t, pace: String(rate), rate, playing: true }, selected)
    .map((one) => [one.packet.slot, run.vehicles[one.to.v].name, one.to.arrival_s !== null, one.age, one.isWhole]));
}"""


def links(results: Results, folder: Path, times_s: list[float], selected: int = -1) -> list[list[list[Any]]]:
    given = {"times": times_s, "rate": RATE, "selected": selected}
    found: list[list[list[Any]]] = asked([data_of(results)], LINKS, folder, given, ("facts.js", "packets.js"))
    return found


def newest(results: Results, at_s: float, fade_s: float) -> list[tuple[int, str, bool]]:
    """(slot, receiver, received) of the newest packets that ended together, by sender and receiver."""
    seen, found = set(), []
    for row in reversed(results.table("packets").to_pylist()):
        if not 0.0 < at_s - row["time_s"] <= fade_s:
            continue
        for name in [*row["receivers"], *row["lost_by"]]:
            key = row["sender"], name, name in row["receivers"]
            if key not in seen:
                seen.add(key)
                found.append((row["slot"], name, key[2]))
    return found


def test_newest_links_are_opaque_and_older_losses_remain(tmp_path: Path) -> None:
    """Links of a large fleet fade for a frame of 16 slots, and those of the selected vehicle stand alone."""
    large = (LOSSY, "scenario.duration_s=150", "fleet.size=16")
    results = recorded(tmp_path / "run", *large, scenario="mapping-patches")
    rows = results.table("packets").to_pylist()
    fade_s = 16 * (rows[-1]["time_s"] - rows[0]["time_s"]) / (rows[-1]["slot"] - rows[0]["slot"])
    times_s = [30.0, 75.3, 120.0]
    for at_s, told in zip(times_s, links(results, tmp_path, times_s), strict=True):
        expected = newest(results, at_s, fade_s)
        assert len(expected) > 100
        shown = [(slot, name, heard) for slot, name, heard, _, _ in told]
        assert len(set(shown)) == len(shown) == min(len(expected), 150)
        assert set(shown) <= set(expected)
        assert [slot for slot, *_ in shown] == sorted((slot for slot, *_ in shown), reverse=True)
        assert [is_whole for *_, is_whole in told] == [number < 30 for number in range(len(told))]
        first_slot = shown[-1][0] + 1  # of all packets since then nothing is left out
        assert {one for one in shown if one[0] >= first_slot} == {one for one in expected if one[0] >= first_slot}
        assert all(0.0 <= age <= 1.0 for *_, age, _ in told)
    name, sender = results.scenario.vehicle[3].name, {row["slot"]: row["sender"] for row in rows}
    [told] = links(results, tmp_path, [90.0], selected=3)
    assert len(told) > 10
    assert all(name in (sender[slot], receiver) for slot, receiver, *_ in told)


# Where two runs part


APART = "([one, two]) => R.divergence(one, two)"


def apart(folder: Path, *runs: Results) -> Any:
    return asked([data_of(one) for one in runs], APART, folder)


def test_runs_differ_from_the_first_packet_with_other_receivers(tmp_path: Path) -> None:
    """The same seed at two loss rates: the first slot with other receivers is where they part."""
    runs = [recorded(tmp_path / str(per), f"channel.per={per}", "scenario.duration_s=200") for per in (0.3, 0.6)]
    pairs = zip(*(one.table("packets").to_pylist() for one in runs), strict=False)
    first = next(a for a, b in pairs if a["receivers"] != b["receivers"])
    told = apart(tmp_path, *runs)
    assert told == {"time_s": first["time_s"], "text": f"slot {first['slot']} is received by others"}
    assert apart(tmp_path, runs[0], runs[0]) is None


def test_runs_differ_where_one_of_them_ends(tmp_path: Path) -> None:
    runs = [recorded(tmp_path / str(end_s), LOSSY, f"scenario.duration_s={end_s}") for end_s in (60, 61)]
    assert apart(tmp_path, *runs) == {"time_s": 60.0, "text": "one of them ends"}


# Arrows of influence signals in the lanes


ARROWS = """() => {
  R.VEHICLE_FILLS = ["#0072B2"];
  const spells = [{ from_s: 0, to_s: 100 }], role = "Performer";
  const held = [[], [{ group: "one", role, spells }], [{ group: "other", role, spells }], []];
  const packet = {
    start_s: 10, sender: 0, to: [1, 2, 3].map((v) => ({ v, arrival_s: 11 })),
    signals: [{ group: "one", role: "Leader", addressed: [role], value: -5 }],
  };
  const run = { header: { slot_s: 2 }, packets: [packet], packetsIn: () => [0, 1] };
  const facts = { run, n: 4, held, decisions: [[], [], [], []] };
  const layout = { height: 200, lanes: [0, 1, 2, 3].map((v) => ({ v, members: [v], y: 50 * v, h: 50 })) };
  const scale = { from_s: 0, to_s: 100, left: 0, right: 1000, px_per_s: 10, x: (t) => 10 * t };
  const tips = [];
  const call = (_, name) => (...given) => { if (name === "moveTo") tips.push(given); };
  const pen = new Proxy({}, { get: call, set: () => true });
  R.drawSignals(pen, facts, layout, scale);
  return tips;
}"""


def test_signal_arrow_leads_to_the_holder_of_the_role_in_its_group(tmp_path: Path) -> None:
    """From the sender's lane at 10 s to the receiver's: a role of that name in another group is not meant."""
    assert asked([], ARROWS, tmp_path, more=("palette.js", "signals.js")) == [[100, 21], [110, 71]]
