"""Commands for user strategies and other plug-ins: benchmark, check."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from missions.errors import check_name
from remoras.cli.app import FAILED, N_JOBS, Jobs, Json, aligned, command, fail, show
from remoras.cli.runs import strategies_option
from remoras.cli.sweeps import making

if TYPE_CHECKING:
    from missions.benchmark.card import ScoreTable
    from missions.benchmark.running import Scored
    from missions.benchmark.suite import Suite

CARD, TABLE, LATEX, CITATION, RUNS = "card.json", "table.md", "table.tex", "cite.bib", "runs"


@command("benchmark", "remoras benchmark fathom-2 --strategy mine.py:MINE --jobs 2 --out results/mine")
def benchmark(
    suite: str,
    strategies: Annotated[list[str] | None, strategies_option("Strategy to rank among the shipped ones")] = None,
    split: Literal["dev", "test"] = "dev",
    out: Path | None = None,
    jobs: Jobs = N_JOBS,
    repeats: Annotated[int | None, typer.Option(min=1)] = None,
    verified: Annotated[Path | None, typer.Option("--verify")] = None,
    drawn: Annotated[int | None, typer.Option("--runs", min=1)] = None,
    draw_seed: Annotated[int | None, typer.Option("--seed", min=0)] = None,
    as_json: Json = False,
) -> None:
    """Rank a strategy among the shipped ones on a suite of cases, with score and interval.

    Args:
        suite (SUITE): Shipped suite (fathom-2) or TOML file.

    Options:
        split (dev|test): Instances for development (dev), or those kept for the final score (test).
        out (DIR): Folder for runs, card and tables; the same folder resumes.
        repeats (N): Runs of each case; default and maximum: those of the suite.
        verified (CARD): Instead, repeat a random sample of the runs of a result card and compare.
        drawn (K): Number of runs that --verify repeats; default: a tenth, at least ten.
        draw_seed (N): Seed of the random sample of --verify; default: a new one.
    """
    from missions.benchmark.suite import suite_named

    chosen = suite_named(suite, split)
    if verified is not None:
        _verify(verified, chosen, drawn, draw_seed, as_json)
        return
    if out is None:
        fail("--out DIR is missing; it says where runs, card and tables go")
    if not strategies:
        fail("--strategy NAME is missing; allowed: a shipped name, mine.py:MINE or package.module:object")
    from missions.benchmark.card import ScoreTable, card_of, card_text
    from missions.benchmark.running import Contest
    from missions.disk import write_synced
    from missions.errors import StudyChangedError

    contest = Contest.of(chosen, strategies, repeats)
    # Before the runs, which may take hours.
    _conform(contest.strategies)
    try:
        with making(f"benchmark {chosen.about.name}", out) as progress:
            contest.make(out / RUNS, jobs, progress)
    except StudyChangedError as error:
        changed = str(error).splitlines()[1].strip()
        fail(f"--out {out}: holds other runs than these ({changed}); name another folder")
    scored = contest.scored(out / RUNS)
    card = card_of(contest, scored)
    table = ScoreTable(card, scored, _shipped_rows(chosen))
    for name, text in (
        (CARD, card_text(card)),
        (TABLE, table.markdown()),
        (LATEX, table.latex()),
        (CITATION, table.bibtex()),
    ):
        write_synced(out / name, text)
    without_runs = [{**entry, "runs": None} for entry in card["strategies"]]
    show({**card, "strategies": without_runs}, as_json, _score_lines(table))
    _tell_failures(scored, out)


def _conform(references: Sequence[str]) -> None:
    for reference in references:
        if ":" in reference:
            for passed in _checks("strategy", reference):
                print(f"ok  {passed}", file=sys.stderr, flush=True)


def _checks(kind: str, name: str) -> Sequence[str]:
    from remoras.errors import PluginError
    from remoras.testing import conforms

    try:
        return list(conforms(kind, name))
    except PluginError as error:
        fail(f"{kind} {name!r}: {error}")
    except AssertionError as error:
        fail(f"{kind} {name} does not conform: {str(error).splitlines()[0]}", FAILED)
    except ModuleNotFoundError as error:
        if error.name != "hypothesis":
            raise
        fail('the checks of a strategy need Hypothesis: pip install "remoras-sim[authors]"')


def _shipped_rows(suite: Suite) -> list[tuple[dict[str, object], Scored]]:
    from missions.benchmark.card import read_card, read_strategies
    from missions.benchmark.suite import DEV

    path = Path(suite.document.path).with_suffix(".json")
    if suite.split != DEV or not path.is_file():
        return []
    card = read_card(path, suite)
    return list(zip(card["strategies"], read_strategies(card), strict=True))


def _score_lines(table: ScoreTable) -> Iterator[str]:
    yield table.caption
    for rows in ([table.heads, *table.rows()], list(table.shapes())):
        yield from (*(f"  {line}" for line in aligned(rows)), "")


def _tell_failures(scored: Sequence[Scored], out: Path) -> None:
    from remoras.decision_timeout import MOST_CPU_S

    failed = {strategy.name: sum(run.failed for run in strategy.runs) for strategy in scored}
    texts = [f"{n} runs of {name} failed and count as not completed" for name, n in failed.items() if n]
    texts = [f"{'; '.join(texts)}: remoras sweep --out {out / RUNS} --status"] if texts else []
    for strategy in scored:
        if n := sum(run.silenced > 0 for run in strategy.runs):
            late = f"in {n} runs of {strategy.name} a decision took more than {MOST_CPU_S:g} s of CPU time"
            texts.append(f"{late}; its vehicle made no further decisions and sent nothing")
    if texts:
        fail("; ".join(texts), FAILED)


def _verify(path: Path, suite: Suite, count: int | None, seed: int | None, as_json: bool) -> None:
    from secrets import randbits

    from missions.benchmark.card import verify_card

    # The author of a card must not know which runs are repeated.
    check = verify_card(path, suite, randbits(32) if seed is None else seed, count)
    repeated = dict(check.runs)
    other = {name: text for name, text in repeated.items() if text}
    by_code: dict[tuple[str, str], list[str]] = {}
    for name, codes in check.other_code.items():
        by_code.setdefault(codes, []).append(name)
    lines = [
        f"{', '.join(names)}: made by code {theirs}, this is {ours}: compared by these runs only"
        for (theirs, ours), names in by_code.items()
    ]
    lines += [f"{len(repeated)} of {check.n_runs} runs repeated, sampled by --seed {check.seed}, {len(other)} differ"]
    lines += [f"{name}: {text}" for name, text in other.items()]
    report = {"verified": len(repeated), "of": check.n_runs, "seed": check.seed, "other_code": check.other_code}
    show({**report, "other": other}, as_json, lines)
    if other:
        raise typer.Exit(FAILED)


@command("check", "remoras check strategy mine.py:MINE")
def check(
    kind: str,
    name: str,
    as_json: Json = False,
) -> None:
    """Run all conformance checks of a plug-in.

    Args:
        kind (KIND): strategy, mission, policy, channel, sensor or fault.
        name (NAME): mine.py:MINE or a shipped name; to check a mission, a scenario that uses it.
    """
    from missions.scenarios.parts import stored
    from remoras.testing import KINDS

    check_name("kind", kind, KINDS)
    passed = _checks(kind, name if kind == "mission" else stored(kind, name))
    show({"passed": passed}, as_json, [f"ok  {text}" for text in passed])
