"""Command that measures published results again: reproduce."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any

import typer

from missions.errors import check_name
from remoras.cli.app import FAILED, Json, aligned, command, show, show_json

if TYPE_CHECKING:
    from remoras.cli.reproduction.entries import Entry, Outcome

QUICK = "quick"


@command("reproduce", "remoras reproduce remoras-times", names_code=False)
def reproduce(
    names: list[str] | None = None,
    listed: Annotated[bool, typer.Option("--list")] = False,
    write: bool = False,
    as_json: Json = False,
) -> None:
    """Measure published results again: expected beside measured, verdict, source.

    Args:
        names ([NAME]...): Entries, or pages such as docs/seas.md; default: all quick ones.

    Options:
        listed: List all entries with source, duration and command.
        write: Put measured figures into the pages of a checkout.
    """
    from remoras.cli.reproduction.entries import MISSING, ROOT, entries

    known = entries()
    chosen: list[Entry] = []
    pages = sorted({entry.page for entry in known.values()} - {""})
    for name in dict.fromkeys(names or ()):
        if name not in pages:
            check_name("entry", name, [*known, *pages])
        chosen += [entry for entry in known.values() if name in (entry.name, entry.page)]
    if listed:
        _list(chosen or list(known.values()), as_json)
        return
    skipped = [] if names else [entry for entry in known.values() if entry.duration != QUICK]
    report: list[dict[str, Any]] = []
    fails = False
    for entry in chosen or [entry for entry in known.values() if entry.duration == QUICK]:
        began_s, found = _cpu_s(), []
        if not as_json:
            print(f"{entry.name}: {entry.origin}", flush=True)
        for outcome in entry.outcomes():
            found.append(outcome)
            fails |= outcome.fails
            if write and entry.page and outcome.fails and outcome.measured != MISSING:
                page = ROOT / entry.page
                text = page.read_text(encoding="utf-8")
                page.write_text(text.replace(outcome.expected, outcome.measured), encoding="utf-8")
        if not as_json:
            print(*_lines(found), "", sep="\n", flush=True)
        rows, cpu_s = [outcome._asdict() for outcome in found], round(_cpu_s() - began_s, 2)
        about = {"name": entry.name, "source": entry.origin, "command": entry.recipe, "n": entry.n}
        report.append({**about, "verdict": _verdict(found), "cpu_s": cpu_s, "rows": rows})
    if as_json:
        from missions.sweeps.code import program, short

        show_json({"code": short(program()), "entries": report,
                   "skipped": {entry.name: entry.duration for entry in skipped}})  # fmt: skip
    else:
        _sum_up(report, skipped)
    if fails:
        raise typer.Exit(FAILED)


def _cpu_s() -> float:
    """CPU time (s) of this process and its finished runs."""
    return sum(os.times()[:4])


def _verdict(found: list[Outcome]) -> str:
    """The verdict of an entry: that of its rows, if they have one verdict; else it deviates."""
    from remoras.cli.reproduction.entries import DEVIATES

    verdicts = {outcome.verdict for outcome in found}
    return verdicts.pop() if len(verdicts) == 1 else DEVIATES


def _lines(found: list[Outcome]) -> Iterator[str]:
    for outcome in found:
        if not outcome.expected:
            yield f"  not measurable: {outcome.reason}"
            continue
        if outcome.expected == outcome.measured:
            yield f"  {outcome.verdict:<9} {outcome.quantity}: {outcome.expected}, as expected"
        elif len(outcome.expected) + len(outcome.measured) > 60:
            yield f"  {outcome.verdict:<9} {outcome.quantity}"
            yield from (f"            {label} {text}" for label, text in (
                ("expected", outcome.expected), ("measured", outcome.measured)
            ))  # fmt: skip
        else:
            yield f"  {outcome.verdict:<9} {outcome.quantity}: expected {outcome.expected}, measured {outcome.measured}"
        if outcome.reason:
            yield f"            because {outcome.reason}"


def _list(entries: list[Entry], as_json: bool) -> None:
    rows = [{"name": e.name, "source": e.origin, "duration": e.duration, "command": e.recipe} for e in entries]
    show(rows, as_json, aligned([(e.name, e.duration, e.origin, e.recipe) for e in entries]))


def _sum_up(report: list[dict[str, Any]], skipped: list[Entry]) -> None:
    from remoras.cli.reproduction.entries import AGREES, DEVIATES, UNMEASURED

    verdicts = [entry["verdict"] for entry in report]
    counts = {verdict: verdicts.count(verdict) for verdict in (AGREES, DEVIATES, UNMEASURED)}
    print(", ".join(f"{number} {verdict}" for verdict, number in counts.items() if number))
    if skipped:
        for duration, of in (("minutes", "up to ten minutes each"), ("hours", "more than ten minutes each")):
            names = [entry.name for entry in skipped if entry.duration == duration]
            print(f"skipped, {of}: {', '.join(names)}")
        print("run one with: remoras reproduce NAME")
