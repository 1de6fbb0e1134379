"""Report of a study, finished or not: question, map, design, figure, table, statements, methods, limits, commands."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from missions import words
from missions.comparison.baseline import Comparison, compare
from missions.comparison.effects import MainEffect, effects_of
from missions.comparison.sentences import Statement, effect_statements, power, statements
from missions.comparison.table import NUMBERS, interval, notes, table
from missions.errors import OutputError, check_name
from missions.files import dotted, shown, text_of
from missions.metric import Metric
from missions.runs.results import Results
from missions.statistics import FEW, MANY, NoInterval
from missions.sweeps.folder import STUDY_TEXT, SweepResults
from visualisation import output
from visualisation.output import FACTORIAL_KINDS, DrawingError
from visualisation.page import DrawnPage
from visualisation.report.document import Commands, Items, Part, Picture, Report, Table
from visualisation.style import COLUMN_IN
from visualisation.sweeps import captions, sweep_pictures

MOST_FIGURES, MOST_STATEMENTS = 6, 40
CONSTANT = "per", "strategy", "policy", "unforeseen", "settings"  # columns of a table that its caption states if equal
FLEET = {
    "transit_speed_mps": ("transit (m/s)", 1.0),
    "survey_speed_mps": ("survey (m/s)", 1.0),
    "energy_j": ("energy (kJ)", 1e3),
    "hotel_w": ("hotel load (W)", 1.0),
}
"""Columns of the table of the fleet, with their units."""
NAMED_FILE = re.compile(r"""["' ]([\w-][\w.-]*\.(?:toml|py))(?=["':])""")
OPTION = "# --strategy "  # line of a stored study for a strategy added by option
COMMENT = re.compile(r"^#\s?")
RATE = "packet error rate"
HYPHEN = re.compile(r"(?<![\w.])-(?=[\d.])")  # minus sign of a number


def study_report(
    results: SweepResults, metric: str | None, map_of: Callable[[Results], DrawnPage]
) -> tuple[Report, list[str]]:
    """Return the report, and notes for the user on what it lacks.

    ``metric`` is a summary field, None for the first of the study; ``map_of`` draws the map of a run. Raises
    OutputError if no run has finished, or for an unknown metric.
    """
    name = metric or results.compared[0]
    check_name("--metric", name, results.metrics)
    measured, rows = results.metrics[name], compare(results, [name])
    if not rows:
        raise OutputError(f"{results.folder}: no run has a value of {name}")
    effects = effects_of(results, [name]) if results.file.factors else []
    stated = effect_statements(measured, effects) if effects else statements(measured, rows)
    lacking = list(_lacking(results, stated))
    figures, no_figure = _figures(results, name)
    limits = [*lacking, *no_figure, *_limits(results, rows, stated)]
    text = text_of(results.folder / STUDY_TEXT)
    sections: dict[str, Sequence[Part]] = {
        "Question": [_question(text, results, measured)],
        "Scenario": [*_map(results, map_of), *_fleets(results)],
        "Design": list(_design(results, measured, rows)),
        "Results": [*figures, _effects(effects, measured) if effects else _table(measured, rows)],
        "Statistical statements": _stated(stated, measured, rows, bool(effects)),
        "Methods": [" ".join(_methods(results, rows))],
        "Limits": [Items([_sentence(limit) for limit in limits])],
        "To repeat": [Commands(_commands(text, results.file.study.name, metric))],
    }
    design, version = results.file.study, results.schedule.version
    title = f"{design.name}: {words.within(measured.label)}"
    return Report(title, version, sections, output.of_sweep(results), _files(results, text)), lacking


def _files(results: SweepResults, text: str) -> dict[str, str]:
    """Return the study, with the files beside its scenarios that it and they name, by name."""
    files = {STUDY_TEXT: text}
    for folder in {Path(label.source).parent for label in results.schedule.labels if Path(label.source).is_file()}:
        named = NAMED_FILE.findall(text)
        while named:
            name = named.pop()
            if name not in files and (path := folder / name).is_file():
                files[name] = text_of(path)
                named += NAMED_FILE.findall(files[name])
    return files


def _fleets(results: SweepResults) -> Iterator[Part]:
    """Yield a table per scenario: vehicles with equal data share a row."""
    varied = {key.partition(".")[0] for label in results.schedule.labels for key, _ in label.settings}
    changed = "Factors of the study change some values." if varied & {"vehicle", "fleet", "communication"} else ""
    for number, tables in enumerate(list(results.scenarios.values())[:MOST_FIGURES], 1):
        alike: dict[tuple[str, ...], list[str]] = {}
        for vehicle in tables["vehicle"]:
            entries = [f"{vehicle[key] / scale:g}" if key in vehicle else "\u2013" for key, (_, scale) in FLEET.items()]
            equipment = [", ".join(f"{key} {shown(value)}" for key, value in sensor.items() if value is not None)
                         for sensor in vehicle.get("sensor", ())]  # fmt: skip
            alike.setdefault((*entries, "; ".join(equipment) or "none"), []).append(vehicle["name"])
        radio, name, n = tables["communication"], tables["scenario"]["name"], len(tables["vehicle"])
        caption = words.joined(
            f"Fleet of scenario {name}: {n} vehicle{'s' * (n > 1)}, modem {radio['modem']}, range "
            f"{radio['range_m']:g} m; missions end at {tables['scenario']['duration_s']:g} s at the latest.",
            changed,
        )
        heads = ["vehicles", *(head for head, _ in FLEET.values()), "sensors"]
        rows = [[", ".join(names), *entries] for entries, names in alike.items()]
        yield Table(f"fleet-{number}", caption, heads, rows, range(1, len(heads) - 1))


def _lacking(results: SweepResults, stated: Sequence[Statement]) -> Iterator[str]:
    status = results.status()
    if status.remaining:
        yield f"the study is not finished: {status.progress}"
    if not stated:
        yield "no two treatments share conditions and repeats, so the report has means and no comparison"


def _sentence(text: str) -> str:
    return f"{words.capital(text).rstrip('.')}."


def _question(text: str, results: SweepResults, metric: Metric) -> str:
    comment: list[str] = []
    for line in text.splitlines():
        if line.startswith(OPTION):
            continue
        if not line.startswith("#") or (not COMMENT.sub("", line).strip() and comment):
            break
        comment.append(COMMENT.sub("", line).strip())
    # A comment may only name the file.
    if found := " ".join(line for line in comment if line and not line.endswith(".toml")):
        return found
    factors = [f"{name} ({', '.join(levels)})" for name, levels in _factors(results).items() if len(levels) > 1]
    return f"What is the effect of {words.listed(factors or ['the seed'])} on {words.within(metric.label)}?"


def _factors(results: SweepResults) -> dict[str, list[str]]:
    """Return the levels of each factor of the study file, as texts."""
    file = results.file
    design, factors = file.study, dict[str, list[Any]]()
    scenarios = design.scenario
    factors["scenario"] = [scenarios] if isinstance(scenarios, str) else list(scenarios)
    for name, levels in (("strategy", design.strategies), ("policy", design.policies), ("vehicles", design.vehicles)):
        factors[name] = list(levels or ())
    for channel in file.channel:
        kind = channel.get("name", "")
        factors.setdefault("channel", []).append(kind)
        for key, value in dotted({key: value for key, value in channel.items() if key != "name"}):
            name = RATE if key == "per" else key
            factors[f"{name}, {kind}" if len(file.channel) > 1 else name] = (
                value if isinstance(value, list) else [value]
            )
    for tables in (file.grid, file.factors, file.latin):
        factors |= {key: value if isinstance(value, list) else [value] for key, value in dotted(tables)}
    for point in file.point:
        for key, value in dotted(point):
            factors.setdefault(key, [])
            factors[key] += [value] if value not in factors[key] else []
    factors["unforeseen"] = [case.name for case in file.unforeseen]
    factors |= {key: [value] for key, value in dotted(file.set)}
    shown = {name: [f"{level:g}" if isinstance(level, float) else str(level) for level in levels]
             for name, levels in factors.items()}  # fmt: skip
    return {name: list(dict.fromkeys(levels)) for name, levels in shown.items() if levels}


def _map(results: SweepResults, map_of: Callable[[Results], DrawnPage]) -> list[Part]:
    examples = enumerate(results.examples[:MOST_FIGURES], 1)
    maps: list[Part] = [Picture(f"map-{number}", map_of(results.kept(line))) for number, line in examples]
    return maps or ["No run has kept its tables, so there is no map."]


def _design(results: SweepResults, metric: Metric, rows: Sequence[Comparison]) -> Iterator[Part]:
    design, rule = results.file.study, results.file.stopping
    factors = _factors(results)
    yield Table(
        "design", f"Factors of the study {design.name}.", ["factor", "levels", "number"],
        [[name, ", ".join(levels), str(len(levels))] for name, levels in factors.items()], (2,),
    )  # fmt: skip
    n = words.from_to(row.n for row in rows if not row.deterministic) or "1"
    status = results.status()
    yield words.joined(
        f"The design has {len(results.schedule.labels)} configurations. Runs: {status.progress}; n = {n} "
        f"instance{'s' * (n != '1')} of each configuration.",
        f"The master seed is {design.seed}; the k-th instance of every configuration has the same seed, hence the same "
        "random draws.",
        "Configurations without random draws have one run, marked as deterministic."
        if any(row.deterministic for row in rows)
        else "",
        f"Repeats end when the 95 % interval of the mean of {rule.metric} is known to the half-width of the stopping "
        f"rule, {rule.minimum} to {rule.maximum} repeats."
        if rule
        else "",
        power(metric, rows),
    )


def _figures(results: SweepResults, metric: str) -> tuple[list[Part], list[str]]:
    kind = FACTORIAL_KINDS[0] if results.file.factors else metric
    try:
        drawn = list(sweep_pictures(results, kind, metric, COLUMN_IN).values())
        pages = [draw() for draw in drawn[:MOST_FIGURES]]
    except DrawingError as error:
        return [], [f"no figure: {error}"]
    name = _file_name(metric)
    parts: list[Part] = [Picture(f"{name}-{number}", page) for number, page in enumerate(pages, 1)]
    left = len(drawn) - len(pages)
    return parts, [f"{left} of {len(drawn)} figures are left out; `remoras plot` draws them"] if left else []


def _file_name(metric: str) -> str:
    return re.sub("[^A-Za-z0-9]+", "-", metric.removesuffix("_s"))


def _table(metric: Metric, rows: Sequence[Comparison]) -> Table:
    heads, entries = table(rows)
    columns = list(zip(*entries, strict=True))
    equal = [n for n, head in enumerate(heads) if head in CONSTANT and len(set(columns[n])) == 1]
    kept = [n for n in range(len(heads)) if n not in equal]
    same = [f"{heads[n]} {columns[n][0]}" for n in equal]
    sentences = [
        f"{words.capital(words.axis(metric.label, metric.unit))} of all configurations.",
        f"All rows: {', '.join(same)}." if same else "",
        f"Differences are to {rows[0].baseline} in the same instance; p by sign flips with step-down."
        if any(row.n_pairs for row in rows)
        else "",
        "Both completed: differences of the pairs in which both runs completed."
        if any("both completed" in head for head in heads)
        else "",
        *(_sentence(note) for note in notes(rows)),
    ]
    right = [place for place, n in enumerate(kept) if heads[n] in NUMBERS]
    shown = [[_typeset(entry[n]) for n in kept] for entry in entries]
    return Table(_file_name(metric.name), words.joined(*sentences), [heads[n] for n in kept], shown, right)


def _typeset(text: str) -> str:
    return "\u2013" if text == "-" else HYPHEN.sub("\u2212", text)


def _effects(rows: Sequence[MainEffect], metric: Metric) -> Table:
    entries = [
        [row.condition, row.term, f"{row.low} to {row.high}" if row.is_main else "interaction",
         interval(row.effect, row.ci95_low, row.ci95_high), str(row.n), row.aliases]
        for row in rows
    ]  # fmt: skip
    label = words.axis(words.within(metric.label), metric.unit)
    caption = f"Effects on {label}: mean at the second level minus mean at the first, paired by instance."
    heads = ["condition", "factor", "levels", "effect [95 %]", "n", "aliased with"]
    return Table("effects", caption, heads, entries, (4,))


def _stated(stated: Sequence[Statement], metric: Metric, rows: Sequence[Comparison], is_factorial: bool) -> list[Part]:
    if not stated:
        return ["There is no comparison to state: see Limits."]
    significant = [one for one in stated if one.significant]
    numbers = {
        "significant": len(significant),
        "not significant (p \u2265 0.05)": sum(one.significant is False for one in stated),
        "stated without a test": sum(one.significant is None for one in stated),
    }
    shown = words.listed([f"{words.are(number)} {what}" for what, number in numbers.items() if number])
    of = "effects on" if is_factorial else f"comparisons with {rows[0].baseline} in"
    count = f"Of {len(stated)} {of} {words.within(metric.label)}, {shown}."
    if len(stated) <= MOST_STATEMENTS:
        return [count, Items([one.text for one in stated])]
    listed = significant[:MOST_STATEMENTS]
    rest = f"The table has the {len(stated) - len(listed)} other comparisons."
    return [count, *([Items([one.text for one in listed])] if listed else []), rest]


def _methods(results: SweepResults, rows: Sequence[Comparison]) -> Iterator[str]:
    study = results.file.study
    software = _software(results.kept(results.examples[0])) if results.examples else ""
    yield f"Missions were simulated with remoras {results.schedule.version} [@remoras]{software}."
    yield (
        f"The study {study.name} ran {words.named_all('scenario', [row.scenario for row in rows])} with "
        f"{words.named_all('strategy', [row.strategy for row in rows], 'strategies')}, "
        f"{words.named_all('policy', [row.policy for row in rows], 'policies')} and "
        f"{words.named_all('channel', [row.channel for row in rows])}."
    )
    incomplete = [row for row in rows if row.is_incomplete]
    if incomplete:
        duration = words.from_to(label.duration_s for label in results.schedule.labels)
        yield f"A run that did not complete within {duration} s counts with this duration (restricted mean)."
        if any(row.ci95_low is not None for row in incomplete):
            yield (
                "Intervals of restricted means and of their differences allow for further runs that do not complete "
                "[@zou2008]."
            )
    if any(row.diff_to_baseline is not None for row in rows) and not results.file.factors:
        yield (
            f"Treatments were compared with {rows[0].baseline} by the mean of paired differences of equal instances; a "
            "positive difference means a greater value of the first-named treatment."
        )
        if any(row.diff_ci95_low is not None for row in rows):
            yield (
                "Intervals of differences hold all shifts that sign flips do not reject at 5 % [@hartigan1969] and are "
                "of single comparisons."
            )
        if any(row.p_holm is not None for row in rows):
            yield (
                "The p values are of sign-flip tests, corrected by step-down [@romano2005] over all pairs of "
                "treatments and all conditions of the study, in this metric and in the success rate."
            )
    if any(2 * (row.n_pairs_reached or 0) < row.n_pairs for row in rows if row.n_pairs_reached is not None):
        yield "Intervals of success rates are Wilson's [@wilson1927]."


def _software(run: Results) -> str:
    used = {"Python": run.manifest.get("python", ""), **run.manifest.get("libraries", {})}
    listed = [f"{name} {version}" for name, version in used.items() if version]
    return f", with {', '.join(listed)}" if listed else ""


def _limits(results: SweepResults, rows: Sequence[Comparison], stated: Sequence[Statement]) -> Iterator[str]:
    status = results.status()
    counts = {"did not complete their mission": status.censored, "failed": status.failed}
    if any(counts.values()):
        incomplete = " and ".join(f"{number} {what}" for what, number in counts.items() if number)
        yield f"of {len(results.lines)} runs, {incomplete}; they count as not completed"
    few = [row for row in rows if not row.deterministic and row.n < FEW]
    if few:
        yield f"fewer than {FEW} runs, hence no intervals: {len(few)} of {len(rows)} configurations"
    if any(row.ci95_note == NoInterval.RARE.value for row in rows):
        yield f"means of fewer than {MANY} runs have no interval"
    n_not, tested = (sum(one.significant in kinds for one in stated) for kinds in ((False,), (False, True)))
    if n_not:
        yield (
            f"of {tested} tested differences, {words.are(n_not)} not significant (p \u2265 0.05), which does not show "
            "that the treatments are equal"
        )
    alone = [row for row in rows if row.deterministic]
    if alone:
        yield f"of {len(rows)} configurations, {words.are(len(alone))} deterministic (n = 1)"
    yield from (f"assumed: {text}" for text in captions.assumptions(results, rows))
    if damaged := len(results.damaged):
        yield f"the tables of {damaged} of {len(results.lines)} runs are damaged or missing"
    yield "the statements hold for the simulated scenarios, channels and levels of this design"


def added(text: str) -> list[str]:
    """Return the strategies that an option added to a stored study."""
    return [line.removeprefix(OPTION).strip() for line in text.splitlines() if line.startswith(OPTION)]


def _commands(text: str, name: str, metric: str | None) -> list[str]:
    of_metric = "" if metric is None else f" --metric {metric}"
    return [
        f"remoras sweep {STUDY_TEXT} --out results/{name}{''.join(f' --strategy {name}' for name in added(text))}",
        f"remoras report results/{name} --out report{of_metric}",
    ]
