"""The command about which strategy to use: advise."""

from __future__ import annotations

import os
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from remoras.cli import completion
from remoras.cli.app import FigureFormat, Format, Json, command, fail, show_json
from remoras.cli.runs import Settings
from remoras.cli.sweeps import PARTLY_DONE
from remoras.progress import Progress

if TYPE_CHECKING:
    from missions.advising.advice import Advice, Adviser
    from missions.advising.experience import Experience
    from missions.advising.judging import AdviceScore

EXPERIENCE = "experience.json"


@command("advise", "remoras advise mapping-patches --set channel.per=0.6")
def advise(
    name: Annotated[
        str | None,
        typer.Argument(metavar="SCENARIO", help="Shipped scenario or TOML file.", autocompletion=completion.scenario),
    ] = None,
    settings: Settings = None,
    experience: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Experience that --make has made; else what is shipped.")
    ] = None,
    judge: Annotated[
        bool, typer.Option("--judge", help="Tell how good advice is on instances that it has not seen, instead.")
    ] = False,
    draw: Annotated[
        Path | None,
        typer.Option("--map", metavar="DIR", help="Draw where each strategy does well, with caption and CSV, instead."),
    ] = None,
    file_format: FigureFormat = Format.PNG,
    make: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Draw the instances and make all their runs instead; run again to go on."),
    ] = None,
    jobs: Annotated[int, typer.Option(min=1, max=1024, metavar="N", help="Processes for --make.")] = os.cpu_count()
    or 1,
    as_json: Json = False,
) -> None:
    """Tell which strategy a scenario asks for, by how much, and how sure that is; no mission is run."""
    if make is not None:
        _make(make, jobs, as_json)
        return
    from missions.advising.experience import SHIPPED, read_experience

    known = read_experience(SHIPPED if experience is None else experience)
    if judge:
        _judge(known, as_json)
        return
    if draw is not None:
        _draw(known, draw, file_format.value, as_json)
        return
    if name is None:
        fail("SCENARIO is missing; allowed: a shipped scenario, see `remoras list scenarios`, or a TOML file")
    from missions.advising.advice import Adviser
    from missions.runs.setup import resolved
    from missions.scenarios import load

    adviser = Adviser(known)
    found = adviser.advice(resolved(load(name, [("--set", setting) for setting in settings or ()])))
    if as_json:
        show_json(_as_json(found, adviser))
    else:
        _show(found, adviser)


def _make(folder: Path, jobs: int, as_json: bool) -> None:
    """Draw the instances, make their runs, and write what advice rests on."""
    from missions.advising.experience import experience_in
    from missions.advising.running import make
    from missions.disk import write_synced
    from missions.sweeps.driver import PartlyDoneError

    with Progress("advise", 1, "instances") as progress:
        try:
            make(folder, jobs, progress=progress.of)
        except PartlyDoneError as error:
            fail(f"{error}; finished runs are kept in {folder}, the same command goes on", PARTLY_DONE)
    found = experience_in(folder)
    write_synced(folder / EXPERIENCE, found.text())
    print(folder / EXPERIENCE, file=sys.stderr)
    _judge(found, as_json)


def _judge(experience: Experience, as_json: bool) -> None:
    """Tell how good advice by some experience is."""
    from missions.advising.judging import advice_score

    score = advice_score(experience)
    if as_json:
        show_json(asdict(score))
        return
    print("\n".join(_score_lines(score)))


def _draw(experience: Experience, folder: Path, file_format: str, as_json: bool) -> None:
    """Draw the instances in the plane of their traits, a map for each strategy."""
    from missions.advising.projection import projected
    from visualisation import output
    from visualisation.footprints import Footprints, InstancePoint, footprint_contents

    plane = projected(experience)
    placed = [
        InstancePoint(instance.number, x, y, tuple(well))
        for instance, (x, y), well in zip(
            experience.instances, plane.places.tolist(), plane.within.tolist(), strict=True
        )
    ]
    axes = [f"component {at + 1}: {', '.join(named)}" for at, named in enumerate(plane.named)]
    found = Footprints(experience.strategies, tuple(placed), (axes[0], axes[1]))
    caption = (
        f"{len(placed)} instances in the plane of the first two principal components of their traits, which have "
        f"{plane.shares[0]:.0%} and {plane.shares[1]:.0%} of the variance; axes name those that weigh most. Filled: "
        "the strategy takes at most 3 % longer than the best of the means over the runs of an instance."
    )
    written = output.write_folder(folder, footprint_contents(found, caption, file_format))
    print(*written, sep="\n", file=sys.stderr if as_json else sys.stdout)
    if as_json:
        show_json([str(path) for path in written])


