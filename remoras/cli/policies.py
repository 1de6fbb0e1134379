"""The command ``exchange-study``: exchange policies under packet loss, without a mission."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from missions.errors import LONGEST_VALUE, cut
from remoras.cli.app import Format, Json, command, fail, show_json
from remoras.cli.tables import on_terminal, show_table
from remoras.progress import Progress

if TYPE_CHECKING:
    from exchange.policies import AckPolicy
    from exchange.study.study import ExchangeStudy, StudyRow


TIMES = ("delivered", "source", "senders")
"""Kinds of figures, and names of their files, of a study that was asked for."""
OF_THE_PAPER = ("figure-3", "figure-4", "figure-5")
LOADED = "loaded"
"""Kind and name of the figure of the loaded case."""


def loss_rates(text: str) -> tuple[float, ...]:
    """Loss rates of ``0.1,0.5`` or ``0.05:0.8:0.05`` (first, last, step).

    >>> loss_rates("0.1:0.3:0.1"), loss_rates("0.5")
    ((0.1, 0.2, 0.3), (0.5,))
    """
    try:
        if ":" not in text:
            return tuple(float(part) for part in text.split(","))
        first, last, step = (float(part) for part in text.split(":"))
        if step <= 0.0 or last < first:
            raise ValueError
    except ValueError:
        given = cut(text, LONGEST_VALUE)
        fail(f"--per {given!r}: allowed are rates such as 0.1,0.5 or first:last:step such as 0.05:0.8:0.05")
    return tuple(round(first + number * step, 10) for number in range(int((last - first) / step + 1e-9) + 1))


def named(policies: Iterable[str]) -> list[str | AckPolicy]:
    """Policies from outside as values; shipped ones keep their names, and ``all`` stands for the six of the paper."""
    from exchange.policies import PAPER_POLICIES
    from missions.scenarios.policy import policy_of

    names = [name for part in policies for name in (PAPER_POLICIES if part == "all" else (part,))]
    return [policy_of(name) if ":" in name else name for name in names]


@command("exchange-study", "remoras exchange-study --nodes 8 --per 0.1,0.5 --trials 300")
def exchange_study(
    nodes: Annotated[
        int | None, typer.Option(metavar="N", help="Vehicles in the fleet, 2 to 64.  [default: 5]")
    ] = None,
    per: Annotated[
        str, typer.Option(metavar="RATES", help="Loss rates: 0.1,0.5 or first:last:step.")
    ] = "0.05:0.8:0.05",
    policies: Annotated[
        str,
        typer.Option(metavar="NAMES", help="Names or package.module:object, with commas; all: the paper's six."),
    ] = "all",
    trials: Annotated[int, typer.Option(metavar="N", help="Trials of each policy at each loss rate.")] = 2000,
    load: Annotated[
        str, typer.Option(metavar="LOAD", help="single, batch or poisson:RATE (items per node and slot).")
    ] = "single",
    items: Annotated[int, typer.Option(metavar="N", help="Items at every node, for load batch.")] = 1,
    item_bits: Annotated[int, typer.Option(metavar="BITS", help="Size of an item.")] = 60,
    capacity_bits: Annotated[
        int | None, typer.Option(metavar="BITS", help="Size of a packet, header charged; unlimited if left out.")
    ] = None,
    carrier_evidence: Annotated[bool, typer.Option(help="Take a node that sends an item as holding it.")] = False,
    bound: Annotated[bool, typer.Option("--bound", help="Add a bound: all know what all hold, for nothing.")] = False,
    seed: Annotated[int, typer.Option(metavar="N", help="Root of all random draws.")] = 1,
    jobs: Annotated[int, typer.Option(metavar="N", help="Cores to use; the numbers do not depend on it.")] = 1,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Folder for figures, captions and their CSV; without --nodes, those of the paper."
        ),
    ] = None,
    file_format: Annotated[
        Format, typer.Option("--format", metavar="png|svg|pdf", help="File format of figures.")
    ] = Format.PNG,
    force: Annotated[bool, typer.Option("--force", help="Replace what is already in --out.")] = False,
    as_json: Json = False,
) -> None:
    """Study the exchange policies: time to delivery and to acknowledgement against packet loss."""
    from exchange.study.study import ExchangeStudy, workload_named
    from missions.runs.folder import check_output

    study = ExchangeStudy(
        nodes=5 if nodes is None else nodes,
        per=loss_rates(per),
        policies=tuple(named(policies.split(","))),
        trials=trials,
        load=workload_named(load, items),
        item_bits=item_bits,
        capacity_bits=capacity_bits,
        carrier_evidence=carrier_evidence,
        seed=seed,
        bound=bound,
    )
    if out is not None:
        check_output(out, force)
    rows = _run([study], jobs)
    if out is not None:
        files = _files(study, rows, file_format.value, jobs, of_the_paper=nodes is None)
        _write(files, out)
        print(*(out / name for name, _ in files), sep="\n", file=sys.stderr if as_json else sys.stdout)
    if as_json:
        show_json([row.as_json() for row in rows])
    elif out is None:
        _print_study(rows)


def _run(studies: Sequence[ExchangeStudy], jobs: int) -> list[StudyRow]:
    from exchange.study.study import run

    rows: list[StudyRow] = []
    with Progress("exchange study", len(studies), "studies") as progress:
        for number, study in enumerate(studies):

            def at(done: int, total: int, number: int = number) -> None:
                progress.at(number + done / total)

            rows += run(study, jobs, at, lambda text: print(text, file=sys.stderr))
    return rows


def _files(
    study: ExchangeStudy, rows: Sequence[StudyRow], file_format: str, jobs: int, of_the_paper: bool
) -> list[tuple[str, bytes]]:
    """Figures 3 to 5 of the paper and the loaded case; or the three times of the study asked for."""
    from exchange.study.study import LoadKind, loaded_studies
    from visualisation.policies import as_csv, contents

    if study.load.kind is LoadKind.POISSON and len(study.per) == 1:
        return [(f"{LOADED}.csv", as_csv(rows))]
    if not of_the_paper or study.load.kind is LoadKind.POISSON:
        return [file for kind in TIMES for file in contents(rows, kind, kind, file_format)]
    ten = _run([replace(study, nodes=10)], jobs)
    loaded = _run(loaded_studies(seed=study.seed), jobs)
    of_figure = dict(zip(OF_THE_PAPER, (("source", rows), ("senders", rows), ("senders", ten)), strict=True))
    of_figure[LOADED] = (LOADED, loaded)
    return [file for name, (kind, shown) in of_figure.items() for file in contents(shown, kind, name, file_format)]


def _write(files: Sequence[tuple[str, bytes]], out: Path) -> None:
    """Write all the files of a study into a folder, or none; those of an older study go."""
    from missions.errors import OutputError
    from missions.runs.folder import FIGURES, new_content

    suffixes = (*FIGURES, ".txt")
    ours = {f"{name}{suffix}" for name in (*TIMES, *OF_THE_PAPER, LOADED) for suffix in suffixes}
    try:
        with new_content(out, of_older=ours.intersection, last=None) as draft:
            for name, content in files:
                (draft / name).write_bytes(content)
    except OSError as error:
        raise OutputError(f"--out {out}: cannot be written: {error.strerror}") from None


def _mean(estimate: Any) -> str:
    if estimate is None or estimate.ci95_high is None:
        return "-" if estimate is None else f"{estimate.mean:.2f}"
    return f"{estimate.mean:.2f} ± {estimate.ci95_high - estimate.mean:.2f}"


def _print_study(rows: Sequence[StudyRow]) -> None:
    """A line for every policy and loss rate: mean slots with the half-width of the 95 % interval."""
    if on_terminal():
        columns = ("per", "policy", "delivered", "source acked", "senders acked", "censored")
        table = [
            (
                f"{row.per:g}", row.policy, *map(_mean, (row.delivered_slots, row.source_acked_slots,
                row.senders_acked_slots)), str(row.censored_senders),
            )
            for row in rows
        ]  # fmt: skip
        show_table(columns, table, "TDMA slots, mean and half-width of the 95 % interval", (columns[0], *columns[2:]))
        return

    def shown(estimate: Any) -> str:
        if estimate is None:
            return f"{'-':>18}"
        if estimate.ci95_high is None:
            return f"{estimate.mean:>18.2f}"
        return f"{estimate.mean:>10.2f} +- {estimate.ci95_high - estimate.mean:<5.2f}"

    print(f"{'per':>5} {'policy':<16} {'delivered':>17} {'source acked':>18} {'senders acked':>18}  slots; censored")
    for row in rows:
        estimates = (row.delivered_slots, row.source_acked_slots, row.senders_acked_slots)
        print(f"{row.per:>5g} {row.policy:<16}", *map(shown, estimates), f"{row.censored_senders:>14}")
