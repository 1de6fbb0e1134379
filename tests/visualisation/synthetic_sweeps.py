"""Synthetic sweeps: a folder as a sweep writes it, with numbers from a simple law and keyed noise."""

import hashlib
import itertools
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from missions.comparison import Comparison
from missions.comparison.baseline import compare
from missions.comparison.treatments import FIELDS
from missions.disk import STUDY
from missions.mapping.metrics import METRICS as MAPPING_METRICS
from missions.metric import Metric
from missions.runs.metrics import CORE_METRICS
from missions.sweeps.factorial import HIGH, designed
from missions.sweeps.folder import SweepResults
from missions.sweeps.ledger import DONE, FAILED, LEDGER
from missions.sweeps.plan import ConfigurationLabel, RunSchedule, seed_of
from missions.sweeps.study_file import StudyFile

METRICS = (*CORE_METRICS, *MAPPING_METRICS)
"""What the folders of the sweeps declare."""
SEVEN = ("remoras", "fixed-partition", "central", "contract-net", "status-broadcast", "cbba", "rendezvous-sync")
TEN = tuple(round(0.1 * at, 1) for at in range(10))
HORIZON_S = 7200.0


def law(strategy: str, policy: str, per: float, repeat: int, settings: dict[str, Any]) -> dict[str, Any]:
    """A summary: everything gets worse with loss, in each strategy in its own way; seeds are shared by repeats."""
    kind = SEVEN.index(strategy) if strategy in SEVEN else 3
    own = np.random.Generator(np.random.Philox([int(1000 * per), repeat, kind]))
    shared = np.random.Generator(np.random.Philox([int(1000 * per), repeat]))
    burden = 1.0 / (1.0 - per) + 0.2 * ("-repeat" in policy) + 0.05 * sum(map(float, settings.values()))
    noise = 0.06 * shared.standard_normal() + 0.03 * own.standard_normal()
    time_s = 1500.0 * (1.0 + 0.04 * kind + 0.02 * (1 + kind % 3) * burden) * (1.0 + noise)
    completed = bool(own.random() < 1.0 - (0.02 + 0.05 * kind) * per**3)
    return {
        "completed": completed,
        "mission_time_s": time_s if completed else HORIZON_S,
        "coverage_fraction": 1.0 - 0.06 * kind * per**2 * shared.random() if kind else 1.0,
        "duplicate_fraction": min(1.0, 0.05 * kind * per * (1.0 + 0.2 * own.standard_normal())),
        "distance_m": 9.0 * time_s,
        "energy_j": 90.0 * time_s * (1.0 + 0.01 * kind),
        "n_packets": int(time_s),
        "n_bytes": int(2000.0 * (1 + kind) * burden * (1.0 + noise)),
        "delivery_ratio": 1.0 - per,
        "mean_latency_s": 12.0 * burden**1.5 * (1.0 + 0.1 * kind) * (1.0 + noise),
        "p95_latency_s": None,
        "false_beliefs": 0,
    }


def flat(strategy: str, policy: str, per: float, repeat: int, settings: dict[str, Any]) -> dict[str, Any]:
    """Everything equal, to the last digit."""
    return {**law("remoras", "ack", 0.0, 0, {}), "coverage_fraction": 0.0, "duplicate_fraction": 0.0, "n_bytes": 0}


