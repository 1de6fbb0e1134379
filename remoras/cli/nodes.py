"""Commands that run vehicles in separate processes: node, swarm."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from missions.errors import check_name
from remoras.cli.app import FAILED, Json, aligned, command, fail, note, show
from remoras.cli.runs import ScenarioName, Seed, Settings, load, set_keys

if TYPE_CHECKING:
    from exchange.drivers.driver import Driver, Paced
    from exchange.drivers.udp import Address, Socket
    from missions.nodes.alone import LoneVehicle, NodePlan
    from missions.nodes.frontseat import Frontseat
    from missions.nodes.node import NodeOutcome
    from missions.nodes.ros import RosShare
    from missions.scenarios.scenario import Scenario

SETTLE_S = 300.0
"""Default time (s) of further exchange after the vehicles have stopped."""
LISTEN_FRAMES = 2.0
"""TDMA frames for which a node without start time listens for a mission under way."""
ANY_PORT = "127.0.0.1:0"
OUTCOME = "vehicle", "sent", "heard", "lost", "twice", "refused", "items", "open", "state", "behind by"


Speed = Annotated[float, typer.Option(metavar="X", help="Simulated seconds per second; 1 is real time.")]
Until = Annotated[
    float | None, typer.Option(metavar="T", help="Vehicles stop acting at T s; default: scenario.duration_s.")
]
Settle = Annotated[
    float, typer.Option(metavar="S", help="After --until, vehicles only exchange outstanding items, for S seconds.")
]
Logs = Annotated[Path | None, typer.Option(metavar="DIR", help="Folder for the packet logs, one VEHICLE.jsonl each.")]
Drop = Annotated[float, typer.Option(metavar="P", help="Probability that a receiver loses a packet, 0 to 1.")]
Double = Annotated[
    float, typer.Option(metavar="P", help="Probability that a packet that arrives is received twice, 0 to 1.")
]


@command(
    "node", "remoras node mapping-rendezvous AUV00 --bind 127.0.0.1:47001 --peers ASV00=127.0.0.1:47000 --speed 20"
)
def node(
    scenario: ScenarioName = "",
    vehicle: str = "",
    bind: str = ANY_PORT,
    peers: str = "",
    speed: Speed = 1.0,
    start_utc: str = "",
    serial: Path | None = None,
    unet: str = "",
    frontseat: str = "",
    ros: Literal["body", "tell"] | None = None,
    replay: Path | None = None,
    resume: bool = False,
    epoch: Annotated[int, typer.Option(min=0)] = 0,
    seed: Seed = 1,
    until: Until = None,
    settle: Settle = SETTLE_S,
    drop: Drop = 0.0,
    double: Double = 0.0,
    settings: Settings = None,
    out: Logs = None,
    as_json: Json = False,
) -> None:
    """Run one vehicle of a scenario in this process, with UDP, a modem or UnetStack.

    Without --start-utc it listens first: if it receives a peer, it joins that peer's mission; else it starts its own.

    Args:
        vehicle (VEHICLE): Vehicle of the scenario that this node runs.

    Options:
        bind (HOST:PORT): Local UDP address; port 0 takes a free one.
        peers (NAME=HOST:PORT,...): UDP addresses of the peers; packets from others are ignored.
        start_utc (TIME): Start of the mission in UTC, such as 2026-05-01T09:00:00.
        serial (PORT): Serial port of a Nanomodem v3, in place of UDP.
        unet (HOST:PORT): Address of UnetStack, on a modem or a simulator, in place of UDP.
        frontseat (FILE.py:NAME): Your function that returns the vehicle's own body, clock and modem.
        ros (body|tell): ROS 2: read the vehicle's position from topics (body), or publish it (tell).
        replay (LOG): Replay the receptions of a log without sockets; compare the sent packets bit by bit.
        resume: Resume from the log in --out, if it exists, as after a reboot.
        epoch (N): Number of earlier starts of this node in the mission; 0 for the first.
    """
    if replay is not None:
        _replay(replay, vehicle, as_json)
        return
    if not vehicle:
        fail("SCENARIO and VEHICLE are needed; allowed: node SCENARIO VEHICLE, or node --replay LOG")
    from missions.nodes.frontseat import Disciplined
    from missions.nodes.logs import ENDING, Began, NodeLog, gone_on
    from missions.nodes.node import Mishaps, VehicleNode

    _check(speed, settle, drop, double)
    begins_s = _start(start_utc) if start_utc else None
    loaded, (plan,) = _plans(scenario, [vehicle], settings, seed, until, settle)
    modems = [name for name, value in (("--serial", serial), ("--unet", unet)) if value]
    seat = _frontseat(frontseat, start_utc, bool(modems) or bind != ANY_PORT or bool(peers))
    has_body = ros == "body"
    if has_body and seat.body is not None:
        fail("--ros body: the body is that of --frontseat; leave out one of them")
    if begins_s is not None and not resume and (late_s := (time.monotonic() - begins_s) * speed - plan.end_s) > 0.0:
        fail(f"--start-utc: the mission was over {late_s:.0f} s ago, at {plan.end_s:.0f} s of it; give a later start")
    share: RosShare | None = None
    if ros is not None:
        from missions.nodes.ros import RosShare

        share = RosShare(vehicle, has_body)
    body = share if has_body else seat.body
    plan = replace(plan, epoch=epoch, is_steered=body is not None)
    if resume and out is None:
        fail("--resume: --out is missing; name the folder of the log to resume")
    written = None if out is None else out / f"{vehicle}{ENDING}"
    if modems and (len(modems) > 1 or bind != ANY_PORT or peers):
        fail(f"{modems[0]}: a modem replaces other links; give only one of --serial, --unet, --bind and --peers")
    if modems and begins_s is None:
        fail(f"{modems[0]}: --start-utc is missing; packets of a modem do not say when the mission began")
    addresses = addresses_in(peers, "--peers", [table.name for table in loaded.vehicle if table.name != vehicle])
    others = list(addresses.values())
    port = _listening(bind, vehicle) if not modems and seat.modem is None else None
    log: NodeLog | None = None
    if resume and written is not None and written.is_file():
        own, log, pace = gone_on(written, plan)
        note(f"{vehicle} resumes at {pace.now_s:.1f} s of the mission")
    else:
        own, pace = _begun(plan, begins_s, speed, port, others)
        if out is not None:
            log = NodeLog(out, own.plan, Began.of(pace))
    if seat.clock is not None:
        pace = Disciplined(seat.clock, Began.of(pace).unix_s, pace)
    driver = _driver(port, serial, unet, others, pace, own) if seat.modem is None else seat.modem(pace)
    witness = None if share is None or has_body else share.witness
    outcome = VehicleNode(own, driver, pace, log, Mishaps(drop, double), body, witness).run()
    if share is not None:
        share.close()
    show(asdict(outcome), as_json, _outcome_lines([outcome]))


def _frontseat(reference: str, start_utc: str, has_modem: bool) -> Frontseat:
    from missions.nodes.frontseat import Frontseat
    from missions.scenarios.parts import importable
    from remoras.errors import PluginError
    from remoras.plugins import answer, named_object

    if not reference:
        return Frontseat()
    try:
        made = named_object(importable(reference))
    except PluginError as error:
        fail(f"--frontseat {reference}: {error}")
    seat: Frontseat = answer(f"--frontseat {reference}", "it", "a missions.nodes.Frontseat", Frontseat, made)
    if seat.modem is not None and has_modem:
        fail("--frontseat: its modem replaces other links; leave out --serial, --unet, --bind and --peers")
    if (seat.clock is not None or seat.modem is not None) and not start_utc:
        fail("--frontseat: --start-utc is missing; its clock and modem do not say when the mission began")
    return seat


def _listening(bind: str, vehicle: str) -> Socket:
    from exchange.drivers.udp import Socket, address_of

    port = Socket(address_of(bind, "--bind"))
    host, number = port.address
    note(f"{vehicle} listens on {host}:{number}")
    return port


def _begun(
    plan: NodePlan, begins_s: float | None, speed: float, port: Socket | None, others: list[Address]
) -> tuple[LoneVehicle, Paced]:
    from exchange.drivers.driver import Paced
    from missions.nodes.alone import alone

    own = alone(plan)
    # Without a start time: a peer that sends has begun the mission already.
    if begins_s is None and others and port is not None:
        begins_s = port.heard_start_s(others, LISTEN_FRAMES * own.setup.schedule.frame_s / speed, speed)
    pace = Paced(time.monotonic() if begins_s is None else begins_s, speed)
    # Within the first slot a vehicle has missed nothing: it belongs to the start.
    if pace.now_s > own.setup.schedule.slot_s:
        own = alone(replace(plan, begins_s=pace.now_s))
        note(f"{plan.vehicle} joins at {own.plan.begins_s:.1f} s of the mission")
    return own, pace


def _driver(
    port: Socket | None, serial: Path | None, unet: str, others: list[Address], pace: Paced, own: LoneVehicle
) -> Driver:
    if unet:
        from exchange.drivers.udp import address_of
        from exchange.drivers.unetstack import UnetStack

        return UnetStack(address_of(unet, "--unet"), pace)
    if port is not None:
        from exchange.drivers.udp import UdpDriver

        return UdpDriver(port, others, pace, own.setup.modem.packet_s)
    from exchange.drivers.nanomodem import MOST_BYTES, Nanomodem

    assert serial is not None
    if own.setup.modem.payload_bits > 8 * MOST_BYTES:
        fail(f"--serial {serial}: a Nanomodem v3 takes {MOST_BYTES} bytes; set communication.modem to nanomodem-v3")
    return Nanomodem(serial, pace)


def _start(start_utc: str) -> float:
    """Return the mission start by ``time.monotonic`` (s)."""
    from datetime import UTC, datetime

    try:
        begins = datetime.fromisoformat(start_utc)
    except ValueError:
        fail(f"--start-utc {start_utc!r}: allowed is a time of ISO 8601 such as 2026-05-01T09:00:00")
    ahead_s = begins.replace(tzinfo=begins.tzinfo or UTC).timestamp() - time.time()
    # Converted once: corrections of the system clock during the mission do not move the slots.
    return time.monotonic() + ahead_s


@command("swarm", "remoras swarm mapping-rendezvous --until 600 --speed 100 --drop 0.4 --double 0.1 --out dive")
def swarm(
    scenario: ScenarioName,
    vehicles: str = "",
    speed: Speed = 1.0,
    seed: Seed = 1,
    until: Until = None,
    settle: Settle = SETTLE_S,
    drop: Drop = 0.0,
    double: Double = 0.0,
    settings: Settings = None,
    out: Logs = None,
    as_json: Json = False,
) -> None:
    """Run the vehicles of a scenario in separate processes; check that their knowledge agrees.

    Options:
        vehicles (NAME,...): Vehicles to start; default: all.
    """
    from missions.nodes.logs import refuse_written
    from missions.nodes.swarm import swarm as run_swarm

    _check(speed, settle, drop, double)
    names = list(dict.fromkeys(filter(None, vehicles.split(","))))
    loaded, plans = _plans(scenario, names, settings, seed, until, settle)
    if out is not None:
        # Before any process starts, so that all logs or none are written.
        for plan in plans:
            refuse_written(out, plan)

    plans[0].setup()  # report faults before starting processes

    def begun(pids: dict[str, int]) -> None:
        started = ", ".join(f"{name} (process {pid})" for name, pid in pids.items())
        note(f"{started}; {plans[0].end_s / speed:.0f} s to go")

    outcome = run_swarm(loaded.scenario.name, plans, speed, (drop, double), out, begun)
    equal = "knowledge of all vehicles is equal" if outcome.equal else "their knowledge differs; give a longer --settle"
    show(asdict(outcome), as_json, [*_outcome_lines(outcome.vehicles), equal])
    for name, why in outcome.ended.items():
        note(f"{name}: {why}")
    if outcome.ended or not outcome.equal:
        raise typer.Exit(FAILED)


def _replay(log: Path, vehicle: str, as_json: bool) -> None:
    from missions.nodes.logs import play, read_log

    logged = read_log(log)
    if vehicle not in ("", logged.plan.vehicle):
        fail(f"--replay {log}: is the log of {logged.plan.vehicle}, not of {vehicle}")
    replayed = play(logged)
    text = (
        f"{replayed.vehicle} differs from its log: {replayed.difference}"
        if replayed.difference
        else f"{replayed.vehicle}: {replayed.packets_sent} packets sent as in the log, "
        f"{replayed.packets_heard} received; state {replayed.state_hash[:16]}"
    )
    show(asdict(replayed), as_json, [text])
    if replayed.difference:
        raise typer.Exit(FAILED)


def check_speed(speed: float) -> None:
    """Fail unless a speed is usable."""
    if not 0.0 < speed <= 1e6:
        fail(f"--speed {speed:g}: allowed is more than 0, up to 1000000")


def _check(speed: float, settle: float, drop: float, double: float) -> None:
    check_speed(speed)
    if not 0.0 <= settle <= 1e9:
        fail(f"--settle {settle:g}: allowed are 0 and more seconds")
    for option, share in (("--drop", drop), ("--double", double)):
        if not 0.0 <= share <= 1.0:
            fail(f"{option} {share:g}: allowed is a share, 0 to 1")


def _plans(
    scenario: str, vehicles: list[str], settings: list[str] | None, seed: int, until: float | None, settle: float
) -> tuple[Scenario, list[NodePlan]]:
    loaded = load(scenario, set_keys(settings))
    from missions.nodes.alone import NodePlan

    return loaded, [NodePlan.of(loaded, name, seed, until, settle) for name in vehicles or loaded.names_by_slot]


def addresses_in(text: str, option: str, names: Sequence[str]) -> dict[str, Address]:
    """Parse ``NAME=HOST:PORT,...``; fail for an unknown or repeated name, or an invalid address."""
    from exchange.drivers.udp import address_of

    addresses: dict[str, Address] = {}
    for entry in filter(None, text.split(",")):
        name, _, address = entry.partition("=")
        check_name(option, name, names)
        if name in addresses:
            fail(f"{option} {entry}: {name} is there twice; allowed: one address each")
        addresses[name] = address_of(address, f"{option} {name}")
    return addresses


def _outcome_lines(outcomes: list[NodeOutcome]) -> list[str]:
    rows = [
        (node.vehicle, node.packets_sent, node.packets_heard, node.packets_lost, node.packets_doubled,
         node.packets_refused, node.items, node.open, node.state_hash[:16], f"{node.late_s:.1f} s")
        for node in outcomes
    ]  # fmt: skip
    return aligned([OUTCOME, *([str(value) for value in row] for row in rows)], right=range(1, len(OUTCOME)))
