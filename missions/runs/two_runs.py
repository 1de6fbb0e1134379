"""Difference of two runs: keys, metrics, and the first recorded event that only one of them has."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from missions.files import leaves
from missions.runs.results import RUN_ID, Results, identity
from remoras.recorder import TIME

PACKETS = "packets"
FATE = {"receivers", "lost_by", "arrivals_s", "collided_at", "acks"}  # columns of a packet that the channel decides
ORDER = ("faults", "organisation", "roles", "plans", "decisions", "activities", PACKETS)
"""Tables in the order in which events of one time cause each other; then the others."""

Row = Mapping[str, Any]


@dataclass(frozen=True)
class EventDifference:
    """First event by time that differs: the rows of its vehicle in each run, None where a run has none; its cause."""

    time_s: float
    table: str
    first: Row | None
    other: Row | None
    cause: str


@dataclass(frozen=True)
class RunDifference:
    """Difference of two runs.

    Args:
        keys: values of differing keys in both runs, None where absent; seed, version and libraries included.
        metrics: values of common metrics.
        only_first, only_other: tables of one run.
        event: first differing event of the common tables, or None.
        same_bytes: all tables have equal bytes.
    """

    missions: tuple[str, str]
    keys: Mapping[str, tuple[Any, Any]]
    metrics: Mapping[str, tuple[Any, Any]]
    only_first: tuple[str, ...]
    only_other: tuple[str, ...]
    event: EventDifference | None
    same_bytes: bool


def difference_of(first: Results, other: Results) -> RunDifference:
    """Compare two runs, also of different missions; raise OutputError for damaged results."""
    a, b = _keys(first), _keys(other)
    keys = {key: (a.get(key), b.get(key)) for key in {**a, **b} if a.get(key) != b.get(key)}
    apart = {*identity(first.scenario, 0), RUN_ID, "milestones", "drawn"}
    metrics = {
        name: (value, other.summary[name])
        for name, value in first.summary.items()
        if name in other.summary and name not in apart
    }
    ours, theirs = ({path.name: path.read_bytes() for path in run.folder.glob("*.parquet")} for run in (first, other))
    return RunDifference(
        (first.scenario.scenario.mission, other.scenario.scenario.mission),
        keys,
        metrics,
        tuple(name for name in first.tables if not other.has(name)),
        tuple(name for name in other.tables if not first.has(name)),
        _first_event(first, other, keys),
        ours == theirs,
    )


def _keys(run: Results) -> dict[str, Any]:
    made_by = {name: run.manifest[name] for name in ("seed", "version", "libraries")}
    return dict(leaves({**made_by, **run.scenario_tables}))


def _first_event(first: Results, other: Results, keys: Mapping[str, Any]) -> EventDifference | None:
    place = {name: number for number, name in enumerate(ORDER)}
    events = []
    for name in first.tables:
        if other.has(name) and (found := _first_row(first, other, name)) is not None:
            events.append((found[0], place.get(name, len(place)), name, *found[1:]))
    if not events:
        return None
    time_s, _, name, ours, theirs = min(events, key=lambda event: event[:3])
    return EventDifference(time_s, name, ours, theirs, _cause(name, ours, theirs, keys))


def _first_row(first: Results, other: Results, name: str) -> tuple[float, Row | None, Row | None] | None:
    """Return time and rows of the first difference of a table with times, or None."""
    tables = first.table(name), other.table(name)
    columns = [column for column in tables[0].column_names if column in tables[1].column_names]
    if TIME.name not in columns:
        return None
    texts = []
    for table in tables:
        rows = table.select(columns).to_pylist()
        texts.append([(row[TIME.name], str(row), row) for row in rows])
    counts = [Counter((time_s, text) for time_s, text, _ in rows) for rows in texts]
    alone = [counts[0] - counts[1], counts[1] - counts[0]]
    if not (alone[0] or alone[1]):
        return None
    at_s = min(time_s for counter in alone for time_s, _ in counter)
    ours, theirs = (
        [row for time_s, text, row in rows if time_s == at_s and (time_s, text) in counter]
        for rows, counter in zip(texts, alone, strict=True)
    )
    subject = _subject((ours or theirs)[0])
    return at_s, *(next((row for row in rows if _subject(row) == subject), None) for rows in (ours, theirs))


def _subject(row: Row) -> str:
    """Vehicle of an event, or empty."""
    return str(row.get("vehicle", row.get("sender", "")))


def _cause(table: str, first: Row | None, other: Row | None, keys: Mapping[str, Any]) -> str:
    pair = (first, other) if first and other and table == PACKETS else None
    if pair and all(pair[0][key] == pair[1][key] for key in {*pair[0]} - FATE):
        ours, theirs = (set(row["receivers"]) for row in pair)
        only = [("first", ours - theirs), ("second", theirs - ours)]
        heard = [f"{', '.join(sorted(names))} received it in the {run} run only" for run, names in only if names]
        return "; ".join(heard) or "the channel"
    named = ", ".join(keys)
    return (
        f"the keys that differ, since no event before does: {named}" if keys else "none: the configurations are equal"
    )