@dataclass
class Sweep:
    """A study over everything that is listed; ``channels`` are (name, loss rates, its other keys)."""

    strategies: Sequence[str] = SEVEN
    policies: Sequence[str] = ("m-ack",)
    scenarios: Sequence[str] = ("mapping-rendezvous",)
    channels: Sequence[tuple[str, Sequence[float], dict[str, Any]]] = (("bernoulli", TEN, {}),)
    grid: dict[str, Sequence[Any]] = field(default_factory=dict)
    factorial: dict[str, list[Any]] = field(default_factory=dict)
    halvings: int = 0
    unforeseen: Sequence[str] = ()
    repeats: int = 30
    n_failed: int = 0
    n_remaining: int = 0
    consistency: bool = False
    metrics: Sequence[str] = ()
    declared: Sequence[Metric] = METRICS
    summary: Callable[..., dict[str, Any]] = law

    def write(self, folder: Path) -> SweepResults:
        """The folder of the sweep, read back."""
        folder.mkdir(parents=True)
        points = [dict(zip(self.grid, values, strict=True)) for values in itertools.product(*self.grid.values())]
        if self.factorial:
            runs = designed(tuple(self.factorial), self.halvings).runs
            points = [{key: self.factorial[key][level == HIGH] for key, level in run.items()} for run in runs]
        channels = [(name, per, keys) for name, rates, keys in self.channels for per in rates]
        cases = self.unforeseen or [""]
        cells = list(itertools.product(self.scenarios, self.strategies, self.policies, channels, points, cases))
        design = {
            "name": "synthetic", "scenario": list(self.scenarios), "strategies": list(self.strategies),
            "policies": list(self.policies), "repeats": self.repeats, "seed": 11,
        }  # fmt: skip
        if self.factorial:
            design |= {"sampling": "factorial", "halvings": self.halvings}
        if self.metrics:
            design["metrics"] = list(self.metrics)
        axis = [{"name": name, "set": {"unforeseen.key": number}} for number, name in enumerate(self.unforeseen)]
        file = StudyFile.model_validate(
            {"study": design, "grid": self.grid, "factorial": self.factorial, "unforeseen": axis}
        )
        labels = [
            ConfigurationLabel(
                "", tuple(self._line("", 0, *cell)["settings"].items()), "", HORIZON_S,
                hashlib.sha256(repr(cell).encode()).hexdigest(),
            )
            for cell in cells
        ]  # fmt: skip
        study = {
            "version": "9.8.7", "study": file.model_dump(mode="json"), "scenario": {},
            "metrics": [metric.written() for metric in self.declared], "configurations": [*map(vars, labels)],
        }  # fmt: skip
        (folder / STUDY).write_text(json.dumps(study), encoding="utf-8")
        schedule = RunSchedule("9.8.7", file, tuple(labels))
        lines = [
            self._line(schedule.key(number, repeat), repeat, *cell)
            for number, cell in enumerate(cells)
            for repeat in range(self.repeats)
        ]
        for line in lines[1 : 1 + self.n_failed]:
            identity = {name: line["summary"][name] for name in (*FIELDS, "seed")}
            line.update(status=FAILED, error="Traceback\nValueError: no fleet", replay="remoras run", summary=identity)
        made = lines[: len(lines) - self.n_remaining]
        (folder / LEDGER).write_text("".join(json.dumps(line) + "\n" for line in made), encoding="utf-8")
        return SweepResults.read(folder)

    def _line(
        self, key: str, repeat: int, scenario: str, strategy: str, policy: str,
        channel: tuple[str, float, dict[str, Any]], point: dict[str, Any], case: str,
    ) -> dict[str, Any]:  # fmt: skip
        name, per, keys = channel
        settings = {"strategy.name": strategy, "communication.policy": policy, "channel.name": name, "channel.per": per}
        settings |= {**keys, **point}
        settings |= {"unforeseen": case} if case else {}
        numbers = {key: value for key, value in point.items() if isinstance(value, int | float)}
        identity = {"scenario": scenario, "strategy": strategy, "policy": policy, "channel": name, "per": per}
        summary = {**identity, "seed": seed_of(11, repeat), **self.summary(strategy, policy, per, repeat, numbers)}
        if self.consistency:
            summary["consistency_time_s"] = 2.0 * summary["mean_latency_s"] if math.fmod(repeat, 5) else None
        return {
            "key": key, "status": DONE, "repeat": repeat, "settings": settings, "summary": summary, "error": "",
            "replay": "", "duration_s": 7200.0, "tables": "", "machine": {},
        }  # fmt: skip


LONG = "mypackage.organisations.strategies:AN_EXTRAORDINARILY_LONG_NAME_OF_A_STRATEGY"
FEW = (0.1, 0.5, 0.8)
BURSTS = [("gilbert-elliott", FEW, {"channel.mean_burst": burst}) for burst in (2.0, 4.0, 8.0)]
SWEEPS = {
    "seven strategies": Sweep(repeats=5, consistency=True),
    "one strategy": Sweep(["remoras"], ["ack", "ack-repeat", "m-ack", "mps-ack", "knowledge", "adaptive"], repeats=3),
    "strategies and policies": Sweep(["remoras", "cbba", LONG], ["ack", "mps-ack-repeat"], repeats=3),
    "three channels": Sweep(SEVEN[:3], channels=[("perfect", [0.0], {}), *BURSTS], repeats=3),
    "vehicles": Sweep(SEVEN, channels=[("bernoulli", [0.4], {})], grid={"fleet.size": [2, 4, 8, 16]}, repeats=3),
    "one point": Sweep(["remoras"], channels=[("perfect", [0.0], {})], repeats=1),
    "unforeseen": Sweep(
        SEVEN, channels=[("bernoulli", FEW, {})], repeats=3,
        unforeseen=("nothing", "speeds within 30 %", "one vehicle lost", "the head lost", "found"),
    ),
    "all the same": Sweep(SEVEN, channels=[("bernoulli", FEW, {})], repeats=3, summary=flat),
}  # fmt: skip


def rows_of(tmp_path: Path, sweep: Sweep) -> list[Comparison]:
    """Rows of the mission time of a sweep."""
    return compare(sweep.write(tmp_path / str(len(list(tmp_path.iterdir())))), ["mission_time_s"])
