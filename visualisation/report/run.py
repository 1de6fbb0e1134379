"""Report of a run: question, map and tracks, changed keys, roles, metrics, events, command."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from missions import words
from missions.files import leaves, shown
from missions.metric import Metric
from missions.runs.results import Results
from visualisation import output, run_records
from visualisation.page import DrawnPage
from visualisation.report.document import Commands, Items, Part, Picture, Report, Table

SCENARIO = "scenario.toml"
DIGITS = 6  # significant digits of values


def run_report(
    run: Results, metrics: Mapping[str, Metric], shipped: Mapping[str, Any] | None, drawn: Callable[[str], DrawnPage]
) -> Report:
    """Return the report of a run.

    ``shipped`` are the tables of the shipped scenario of that name, None without one; ``drawn`` draws a kind of figure.
    """
    summary = run.summary
    limits = [
        f"one run with one seed ({summary['seed']}) has no interval and supports no comparison",
        *([] if summary["completed"] else [f"the mission did not complete: {summary['reason']}"]),
    ]
    per = f" at {shown}" if (shown := run_records.error_rate(run)) else ""
    title = run.scenario_tables["scenario"].get("title", "")
    sections: dict[str, Sequence[Part]] = {
        "Question": [
            words.joined(
                f"{title}." if title else "",
                f"What does strategy {summary['strategy']} achieve with {summary['n_vehicles']} vehicles in "
                f"{summary['scenario']}, over the {summary['channel']} channel{per}, with policy {summary['policy']} "
                f"and seed {summary['seed']}?",
            )
        ],
        "Map and tracks": [Picture("trajectories", drawn("trajectories"))],
        "Configuration": [_changes(run, shipped)],
        "Roles": [Picture("roles", drawn("roles"))] if run.has("roles") else ["The results have no table of roles."],
        "Summary": [_summary(summary, metrics)],
        "Events": [_events(run)],
        "Methods": [
            f"The mission was simulated with remoras {run.manifest['version']} [@remoras], Python "
            f"{run.manifest.get('python', 'of unknown version')}, run key {run.manifest.get('run_id', 'none')}."
        ],
        "Limits": [Items([f"{words.capital(limit).rstrip('.')}." for limit in limits])],
        "To repeat": [
            Commands([f"remoras run {SCENARIO} --seed {summary['seed']} --out run", "remoras report run --out report"])
        ],
    }
    heading = f"{summary['scenario']}: {summary['strategy']}, seed {summary['seed']}"
    files = {SCENARIO: run.manifest["scenario"]}
    return Report(heading, run.manifest["version"], sections, output.about_run(run), files)


def _changes(run: Results, shipped: Mapping[str, Any] | None) -> Part:
    name = run.summary["scenario"]
    if shipped is None:
        return f"No shipped scenario has the name {name}; {SCENARIO} has the whole configuration."
    was, now = (dict(leaves(tables)) for tables in (shipped, run.scenario.model_dump(mode="json")))
    changed = [key for key in dict.fromkeys([*was, *now]) if was.get(key) != now.get(key)]
    if not changed:
        return f"All keys have the values of the shipped scenario {name}."
    rows = [[key, *(shown(side[key]) if key in side else "none" for side in (was, now))] for key in changed]
    caption = f"Keys that differ from the shipped scenario {name}."
    return Table("configuration", caption, ["key", "shipped", "this run"], rows)


def _summary(summary: Mapping[str, Any], metrics: Mapping[str, Metric]) -> Table:
    rows = []
    for name, value in summary.items():
        if (metric := metrics.get(name)) is not None:
            unit = "" if metric.unit == "1" else metric.unit
            label = name.replace("_", " ") if isinstance(value, bool) else metric.label  # no rate of a single run
            rows.append([label, _value(value), unit, name])
    caption = "Metrics of the run; none: the run has no value."
    return Table("summary", caption, ["metric", "value", "unit", "field"], rows, (1,))


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "none" if value is None else f"{value:.{DIGITS}g}" if isinstance(value, float) else str(value)


def _events(run: Results) -> Table:
    events = [(milestone.time_s, milestone.label) for milestone in run_records.milestones(run)]
    events += [
        (fault.span.start_s, f"fault {fault.kind}: {fault.vehicle}{f' ({fault.detail})' if fault.detail else ''}")
        for fault in run_records.vehicle_faults(run)
    ]
    rows = [[f"{time_s:.1f}", event] for time_s, event in sorted(events)]
    return Table("events", "Milestones and faults in time order.", ["time / s", "event"], rows, (0,))
