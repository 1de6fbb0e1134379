"""The process of one vehicle of a swarm: it takes its job from its standard input, line by line, and gives its outcome.

First line in: the job. First line out: the port that it listens on. Second line in: ports of the others, and when the
mission begins. Last line out: the outcome, or the fault that ended it.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from exchange.drivers import Paced, Socket, UdpDriver
from exchange.errors import ExchangeError
from missions.errors import MissionsError
from missions.nodes.alone import NodePlan, alone
from missions.nodes.logs import NodeLog
from missions.nodes.node import Mishaps, VehicleNode
from remoras.errors import RemorasError
from remoras.plugin_folders import look_in

MODULE = "missions.nodes.child"
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
