"""Captions: what a figure shows, and the conditions of the run that it shows."""

from __future__ import annotations

from collections.abc import Sequence

from missions.runs.results import Results
from visualisation.runs import reading, windows


def trajectories(results: Results) -> str:
    """Caption of the tracks."""
    sentences = ["Trajectories of the vehicles, x east and y north."]
    end_s = reading.end_s(results)
    step_s = reading.marker_step_s(end_s)
    sentences.append(f"Markers on a track are {step_s:g} s apart (closer where a panel shows less time).")
    for what, places in (
        ("Outlines: areas", reading.areas(results)),
        ("Stars: rally points", reading.rally_points(results)),
    ):
        if places:
            sentences.append(f"{what} {_listed([place.name for place in places])}.")
    if reading.first_mapped(results):
        sentences.append("Cells are shaded in the colour of the vehicle that mapped them first.")
    for milestone in reading.milestones(results):
        if milestone.name == "mapping_stopped":
            sentences.append(f"{milestone.vehicle} gave up mapping at {_time(milestone.time_s)}.")
    return " ".join([*sentences, conditions(results)])


def roles(results: Results) -> str:
    """Caption of the roles over time."""
    return " ".join(
        [
            "Roles of the vehicles over mission time.",
            "A thin bar: the vehicle holds the role; a solid bar: the role drives the vehicle.",
            *_time_notes(results),
            conditions(results),
        ]
    )


def satisfaction(results: Results) -> str:
    """Caption of the personal satisfaction."""
    return " ".join(
        [
            "Personal satisfaction of the roles of every vehicle (\u2212128 to 127).",
            "A line is thick while the role drives the vehicle; below zero (shaded) it calls on others.",
            *_time_notes(results),
            conditions(results),
        ]
    )


def coverage(results: Results) -> str:
    """Caption of the mapped share."""
    sentence = "Mapped share of the areas over mission time."
    count = "A cell counts for the vehicle that mapped it first."
    return f"{sentence} {count} {conditions(results)}"


def conditions(results: Results) -> str:
    """Scenario, n, seed, strategy, policy, channel, packet error rate and mission time of the run."""
    summary = results.summary
    per = summary.get("per")
    channel = f"{summary['channel']} channel" + (f", PER {100 * per:g} %" if per is not None else "")
    reason = summary["reason"] or "no reason given"
    ending = "mission completed" if summary["completed"] else f"not completed ({reason})"
    return (
        f"Scenario {summary['scenario']}, n = {summary['n_vehicles']} vehicles, seed {summary['seed']}, "
        f"strategy {summary['strategy']}, policy {summary['policy']}, {channel}; "
        f"{ending}, mission time {_time(summary['mission_time_s'])}."
    )


def _time_notes(results: Results) -> list[str]:
    notes = []
    milestones = reading.milestones(results)
    if milestones:
        listed = "; ".join(f"{milestone.label}, {_time(milestone.time_s)}" for milestone in milestones)
        notes.append(f"Numbered flags: milestones ({listed}).")
    times_s = reading.eventful_times_s(results)
    middle = windows.eventful(times_s, reading.end_s(results))
    if middle is not None:
        span = f"{_time(middle.start_s)} to {_time(middle.end_s)}"
        notes.append(f"The time axis is broken: {span} has a scale of its own.")
    return notes


def _time(time_s: float) -> str:
    return f"{time_s:.0f} s" if time_s >= 100 else f"{time_s:.1f} s"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:-1]) + f" and {names[-1]}" if len(names) > 1 else names[0]
