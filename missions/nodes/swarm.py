"""Swarm: one process per vehicle."""

from __future__ import annotations

import multiprocessing
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any

from exchange.drivers import Paced, Socket, UdpDriver
from exchange.errors import ExchangeError
from missions.errors import MissionsError
from missions.nodes.alone import NodePlan, alone
from missions.nodes.logs import Began, NodeLog
from missions.nodes.node import Mishaps, NodeOutcome, VehicleNode
from remoras.errors import RemorasError
from remoras.plugins import SAFE_PATH, look_in, plugin_folders, switched_on

LOOPBACK = "127.0.0.1"


def work(
    plan: NodePlan, speed: float, mishaps: Mishaps, out: Path | None, folders: Sequence[str], others: Connection
) -> None:
    """Run the vehicle of a plan until its end; send port, then outcome or error. Plug-ins are in ``folders``."""
    look_in(folders)
    try:
        own = alone(plan)
        port = Socket()
        others.send(port.address[1])
        start_s, ports = others.recv()
        pace = Paced(start_s, speed)
        driver = UdpDriver(port, [(LOOPBACK, number) for number in ports], pace, own.setup.modem.packet_s)
        log = NodeLog(out, plan, Began.of(pace)) if out is not None else None
        others.send(VehicleNode(own, driver, pace, log, mishaps).run())
    except (ExchangeError, MissionsError, RemorasError) as error:
        others.send(str(error))
    except (KeyboardInterrupt, EOFError):  # the process of the swarm has ended
        sys.exit(130)


LEAD_S = 0.3  # time between start message and mission start (s), for all processes to receive it
PATIENCE_S = 5.0  # time to terminate before a process is killed (s)


class SwarmError(MissionsError):
    """A vehicle could not start."""


@dataclass(frozen=True, slots=True)
class Swarm:
    """Result of a swarm: outcomes of completed vehicles in node order, ``ended`` reasons of the others.

    ``equal`` is True if all live vehicles hold equal items.
    """

    scenario: str
    vehicles: list[NodeOutcome]
    ended: dict[str, str]
    equal: bool


Running = Mapping[str, tuple[SpawnProcess, Connection]]  # processes by vehicle, each with the connection to it


@contextmanager
def _started(jobs: Mapping[str, Callable[[Connection], None]]) -> Iterator[Running]:
    """Start a process for each job; they end with the context."""
    running: dict[str, tuple[SpawnProcess, Connection]] = {}
    context = multiprocessing.get_context("spawn")
    try:
        with switched_on(SAFE_PATH):
            for name, job in jobs.items():
                own, theirs = context.Pipe()
                process = context.Process(target=job, args=(theirs,), daemon=True)
                process.start()
                # While this process holds the other end, a dead vehicle would not end the connection.
                theirs.close()
                running[name] = process, own
        yield running
    finally:
        # All processes end at once, so that their patience passes only once.
        for process, _ in running.values():
            process.terminate()
        for process, own in running.values():
            process.join(PATIENCE_S)
            if process.exitcode is None:
                process.kill()
                process.join()
            own.close()


def _begin(running: Running) -> None:
    """Start the mission of all processes; raises SwarmError if one could not start."""
    # Every socket is bound before any vehicle starts: packets to an unbound port would be lost.
    ports: dict[str, int] = {}
    for name, (_, own) in running.items():
        port = _said(own)
        if not isinstance(port, int):
            raise SwarmError(f"{name}: {port or 'its process ended before the mission started'}")
        ports[name] = port
    start_s = time.monotonic() + LEAD_S
    for name, (_, own) in running.items():
        with suppress(OSError):  # ``_said`` reports a process that has ended
            own.send((start_s, [port for other, port in ports.items() if other != name]))


def _said(own: Connection) -> Any:
    try:
        # An ended process gives no message, hence None.
        return own.recv()
    except (EOFError, OSError):
        return None


def swarm(
    scenario: str,
    plans: Sequence[NodePlan],
    speed: float,
    lost_and_doubled: tuple[float, float] = (0.0, 0.0),
    out: Path | None = None,
    begun: Callable[[dict[str, int]], None] = lambda pids: None,
) -> Swarm:
    """Run vehicles in separate processes on this machine, and wait for their end; SwarmError if one could not start.

    Args:
        plans: in node order.
        speed: seconds of the mission per second.
        lost_and_doubled: share of packets that a receiver loses, and share of the others that it receives twice.
        begun: called with the process ids at the start of the mission.
    """
    mishaps, folders = Mishaps(*lost_and_doubled), plugin_folders()
    jobs = {plan.vehicle: partial(work, plan, speed, mishaps, out, folders) for plan in plans}
    vehicles, ended = list[NodeOutcome](), dict[str, str]()
    with _started(jobs) as running:
        _begin(running)
        begun({name: process.pid or 0 for name, (process, _) in running.items()})
        for name, (process, own) in running.items():
            report = _said(own)
            process.join()
            if isinstance(report, NodeOutcome):
                vehicles.append(report)
            else:
                ended[name] = report or f"its process ended with {process.exitcode}"
    states = {vehicle.state_hash for vehicle in vehicles if vehicle.is_alive}
    return Swarm(scenario, vehicles, ended, len(states) == 1)
