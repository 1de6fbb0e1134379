"""What a file says of the run or the study that it shows: version, seed and key, so that a figure finds its data."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Any

from missions.figure import RunResults

if TYPE_CHECKING:
    from missions.sweeps.folder import SweepResults

NAME = "remoras"


def about_run(results: RunResults) -> dict[str, str]:
    """What files about a run carry: program and version, key of the run, seed, scenario, strategy, policy, channel.

    Args:
        results: of the run; older ones may lack a version or an id.
    """
    summary, manifest = results.summary, results.manifest
    found: dict[str, Any] = {
        "version": f"{NAME} {manifest.get('version', 'of unknown version')}",
        "run": run_key(results),
        **{name: summary.get(name) for name in ("seed", "scenario", "strategy", "policy", "channel", "per")},
    }
    return {name: str(value) for name, value in found.items() if value is not None}


def of_sweep(results: SweepResults) -> dict[str, str]:
    """What files about a sweep carry: program and version, key of the study, its master seed and its name."""
    schedule = results.schedule
    digest = hashlib.sha256(" ".join([schedule.version, *schedule.digests]).encode()).hexdigest()[:20]
    study = results.file.study
    return {"version": f"{NAME} {schedule.version}", "study": digest, "seed": str(study.seed), "name": study.name}


def run_key(results: RunResults) -> str:
    """The id that the run's files carry; of an older run without one, a hash of version, resolved scenario and seed."""
    manifest = results.manifest
    if "run_id" in manifest:
        return str(manifest["run_id"])
    said = f"{manifest.get('version')} {manifest['scenario']} {results.summary.get('seed')}"
    return hashlib.sha256(said.encode()).hexdigest()[:20]