def _score_lines(score: AdviceScore) -> list[str]:
    heads = ("chosen", "n", "within 3 % [95 %]", "by half", "longer than the best [95 %]", "saved [95 %]")
    tables = [score.rules, score.fresh] if score.fresh else [score.rules]
    rows = [
        (
            rule.name,
            str(rule.n),
            "-" if rule.within is None else f"{rule.within:.0%}{_bounds(rule.within_95)}",
            f"{rule.within_half:.0%}",
            f"{rule.longer:.1%}{_bounds(rule.longer_95, 1)}",
            f"{rule.saved:.1%}{_bounds(rule.saved_95, 1)}",
        )
        for rules in tables
        for rule in rules
    ]
    widths = [max(map(len, column)) for column in zip(heads, *rows, strict=True)]
    lines = ["  ".join(map(str.ljust, row, widths)).rstrip() for row in (heads, *rows)]
    first = 1 + len(score.rules)
    return [
        f"held out in turn, learned from the others of {score.n_learned} instances",
        *lines[:first],
        *(
            ["", "had no part in the choice of traits, learned from those that had", *lines[first:]]
            if score.fresh
            else []
        ),
        "",
        "by half: by each half of the runs, as who is best in the other half is judged; saved: beside the single best",
        f"it says of itself {score.stated:.0%} within 3 %; its intervals hold {score.covered:.0%} of what was run",
        f"strategies of which traits tell something, mean of the folds: {score.smooth:.1f}",
    ]


def _bounds(interval: tuple[float, float] | None, digits: int = 0) -> str:
    return "" if interval is None else f" [{interval[0]:.{digits}%}, {interval[1]:.{digits}%}]"


def _as_json(advice: Advice, adviser: Adviser) -> dict[str, object]:
    """Advice as data."""
    from missions.advising.traits import TRAITS

    experience = adviser.experience
    return {
        "strategy": advice.rows[0].strategy,
        "strategies": [asdict(row) for row in advice.rows],
        "traits": [
            {"name": trait.name, "value": value, "unit": trait.unit, "text": trait.text}
            for trait, value in zip(TRAITS, advice.traits, strict=True)
        ],
        "nearest": [
            {
                "number": near.instance.number,
                "distance": near.distance,
                "traits": dict(zip([trait.name for trait in TRAITS], near.instance.traits, strict=True)),
                "times_s": dict(zip(experience.strategies, near.instance.times_s, strict=True)),
            }
            for near in advice.nearest
        ],
        "outside": list(advice.outside),
        "told": [name for name, one in zip(experience.strategies, adviser.model.poolings, strict=True) if one.width],
        "instances": len(experience.instances),
        "version": experience.version,
    }


def _show(advice: Advice, adviser: Adviser) -> None:
    """Print advice as text."""
    from missions.advising.traits import TRAITS

    first, second = advice.rows[0], advice.rows[1]
    print(
        f"{first.strategy}: within 3 % of the best with probability {first.p_within:.2f}; "
        f"{second.strategy} is next and takes {second.longer:.1%} longer"
    )
    if advice.outside:
        print(f"outside of what was drawn, so take it for a guess: {'; '.join(advice.outside)}")
    print(f"\n  {'strategy':<18}{'longer':>8}  {'95 %':<18}within 3 %")
    for row in advice.rows:
        interval = "" if row is first else f"{row.low:+.1%} to {row.high:+.1%}"
        print(f"  {row.strategy:<18}{row.longer:>+8.1%}  {interval:<18}{row.p_within:>10.2f}")
    n = len(adviser.experience.instances)
    print(f"\nof {n} instances these are nearest, after this scenario:\n")
    shown = [at for at, trait in enumerate(TRAITS) if trait.decides]
    heads = ["instance", "distance", *(f"{TRAITS[at].name} / {TRAITS[at].unit}" for at in shown)]
    rows = [["", "", *(f"{advice.traits[at]:.3g}" for at in shown)]]
    rows += [
        [str(near.instance.number), f"{near.distance:.2f}", *(f"{near.instance.traits[at]:.3g}" for at in shown)]
        for near in advice.nearest
    ]
    for column in zip(heads, *rows, strict=True):
        width = max(map(len, heads))
        print(f"  {column[0]:<{width}}" + "".join(f"{text:>9}" for text in column[1:]))
