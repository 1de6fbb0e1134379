"""Captions: content of a figure and conditions of its run."""

from __future__ import annotations

from missions import words
from missions.figure import RunResults
from visualisation import run_records


def of_run(results: RunResults, *sentences: str) -> str:
    """Return a caption: sentences of the figure, faults, run conditions."""
    return words.joined(*sentences, faults(results), run_conditions(results))


def faults(results: RunResults) -> str:
    """Describe the faults of the run's vehicles in a sentence; empty without faults."""
    listed = [
        f"{fault.vehicle} {fault.kind} (from {words.time(fault.span.start_s)} on, {fault.detail})"
        for fault in run_records.vehicle_faults(results)
    ]
    return f"Faults: {'; '.join(listed)}." if listed else ""


def run_conditions(results: RunResults) -> str:
    """Describe scenario, seed, strategy, policy, channel with assumptions, and outcome."""
    summary = results.summary
    assumed = f" ({text})" if (text := results.manifest.get("assumed")) else ""
    channel = f"{summary['channel']} channel{assumed}" + (
        f", {shown}" if (shown := run_records.error_rate(results)) else ""
    )
    # Further reasons and vehicles are in the summary.
    reason = (summary["reason"] or "no reason given").partition(";")[0]
    ending = "mission completed, mission time" if summary["completed"] else f"not completed ({reason}), ended at"
    return (
        f"Scenario {summary['scenario']}, n = {summary['n_vehicles']} vehicles, seed {summary['seed']}, "
        f"strategy {summary['strategy']}, policy {summary['policy']}, {channel}; "
        f"{ending} {words.time(results.ended_s)}."
    )
