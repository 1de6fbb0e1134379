"""Figure ``htn``: plans as task trees over mission time, with the status of each task."""

from __future__ import annotations

import math
from collections import defaultdict
from itertools import pairwise
from typing import Any, NamedTuple

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from missions.figure import RunResults, run_end_s
from visualisation import run_records, style
from visualisation.page import DrawnPage
from visualisation.runs import captions
from visualisation.runs.declared import Kit
from visualisation.runs.sheet import Row, ends_in, fitting, room_in, sheet

ROW_IN = 0.125
DEPTHS = (99, 2, 1, 0)  # maximum tree depths, tried in order until a page fits; after the last, omit plans
HEIGHTS: dict[str, float] = {"waiting": 0.15, "running": 0.7}
"""Share of a row filled by the bar of a waiting or running task."""
ENDS: dict[str, dict[str, Any]] = {
    "done": {"marker": "o", "markersize": 3.0},
    "failed": {"marker": "X", "markersize": 4.5},
    "dropped": {"marker": "|", "markersize": 4.5},
}
EXPECTED: dict[str, Any] = {"marker": "d", "markersize": 3.0, "markerfacecolor": "white", "markeredgewidth": 0.6}
MARK: dict[str, Any] = {"color": style.BLACK, "linestyle": "none"}


class TaskStatus(NamedTuple):
    """Status of a task from a time on, and its expected end; infinite if unknown."""

    time_s: float
    status: str
    expected_s: float


class TaskRow(NamedTuple):
    """Task of a tree with its depth and status history."""

    depth: int
    label: str
    events: tuple[TaskStatus, ...]


class Tree(NamedTuple):
    """Plan of a vehicle for the mission of a group, or for one of its objectives."""

    vehicle: str
    is_of_group: bool
    tasks: tuple[TaskRow, ...]


def trees(results: RunResults) -> list[Tree]:
    """Return the plans of the run: plans of missions first, then by vehicle."""
    of_plan: dict[tuple[str, ...], dict[int, list[dict[str, Any]]]] = {}
    for row in results.rows("plans"):
        key = tuple(row[name] for name in ("vehicle", "group", "role", "objective", "argument"))
        of_plan.setdefault(key, defaultdict(list))[int(row["node"])].append(row)
    order = {name: number for number, name in enumerate(run_records.vehicle_names(results))}
    plans = [_tree(key, rows) for key, rows in of_plan.items()]
    return sorted(plans, key=lambda tree: (not tree.is_of_group, order.get(tree.vehicle, len(order))))


def _tree(key: tuple[str, ...], rows: dict[int, list[dict[str, Any]]]) -> Tree:
    vehicle, group, role, objective, argument = key
    below: dict[int, list[int]] = defaultdict(list)
    for node in sorted(rows):
        below[int(rows[node][0]["parent"])].append(node)
    tasks: list[TaskRow] = []
    for node, depth in run_records.preorder(below[-1], below.__getitem__):
        last = rows[node][-1]
        # The top task names the group; those below need not repeat it.
        label = str(last["task"]).replace(f"({group}, ", "(").replace(f"({group})", "") if depth else last["task"]
        if last["method"] and depth:
            label += f": {last['method']}"
        if not depth:
            label = f"{vehicle}  " + (f"{role}: {objective}({argument})" if role else label)
        tasks.append(TaskRow(depth, label, tuple(_event(row) for row in rows[node])))
    return Tree(vehicle, not role, tuple(tasks))


def _event(row: dict[str, Any]) -> TaskStatus:
    expected_s = row["expected_time_s"]
    known = expected_s is not None and not math.isnan(expected_s) and expected_s > 0.0
    return TaskStatus(row["time_s"], row["status"], row["time_s"] + expected_s if known else math.inf)


def picture(results: RunResults, width_in: float = style.PAGE_IN) -> DrawnPage:
    """Draw a row for each task, indented below its parent, with bars while it waits and runs."""
    plans = trees(results)
    shown = fitting(([_band(tree, depth) for tree in plans] for depth in DEPTHS), room_in(results, width_in))
    looks, end_s = Kit(results).looks, run_end_s(results)
    out_s = {
        name: gap.start_s for name, gaps in run_records.outages(results).items() for gap in gaps if gap.end_s > end_s
    }
    with style.paper():
        page = sheet(results, ends_in(shown)[-1] or 0.3, _legend(), width_in)
        for row, top_in in page.rows(shown):
            tree, task = row.content
            last_s = out_s.get(tree.vehicle, end_s)
            _row(page.axes, task, top_in + ROW_IN / 2, looks[tree.vehicle].colour, last_s)
        if not shown:
            page.axes.set_yticks([0.15], ["no plan was executed"])
        figure = page.finished()
    deepest = max((row.level for band in shown for row in band), default=0)
    has_deeper = any(task.depth > deepest for tree in plans for task in tree.tasks)
    return DrawnPage(figure, _caption(results, deepest, has_deeper, len(plans) - len(shown)))


def _band(tree: Tree, depth: int) -> list[Row[tuple[Tree, TaskRow]]]:
    return [
        Row(task.label, ROW_IN, task.depth, (tree, task), "normal" if task.depth else "bold")
        for task in tree.tasks
        if task.depth <= depth
    ]


def _row(axes: Axes, task: TaskRow, middle_in: float, colour: str, end_s: float) -> None:
    low_s, high_s = axes.get_xlim()
    shade, before = style.tint(colour, 0.4 if task.depth else 1.0), ""
    for event, after in pairwise((*task.events, TaskStatus(end_s, "", math.inf))):
        if event.status in HEIGHTS:
            high_in = HEIGHTS[event.status] * ROW_IN
            where_in = middle_in - high_in / 2, high_in
            axes.broken_barh([(event.time_s, after.time_s - event.time_s)], where_in, facecolor=shade, linewidth=0)
        marks = [(event.expected_s, EXPECTED)] if event.status == "running" else []
        if event.status in ENDS and before not in ENDS:
            marks.append((event.time_s, ENDS[event.status]))
        for time_s, look in marks:
            if low_s <= time_s < high_s or time_s == high_s == end_s:
                axes.plot([time_s], [middle_in], zorder=5, clip_on=False, **MARK, **look)
        before = event.status


def _legend() -> list[Artist]:
    widths = {"waiting": 1.0, "running": 5.0}
    bars = [Line2D([], [], color=style.GREY, linewidth=widths[name], label=name) for name in HEIGHTS]
    ends = [Line2D([], [], label=name, **MARK, **look) for name, look in ENDS.items()]
    return [*bars, *ends, Line2D([], [], label="expected end", **MARK, **EXPECTED)]


def _caption(results: RunResults, deepest: int, has_deeper: bool, n_left_out: int) -> str:
    return captions.of_run(
        results,
        "Plans of the vehicles as task trees over mission time: first plans of group missions, each at its leader, "
        "then plans of objectives.",
        "A subtask is below its task, the method behind the colon. A thin bar: the task waits; a thick bar: it runs; "
        "the mark at its end: done, failed, or dropped from the plan.",
        "A diamond: expected end of a step." if deepest > 0 else "",
        f"Tasks below depth {deepest} of a plan are not shown." if has_deeper and deepest else "",
        "Only the top task of each plan is shown." if has_deeper and not deepest else "",
        f"{n_left_out} plans are not shown." if n_left_out else "",
    )
