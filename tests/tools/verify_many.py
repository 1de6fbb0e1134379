"""Draw scenarios and settings by seed, run each, and let ``remoras verify`` read what came of it.

    python -m tests.tools.verify_many 1 200

runs seeds 1 to 200 and prints, for each run of which something does not follow, its settings and the findings. Exit
code 1 if there is one.
"""

from __future__ import annotations

import random
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

from missions.errors import MissionsError
from missions.files import shipped
from missions.runs.results import write_results
from missions.runs.run import run
from missions.scenarios import load
from missions.verification import verify
from remoras.errors import RemorasError
from remoras.strategies import strategies

POLICIES = ("ack", "ack-repeat", "m-ack", "m-ack-repeat", "mps-ack", "mps-ack-repeat")
SEAS: tuple[tuple[str, ...], ...] = (
    (), ("current.east_mps=0.3",), ("current.east_mps=-0.2", "current.north_mps=0.25", "current.tide_period_h=1.5"),
    ("current.north_mps=0.5", "current.shear_depth_m=60", "current.tide_phase=0.2", "current.tide_period_h=12.42"),
)  # fmt: skip
SETTINGS: tuple[tuple[str, ...], ...] = (
    (), (), ("communication.needs_follow=groups",), ("uncertainty.p_miss=0.2",),
    ("uncertainty.speed_spread=0.2",), ("navigation.drift=0.01",), ("communication.receive_power_w=0.5",),
    ("communication.clocks.offset_s=0.2", "communication.clocks.apart_s=1.0"), ("communication.crc_bits=16",),
    ("communication.parking=false",), ("communication.relaying=false",), ("communication.queue_limit=20",),
    ("communication.summaries=false",), ("guidance.separation_m=12",), ("scenario.settle_s=300",),
    ("communication.lease_frames=10",),
    ('communication.modem="whoi-fsk-0"',), ("decision.weight_external=0",),
)  # fmt: skip


def drawn(seed: int) -> tuple[str, list[str]]:
    """A shipped scenario and settings of it, drawn by a seed."""
    draw = random.Random(seed)
    name = draw.choice([*(one for one in shipped() if one.startswith("mapping")), *shipped()])
    duration_s = draw.choice((300, 700, 1500) if name.startswith("mapping") else (4000,))
    settings = [f"scenario.duration_s={duration_s}"]
    if name.startswith("mapping"):
        settings.append(f"strategy.name={draw.choice(sorted(strategies()))}")
        channel = draw.choice(("perfect", "bernoulli", "bernoulli", "gilbert-elliott", "acoustic"))
        settings.append(f"channel.name={channel}")
        if channel == "bernoulli":
            settings.append(f"channel.per={draw.choice((0.0, 0.2, 0.4, 0.6))}")
    settings += [f"communication.policy={draw.choice(POLICIES)}", *draw.choice(SEAS)]
    settings += [*draw.choice(SETTINGS), *draw.choice(SETTINGS)]
    vehicles = [one.name for one in load(name).vehicle]
    faults = []
    for vehicle in draw.sample(vehicles, min(draw.choice((0, 0, 1, 2)), len(vehicles))):
        kind = draw.choice(("lost", "mute", "deaf", "slow", "sensor", "restarts", "joins", "drains"))
        at_s = round(draw.uniform(20.0, 0.6 * duration_s), 1)
        until = kind == "restarts" or (kind != "joins" and draw.random() < 0.5)
        ends = f",until_s={at_s + round(draw.uniform(20.0, 120.0), 1)}" if until else ""
        power = f",drain_w={draw.choice((20, 300))}" if kind == "drains" else ""
        faults.append(f'{{kind="{kind}",vehicle="{vehicle}",at_s={at_s}{ends}{power}}}')
    if faults:
        settings.append(f"fault=[{','.join(faults)}]")
    return name, settings


def main(first: int, last: int) -> int:
    """Verify the runs of some seeds; 1 if something in one does not follow."""
    counts: Counter[str] = Counter()
    spent: dict[str, float] = {"run": 0.0, "verify": 0.0}
    for seed in range(first, last + 1):
        name, settings = drawn(seed)
        try:
            scenario = load(name, [("--set", one) for one in settings])
            began = time.perf_counter()
            finished = run(scenario, seed)
        except (MissionsError, RemorasError) as error:
            counts["refused"] += 1
            print(f"seed {seed}: refused: {str(error).splitlines()[-1][:160]}", flush=True)
            continue
        with tempfile.TemporaryDirectory() as folder:
            write_results(finished, Path(folder), force=True)
            spent["run"] += (middle := time.perf_counter()) - began
            report: Any = verify(Path(folder))
            spent["verify"] += time.perf_counter() - middle
        counts["findings" if report.findings else "all follows"] += 1
        if report.findings:
            print(f"seed {seed}: {name} {' '.join(settings)}")
            print(*[f"    {line}" for line in list(report.lines)[:6]], sep="\n", flush=True)
    print(f"{dict(counts)}; run {spent['run']:.0f} s, verify {spent['verify']:.0f} s")
    return int(counts["findings"] > 0)


if __name__ == "__main__":
    raise SystemExit(main(int(sys.argv[1]), int(sys.argv[2])))
