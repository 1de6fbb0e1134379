"""Swarm: one process per vehicle.

A process reads its job (first line), prints its port, reads the ports of the others and the mission start, and prints
its outcome or a fault (last line).
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

from exchange.drivers import Paced, Socket, UdpDriver
from exchange.errors import ExchangeError
from missions.errors import MissionsError
from missions.nodes.alone import NodePlan, alone
from missions.nodes.logs import NodeLog
from missions.nodes.node import Mishaps, VehicleNode
from remoras.errors import RemorasError
from remoras.plugins import SAFE_PATH, look_in, plugin_folders

MODULE = "missions.nodes.swarm"
LOOPBACK = "127.0.0.1"


@dataclass(frozen=True, slots=True)
class NodeJob:
    """Job of the process of one vehicle.

    Attributes:
        plan: ``NodePlan`` as JSON.
        port: UDP port, 0 for a free one.
        speed: seconds of the mission per second.
        out: folder of its log; empty for none.
        folders: search path of plug-ins.
    """

    plan: dict[str, Any]
    port: int
    speed: float
    p_lost: float
    p_doubled: float
    out: str
    folders: Sequence[str] = ()


def work(job: NodeJob) -> dict[str, Any]:
    """Run the vehicle of a job until its end; return its outcome."""
    plan = NodePlan(**job.plan)
    own = alone(plan)
    port = Socket((LOOPBACK, job.port))
    say({"port": port.address[1]})
    given = json.loads(sys.stdin.readline())
    pace = Paced(given["start_s"], job.speed)
    driver = UdpDriver(port, [(LOOPBACK, number) for number in given["ports"]], pace, own.setup.modem.packet_s)
    log = NodeLog(Path(job.out), plan) if job.out else None
    return asdict(VehicleNode(own, driver, pace, log, Mishaps(job.p_lost, job.p_doubled)).run())


def say(value: dict[str, Any]) -> None:
    """Print a JSON line."""
    print(json.dumps(value), flush=True)


def main() -> None:
    """Run the job read from standard input."""
    job = NodeJob(**json.loads(sys.stdin.readline()))
    look_in(job.folders)
    try:
        say({"outcome": work(job)})
    except (ExchangeError, MissionsError, RemorasError) as error:
        say({"error": str(error)})
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()


LEAD_S = 0.3
"""Time between start message and mission start (s), for all processes to read it."""
PATIENCE_S = 5.0
"""Time to terminate before a process is killed (s)."""


class SwarmError(MissionsError):
    """A vehicle could not start."""


@dataclass(frozen=True, slots=True)
class Swarm:
    """Result of a swarm.

    Attributes:
        vehicles: outcomes of completed vehicles, in node order.
        ended: reasons of the others, by name.
        equal: True if all live vehicles hold equal items.
    """

    scenario: str
    vehicles: list[dict[str, Any]]
    ended: dict[str, str]
    equal: bool


class Processes:
    """Processes of a swarm, by vehicle name."""

    def __init__(self, jobs: dict[str, NodeJob]) -> None:
        self._jobs = jobs
        self._running: dict[str, subprocess.Popen[str]] = {}
        self.ended: dict[str, str] = {}

    def __enter__(self) -> Processes:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for process in self._running.values():
            if process.poll() is None:
                process.terminate()
        for process in self._running.values():
            try:
                process.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            for stream in (process.stdin, process.stdout):
                if stream is not None:
                    with suppress(OSError):
                        stream.close()

    @property
    def pids(self) -> dict[str, int]:
        """Process ids, by vehicle."""
        return {name: process.pid for name, process in self._running.items()}

    def begin(self) -> None:
        """Start all processes and their mission; raises SwarmError if one could not start."""
        environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(sys.path),
            SAFE_PATH: "1",
        }  # same module search path as this process
        for name, job in self._jobs.items():
            self._running[name] = subprocess.Popen(
                [sys.executable, "-c", f"from {MODULE} import main; main()"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
                env=environment,
            )
            self._tell(name, asdict(job))
        ports: dict[str, int] = {}
        for name in self._jobs:
            said = self._said(name)
            if "port" not in said:
                raise SwarmError(f"{name}: {said.get('error', 'its process ended before it began')}")
            ports[name] = said["port"]
        start_s = time.monotonic() + LEAD_S
        for name in self._jobs:
            others = [port for other, port in ports.items() if other != name]
            self._tell(name, {"start_s": start_s, "ports": others})

    def outcomes(self) -> list[dict[str, Any]]:
        """Wait for all processes; return the outcomes of the completed ones."""
        found = []
        for name, process in self._running.items():
            said = self._said(name)
            process.wait()
            if "outcome" in said:
                found.append(said["outcome"])
            else:
                self.ended[name] = said.get("error", f"its process ended with {process.returncode}")
        return found

    def _tell(self, name: str, value: dict[str, Any]) -> None:
        stdin = self._running[name].stdin
        with suppress(OSError):  # ``_said`` reports a process that has ended
            assert stdin is not None
            stdin.write(json.dumps(value) + "\n")
            stdin.flush()

    def _said(self, name: str) -> dict[str, Any]:
        stdout = self._running[name].stdout
        assert stdout is not None
        line = stdout.readline()
        try:
            value: dict[str, Any] = json.loads(line)
        except ValueError:
            return {}
        return value


def swarm(
    scenario: str,
    plans: Sequence[NodePlan],
    speed: float,
    lost_and_doubled: tuple[float, float] = (0.0, 0.0),
    out: Path | None = None,
    first_port: int = 0,
    begun: Callable[[dict[str, int]], None] = lambda pids: None,
) -> Swarm:
    """Run vehicles in separate processes on this machine, and wait for their end.

    Args:
        plans: in node order.
        speed: seconds of the mission per second.
        lost_and_doubled: share of packets that a receiver loses, and share of the others that it receives twice.
        out: folder of the logs; None for none.
        first_port: port of the first vehicle, followed by the others; 0 for free ports.
        begun: called with the process ids at the start of the mission.

    Raises SwarmError if a vehicle could not start.
    """
    folder = "" if out is None else str(out)
    jobs = {
        plan.vehicle: NodeJob(
            asdict(plan), first_port and first_port + number, speed, *lost_and_doubled, folder, plugin_folders()
        )
        for number, plan in enumerate(plans)
    }
    with Processes(jobs) as processes:
        processes.begin()
        begun(processes.pids)
        vehicles = processes.outcomes()
        alive = [vehicle for vehicle in vehicles if vehicle["is_alive"]]
        return Swarm(scenario, vehicles, processes.ended, len({node["state_hash"] for node in alive}) == 1)
