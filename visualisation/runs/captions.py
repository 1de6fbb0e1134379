"""Captions: what a figure shows, and the conditions of the run that it shows."""

from __future__ import annotations

from collections.abc import Sequence

from missions.figure import RunResults
from visualisation import run_records, words


def roles(results: RunResults, folded: Sequence[Sequence[str]] = ()) -> str:
    """Caption of the roles over time.

    Args:
        results: of the run.
        folded: vehicles of each lane that stands for several.
    """
    lanes = "; ".join(f"{len(vehicles)} vehicles: {', '.join(vehicles)}" for vehicles in folded)
    return of_run(
        results,
        "Roles of the vehicles over mission time.",
        "A thin bar: the vehicle holds the role; a solid bar: the role drives the vehicle.",
        f"Vehicles with the same roles share a lane, where the height is the share of them ({lanes})." if lanes else "",
        is_timed=True,
    )


def of_run(results: RunResults, *sentences: str, is_timed: bool = False) -> str:
    """A caption: sentences of its figure, what the flags of a time axis mean, faults and conditions of the run."""
    return words.joined(*sentences, time_notes(results) if is_timed else "", faults(results), run_conditions(results))


def faults(results: RunResults) -> str:
    """What befell the vehicles of the run, in a sentence; empty without faults."""
    listed = [
        f"{fault.vehicle} {fault.kind} (from {words.time(fault.span.start_s)} on, {fault.detail})"
        for fault in run_records.vehicle_faults(results)
    ]
    return f"Faults: {'; '.join(listed)}." if listed else ""


def satisfaction_caption(results: RunResults) -> str:
    """Caption of the personal satisfaction."""
    return words.joined(
        "Personal satisfaction of the roles of every vehicle (\u2212128 to 127).",
        "A line is thick while the role drives the vehicle; below zero (shaded) it calls on others.",
        "Colours are those of the vehicles, lines and markers tell their roles.",
        time_notes(results),
        run_conditions(results),
    )


def run_conditions(results: RunResults) -> str:
    """Scenario, n, seed, strategy, policy, channel with what it assumes, packet error rate and mission time."""
    summary = results.summary
    per = summary.get("per")
    assumed = f" ({text})" if (text := results.manifest.get("assumed")) else ""
    channel = f"{summary['channel']} channel{assumed}" + (f", PER {100 * per:.3g} %" if per is not None else "")
    reason = summary["reason"] or "no reason given"
    ending = "mission completed" if summary["completed"] else f"not completed ({reason})"
    return (
        f"Scenario {summary['scenario']}, n = {summary['n_vehicles']} vehicles, seed {summary['seed']}, "
        f"strategy {summary['strategy']}, policy {summary['policy']}, {channel}; "
        f"{ending}, mission time {words.time(summary['mission_time_s'])}."
    )


def time_notes(results: RunResults) -> str:
    """What the flags mean; empty without any."""
    listed = "; ".join(f"{one.label}, {words.time(one.time_s)}" for one in run_records.milestones(results))
    return f"Numbered flags: milestones ({listed})." if listed else ""
