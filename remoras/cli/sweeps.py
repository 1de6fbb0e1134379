"""Commands about many runs: sweep, compare."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from remoras.cli import completion
from remoras.cli.app import FAILED, N_JOBS, Jobs, Json, aligned, as_typed, command, fail, note, show
from remoras.cli.runs import strategies_option
from remoras.process import Progress

if TYPE_CHECKING:
    from missions.comparison import Comparison
    from missions.comparison.crossing import Crossing
    from missions.comparison.effects import MainEffect
    from missions.runs.two_runs import RunDifference
    from missions.sweeps.driver import ReportProgress
    from missions.sweeps.folder import SweepResults, SweepStatus
    from missions.sweeps.study import Study

PARTLY_DONE = 3


@contextmanager
def making(label: str, folder: Path | None) -> Iterator[ReportProgress]:
    """Show the progress of runs made in the context; if they stop early, fail with the ``folder`` that keeps them."""
    from missions.sweeps.driver import PartlyDoneError

    with Progress(label, 1, "runs") as progress:
        try:
            yield progress.at
        except PartlyDoneError as error:
            kept = "" if folder is None else f"; finished runs are kept in {folder}, the same command resumes"
            fail(f"{error}{kept}", PARTLY_DONE)


@command("sweep", "remoras sweep strategies-quick --out results/quick --jobs 2")
def sweep(
    study: Annotated[str, typer.Argument(autocompletion=completion.study)] = "",
    out: Path | None = None,
    jobs: Jobs = N_JOBS,
    cluster: str | None = None,
    strategies: Annotated[list[str] | None, strategies_option("Strategy to add to those of the study")] = None,
    dry_run: bool = False,
    status: bool = False,
    accept_code: bool = False,
    retry_failed: bool = False,
    timeout_s: Annotated[float | None, typer.Option(min=0.001)] = None,
    as_json: Json = False,
) -> None:
    """Run all runs of a study, each once; resume after interruptions.

    Args:
        study (STUDY): Shipped study or TOML file; not needed with --status.

    Options:
        out (DIR): Folder for the runs; the same folder resumes an interrupted sweep.
        cluster (tcp://HOST:PORT): Dask scheduler to use instead of this machine.
        dry_run: Print number and duration of runs; write nothing.
        status: Print progress and failed runs of the sweep in --out; start nothing.
        accept_code: Resume although the code has changed; the column code distinguishes the runs.
        retry_failed: Repeat the runs that failed.
        timeout_s (SECONDS): Time limit of a run; a longer one fails; default: none.
    """
    from missions.files import STUDY, file_of, shipped_studies

    if out is None or not (study or status):
        missing = "STUDY" if out is not None else "--out DIR"
        fail(f"{missing} is missing; allowed: sweep STUDY --out DIR, or sweep --out DIR --status")
    if status:
        _show_status(out, as_json)
        return
    file_of(STUDY, study, shipped_studies())  # report an unknown name before heavy imports
    from missions.sweeps import driver
    from missions.sweeps.folder import progress_text
    from missions.sweeps.study import load_study

    loaded = load_study(study, strategies or ())
    if dry_run:
        guess = driver.estimate(loaded, jobs, out)
        counted = progress_text(guess.done, guess.remaining)
        lines = [counted, *([f"about {guess.estimate_s:.0f} s on {jobs} processes"] if guess.remaining else [])]
        show(asdict(guess), as_json, lines)
        _note_on_repeats(loaded)
        return
    with making(f"sweep {loaded.design.name}", out) as progress:
        outcome = driver.sweep(
            loaded,
            out,
            jobs,
            cluster,
            progress=progress,
            timeout_s=timeout_s,
            accept_code=accept_code,
            retry_failed=retry_failed,
        )
    lines = [_status_line(outcome), f"compare them with: remoras compare {as_typed(out)}"]
    show(asdict(outcome), as_json, lines)
    _note_on_repeats(loaded)
    if outcome.failed:
        note(f"{outcome.failed} runs failed; columns error and replay of {out}/runs.parquet")
        raise typer.Exit(FAILED)


def _note_on_repeats(study: Study) -> None:
    from missions.comparison.ranking import too_few

    if text := too_few(study.maximum):
        note(text)


def _show_status(folder: Path, as_json: bool) -> None:
    from missions.sweeps.folder import DAMAGED, SweepResults

    results = SweepResults.read(folder)
    status = results.status()
    failures = [line for line in results.lines.values() if line["error"]]
    shown = [f"failed: {line['error'].strip().splitlines()[-1]}\n  replay: {line['replay']}" for line in failures]
    shown += [f"{path}: {DAMAGED}" for path in results.damaged]
    show(asdict(status), as_json, [_status_line(status), *shown])


@command("compare", "remoras compare results/quick --metric mission_time_s --baseline remoras")
def compare(
    folder: Path,
    other: Path | None = None,
    metrics: Annotated[list[str] | None, typer.Option("--metric")] = None,
    baseline: Annotated[str | None, typer.Option(autocompletion=completion.baseline)] = None,
    of_factors: Annotated[bool, typer.Option("--effects")] = False,
    crossing: str | None = None,
    axis: str = "per",
    where: list[str] | None = None,
    refine: Annotated[int | None, typer.Option(min=1)] = None,
    jobs: Jobs = N_JOBS,
    out: Path | None = None,
    as_json: Json = False,
) -> None:
    """Compare the configurations of a sweep, or two runs: means, intervals, paired differences to a baseline.

    For a single run, print the named metrics.

    Args:
        folder (DIR): Folder of a sweep, or results of a run.
        other ([DIR2]): Results of another run, compared with the first.

    Options:
        metrics (METRIC): Field of the summary, or your metric mine.py:MINE of stored tables; default: those of the
            study.
        baseline (NAME): Strategy, policy or KEY=VALUE with which the others are compared; default: that of the study.
        of_factors: Main effects and interactions of a factorial study, paired by seed.
        crossing (A,B): Where the better of two changes, with interval: strategies, policies, or levels KEY=VALUE,VALUE.
        axis (KEY): Crossing: per, the mean loss rate, or a varied key with numbers.
        where (KEY=VALUE): Crossing: only under this condition.
        refine (N): Crossing: make N more pairs of runs where they narrow the interval.
        out (FILE): Also write the rows to this CSV file.
    """
    from missions.disk import SUMMARY

    names = tuple(dict.fromkeys(metrics or ()))
    if crossing is None and (axis != "per" or where or refine is not None):
        fail("--axis, --where and --refine: apply to --crossing A,B, which is missing")
    if other is not None or (folder / SUMMARY).is_file():
        if out is not None or baseline is not None or of_factors or crossing is not None:
            fail(f"{folder}: holds a single run; --baseline, --effects, --crossing and --out apply to sweeps")
        if other is None:
            _show_metrics(folder, names, as_json)
        else:
            _show_two_runs(folder, other, names, as_json)
        return
    if crossing is not None:
        if out is not None or baseline is not None or of_factors or len(names) > 1:
            fail(f"--crossing {crossing}: takes one --metric, and no --baseline, --effects or --out")
        metric = names[0] if names else "mission_time_s"
        _show_crossings(folder, (crossing, metric, axis, where or ()), refine, jobs, as_json)
        return
    from missions.comparison.baseline import compare as compared
    from missions.comparison.effects import effects_of
    from missions.sweeps.folder import SweepResults

    results = SweepResults.read(folder)
    _note_on_state(results)
    if of_factors:
        if baseline is not None:
            fail(f"--baseline {baseline}: effects compare the two levels of each factor; leave it out")
        of_levels = effects_of(results, names)
        _written(of_levels, out)
        show([asdict(row) for row in of_levels], as_json, _effect_lines(results, of_levels))
        return
    rows = compared(results, names, baseline)
    _written(rows, out)
    show([asdict(row) for row in rows], as_json, _comparison_lines(rows))


def _note_on_state(results: SweepResults) -> None:
    state = results.status()
    if state.failed or state.remaining > 0:
        counted = f"{state.planned - state.remaining} of {state.planned} runs have finished, only these are compared"
        failed = f"; {state.failed} failed and count as not completed" if state.failed else ""
        note(f"{counted}{failed}")


def _show_crossings(
    folder: Path, of: tuple[str, str, str, Sequence[str]], n_refined: int | None, jobs: int, as_json: bool
) -> None:
    from missions.comparison.crossing import crossings, refine
    from missions.sweeps.folder import SweepResults

    results = SweepResults.read(folder)
    _note_on_state(results)
    if n_refined is not None:
        with making(f"refine {folder}", folder) as progress:
            refine(results, n_refined, *of, jobs=jobs, progress=progress)
    rows = crossings(results, *of)
    show([asdict(row) for row in rows], as_json, _crossing_lines(rows))


def _crossing_lines(rows: Sequence[Crossing]) -> Iterator[str]:
    first = rows[0]
    yield f"Crossing along {first.axis} by the mean paired difference of {first.metric}; each line has 95 % confidence."
    yield "probability: of at least one crossing, high also where the two hardly differ"
    table = [("condition", "crossing [95 %]", "ahead", "pairs per level", "probability", "note")]
    for row in rows:
        where = " ".join(f"{key}={value}" for key, value in row.condition.items()) or "all"
        pairs = f"{row.n_least}" if row.n_least == row.n_most else f"{row.n_least} to {row.n_most}"
        share = "-" if row.probability is None else f"{row.probability:.2g}"
        table.append((where, _crossed(row), _leaders(row), pairs, share, row.note))
    yield from aligned(table)


def _leaders(row: Crossing) -> str:
    """Return who is ahead between the crossings, as in ``a below 0.3, b above``."""
    named = [f"{name} (not significant)" if name in row.unsure else name for name in row.leaders]
    if len(named) < 2:
        return f"{named[0]} throughout" if named else "none"
    levels = [f"{level:.3g}" for level in row.at]
    between = [f"from {low} to {high}" for low, high in itertools.pairwise(levels)]
    first, *others = named
    parts = [f"{name} {place}" for name, place in zip(others, [*between, "above"], strict=True)]
    return ", ".join([f"{first} below {levels[0]}", *parts])


def _crossed(row: Crossing) -> str:
    if row.probability is None and not row.at:
        return "-"
    low, high = f"{row.low:g}", f"{row.high:g}"
    parts = [
        f"{low + ' or less' if row.open_low and a == row.low else f'{a:.3g}'} to "
        f"{high + ' or more' if row.open_high and b == row.high else f'{b:.3g}'}"
        for a, b in row.ci95
    ]
    bounds = ", ".join(parts)
    if not row.at:
        return "no crossing seen" + (f"; not excluded: {bounds}" if bounds else "")
    found = ", ".join(f"{level:.3g}" for level in row.at)
    unique = " (not unique)" if len(row.at) > 1 else ""
    return f"{found}{unique}" + (f" [{bounds}]" if bounds else "")


def _show_two_runs(folder: Path, other: Path, names: Sequence[str], as_json: bool) -> None:
    from missions.errors import check_name
    from missions.runs.results import Results
    from missions.runs.two_runs import difference_of

    found = difference_of(Results.read(folder), Results.read(other))
    for name in names:
        check_name("--metric", name, found.metrics)
    wanted = {name: found.metrics[name] for name in names} or {
        name: values for name, values in found.metrics.items() if values[0] != values[1]
    }
    table = {**asdict(found), "metrics": wanted} if names else asdict(found)
    show(table, as_json, _difference_lines(found, wanted, bool(names)))


def _difference_lines(found: RunDifference, metrics: Mapping[str, tuple[Any, Any]], named: bool) -> Iterator[str]:
    ours, theirs = found.missions
    if ours != theirs:
        yield f"different missions, {ours} and {theirs}: common metrics and tables are compared"
    keys = [(key, _short(first), _short(other)) for key, (first, other) in found.keys.items()]
    yield from aligned([("key", "first", "second"), *keys]) if keys else ["the configurations and seeds are equal"]
    if metrics:
        rows = [(name, _short(a), _short(b), _less(a, b)) for name, (a, b) in metrics.items()]
        yield from ["", *aligned([("metric", "first", "second", "difference"), *rows], (1, 2, 3))]
    if not named:
        yield f"{len(found.metrics) - len(metrics)} of {len(found.metrics)} common metrics are equal"
    for run, names in (("first", found.only_first), ("second", found.only_other)):
        if names:
            yield f"tables of the {run} run only: {', '.join(names)}"
    if (event := found.event) is None:
        yield f"no event differs{', all bytes of the tables are equal' if found.same_bytes else ''}"
        return
    yield f"\nfirst event that differs: {event.time_s:g} s, table {event.table}"
    for run, row, opposite in (("first", event.first, event.other), ("second", event.other, event.first)):
        shown = {key: value for key, value in (row or {}).items() if opposite is None or value != opposite[key]}
        name = str((row or {}).get("vehicle", (row or {}).get("sender", "")))
        of = f"{name}: " if name else ""
        yield f"  {run:6}  {of}{', '.join(f'{k} {_short(v)}' for k, v in shown.items())}" if row else f"  {run:6}  none"
    yield f"  cause   {event.cause}"


def _short(value: Any) -> str:
    if isinstance(value, list):
        return " ".join(map(_short, value)) or "-"
    return f"{value:.6g}" if isinstance(value, float) else "-" if value is None else str(value)


def _less(first: Any, other: Any) -> str:
    numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in (first, other))
    return f"{other - first:+.6g}" if numbers else ""


def _written(rows: Sequence[Comparison] | Sequence[MainEffect], out: Path | None) -> None:
    from missions.comparison.baseline import csv_of
    from missions.disk import drafted
    from missions.errors import writing

    if out is not None:
        with writing(f"--out {out}"), drafted(out) as draft:
            draft.write_bytes(csv_of(rows))


def _show_metrics(folder: Path, metrics: Sequence[str], as_json: bool) -> None:
    from missions.runs.results import Results
    from remoras.api import Run

    if not metrics:
        fail(f"{folder}: holds a single run, with nothing to compare; name a metric with --metric")
    run = Run(Results.read(folder))
    values = {name: run.metric(name) for name in metrics}
    show(values, as_json, [f"{name}  {value}" for name, value in values.items()])


def _status_line(status: SweepStatus) -> str:
    counts = {"failed": status.failed, "not completed": status.censored, "with tables": status.with_tables}
    return "; ".join([status.progress, *(f"{count} {name}" for name, count in counts.items() if count)])


def _effect_lines(results: SweepResults, rows: Sequence[MainEffect]) -> Iterator[str]:
    from missions.comparison.table import interval, number

    yield results.file.two_level_design.description()
    for (metric, condition), same in itertools.groupby(rows, key=lambda row: (row.metric, row.condition)):
        own = list(same)
        yield f"{metric}, {condition}: mean {number(own[0].mean)}, n = {own[0].n}"
        width = max(len(row.term) for row in own)
        for row in own:
            levels = f"  {row.low} -> {row.high}" if row.is_main else ""
            aliases = f"  aliased with {row.aliases}" if row.aliases else ""
            note = f"  {row.note}" if row.note else ""
            yield f"  {row.term:<{width}}  {interval(row.effect, row.ci95_low, row.ci95_high)}{levels}{aliases}{note}"
        if own[0].n_missing:
            yield f"  {own[0].n_missing} runs that did not complete count with the full mission duration"


def _comparison_lines(rows: Sequence[Comparison]) -> Iterator[str]:
    from missions.comparison.table import NUMBERS, notes, table

    for metric, same in itertools.groupby(rows, key=lambda row: row.metric):
        own = list(same)
        heads, entries = table(own)
        right = [number for number, head in enumerate(heads) if head in NUMBERS]
        yield metric
        yield from (f"  {line}".rstrip() for line in aligned([heads, *entries], right))
        yield from (f"  {note}" for note in notes(own))
