"""Swarm: one process per vehicle.

First line in: the job. First line out: the port that it listens on. Second line in: ports of the others, and when the
mission begins. Last line out: the outcome, or the fault that ended it.
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
    """What the process of one vehicle is to do.

    Attributes:
        plan: of its vehicle, as JSON.
        port: to listen on, 0 for any; speed: seconds of the mission in a second.
        p_lost, p_doubled: shares of packets that are lost, and heard twice.
        out: folder for its log; empty for none.
        folders: where named plug-ins may lie.
    """

    plan: dict[str, Any]
    port: int
    speed: float
    p_lost: float
    p_doubled: float
    out: str
    folders: Sequence[str] = ()


def work(job: NodeJob) -> dict[str, Any]:
    """Be the vehicle of a job until its end; returns its outcome."""
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
    """Print one line."""
    print(json.dumps(value), flush=True)


def main() -> None:
    """Do the job that the standard input gives."""
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
"""Seconds from the word to begin to the begin: all have read it by then."""
PATIENCE_S = 5.0
"""How long a process that was asked to end may take."""


class SwarmError(MissionsError):
    """A vehicle could not begin."""


@dataclass(frozen=True, slots=True)
class Swarm:
    """What came of a swarm.

    Attributes:
        scenario: its name.
        vehicles: outcomes of those that came to their end, as JSON, in the order of the nodes.
        ended: why each of the others did not, by name.
        equal: True if all that are alive hold the same items.
    """

    scenario: str
    vehicles: list[dict[str, Any]]
    ended: dict[str, str]
    equal: bool


class Processes:
    """The processes of a swarm.

    Args:
        jobs: of each, by the name of its vehicle.
    """

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
        """Numbers of the processes by vehicle."""
        return {name: process.pid for name, process in self._running.items()}

    def begin(self) -> None:
        """Start all of them, tell each where the others are, and agree on when the mission begins.

        Raises:
            SwarmError: one could not begin.
        """
        environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(sys.path),
            SAFE_PATH: "1",
        }  # modules are found where this one finds them
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
        """Wait until all have ended; outcomes of those that came to their end."""
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
        with suppress(OSError):  # one that has ended is told of when it is asked
            assert stdin is not None
            stdin.write(json.dumps(value) + "\n")
            stdin.flush()

    def _said(self, name: str) -> dict[str, Any]:
        """The next line of a process; empty if it has ended without one."""
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
    """Run vehicles in processes of their own, on this machine, and wait for their end.

    Args:
        scenario: its name.
        plans: of the vehicles, in the order of the nodes.
        speed: seconds of the mission in a second.
        lost_and_doubled: shares of packets that each receiver loses, and of the others that it hears twice.
        out: folder for the logs.
        first_port: of the first vehicle, the next ones follow; 0 for any that are free.
        begun: is told the numbers of the processes once the mission begins.

    Raises:
        SwarmError: a vehicle could not begin.
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
