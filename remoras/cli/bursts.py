"""The command about losses that come in bursts: bursts."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from missions.errors import LONGEST_VALUE, cut
from remoras.cli.app import FigureFolder, FigureFormat, Format, Json, command, fail, show_json

if TYPE_CHECKING:
    from exchange.acoustics.bursts import BurstModel, Fit, Recorded

COLUMNS = ("model", "log-likelihood", "parameters", "BIC", "over independent", "mean burst")
DIGITS = 4
"""Digits of the parameters of a table to paste."""


@command("bursts", "remoras bursts trial.csv --link AUV00,ASV00 --slot 1.2 --out bursts", names_code=False)
def bursts(
    trace: Annotated[Path, typer.Argument(metavar="TRACE", help="CSV or Parquet of time_s, sender, receiver, lost.")],
    link: Annotated[
        str | None, typer.Option(metavar="A,B", help="Packets of A that B heard or lost, alone; all links if left out.")
    ] = None,
    slot: Annotated[
        str | None,
        typer.Option(
            metavar="SECONDS", help="Slot of the scenario that the table is for; the trace's step if left out."
        ),
    ] = None,
    out: FigureFolder = None,
    file_format: FigureFormat = Format.PNG,
    as_json: Json = False,
) -> None:
    """Fit losses in bursts (Gilbert-Elliott) to a trace, and tell whether they are warranted."""
    from exchange.acoustics.bursts import NoBurstsError, best, fits, recorded
    from exchange.acoustics.models import LinkFileError
    from exchange.acoustics.trace import trace_of

    slot_s, ends = _seconds(slot), _ends(link)
    try:
        of = recorded(trace_of(str(trace)), ends)
        found = fits(of)
    except (LinkFileError, NoBurstsError) as error:
        fail(f"{cut(str(trace), LONGEST_VALUE)}: {error}")
    share = slot_s / of.step_s if slot_s else 1.0
    if out is not None:
        _draw(of, found, str(trace), out, file_format.value, as_json)
    if as_json:
        show_json(_as_json(of, found, share, str(trace)))
        return
    _print(of, found, str(trace))
    print(verdict(of, found))
    every = f"{slot_s:g} s" if slot_s else f"{of.step_s:.4g} s, a step of the trace; --slot SECONDS for a slot of yours"
    print("\n".join(channel_lines(best(found), share, every)))


def _seconds(text: str | None) -> float:
    """The length of a slot; 0 if none was said."""
    try:
        slot_s = float(text or "nan")
    except ValueError:
        slot_s = 0.0
    if text is not None and not 0.001 <= slot_s <= 100_000.0:  # a NaN is in no range
        fail(f"--slot {cut(text, LONGEST_VALUE)!r}: allowed are seconds, 0.001 to 100000")
    return 0.0 if text is None else slot_s


def _ends(text: str | None) -> tuple[str, str] | None:
    """Sender and receiver of a link."""
    if text is None:
        return None
    sender, comma, receiver = (part.strip() for part in text.partition(","))
    if not comma or not sender or not receiver:
        fail(f"--link {cut(text, LONGEST_VALUE)!r}: allowed are two names with a comma, such as AUV00,ASV00")
    return sender, receiver


def verdict(of: Recorded, found: list[Fit]) -> str:
    """Whether the trace has bursts, in one line."""
    from exchange.acoustics.bursts import INDEPENDENT, LINKS, WARRANTED, are_spells_long, best, do_links_differ

    chosen, independent = best(found), found[0]
    gain = independent.bic - chosen.bic
    if chosen.name == INDEPENDENT:
        return "no bursts: independent losses have the least BIC"
    strength = "very strong evidence" if gain >= WARRANTED else "weak evidence: record for longer"
    if chosen.name == LINKS or chosen.model is None:
        return f"no bursts, but links that differ: BIC {gain:.1f} below independent losses of one rate, {strength}"
    told = f"bursts: BIC of {chosen.name} {gain:.1f} below independent losses, {strength}"
    if are_spells_long(of, chosen.model):
        told += "; spells last a tenth of the trace or more: links or hours that differ look the same"
    if do_links_differ(of, chosen.model):
        told += "; links differ by more than bursts explain: fit each by --link"
    return told


def settings_of(fit: Fit, share: float) -> dict[str, Any]:
    """The table ``[channel]`` of a fit; a chain's by steps that are ``share`` as long as those of the trace."""
    from exchange.acoustics.bursts import INDEPENDENT, LINKS

    if fit.name == LINKS:
        links = [{"sender": a, "receiver": b, "per": _rounded(per)} for (a, b), per in fit.per_link.items()]
        return {"name": "matrix", "link": links}
    assert fit.model is not None
    if fit.name == INDEPENDENT:
        return {"name": "bernoulli", "per": _rounded(fit.model.loss_rate)}
    return {"name": "gilbert-elliott", **_pasted(fit.model.stepped(share))}


def _pasted(model: BurstModel) -> dict[str, float]:
    """Parameters as they are written: changes of state that make more than 1 by rounding would be refused."""
    numbers = {name: _rounded(number) for name, number in model._asdict().items()}
    if numbers["p_good_to_bad"] + numbers["p_bad_to_good"] > 1.0:
        numbers["p_bad_to_good"] = int(1e4 * (1.0 - numbers["p_good_to_bad"])) / 1e4
    return numbers


def _rounded(number: float) -> float:
    return float(f"{number:.{DIGITS}g}")


def channel_lines(fit: Fit, share: float, every: str) -> Iterator[str]:
    """The table ``[channel]`` as a scenario has it; ``every`` says how long its steps are."""
    from missions.files import toml_value

    settings = settings_of(fit, share)
    links = settings.pop("link", ())
    yield f"[channel]{f'    # a step is {every}' if settings['name'] == 'gilbert-elliott' else ''}"
    for key, value in settings.items():
        interval = fit.intervals.get(key) if share == 1.0 or key.startswith("per_") else None
        told = "" if interval is None else "    # 95 %: {:.3g} to {:.3g}".format(*interval)
        yield f"{key} = {toml_value(value)}{told}"
    for link in links:
        yield from ("[[channel.link]]", *(f"{key} = {toml_value(value)}" for key, value in link.items()))


def _print(of: Recorded, found: list[Fit], source: str) -> None:
    """What was counted, and a line for each model."""
    n, n_lost = len(of.lost), of.n_lost
    links = next(iter(of.per_link)) if len(of.per_link) == 1 else ()
    on = f"{links[0]} to {links[1]}" if links else f"{len(of.per_link)} links"
    step = f", one each {of.step_s:.4g} s (median)" if of.step_s else ""
    gaps = of.n_pieces - len(of.per_link)
    print(f"{source}: {on}, {n} packets, {n_lost} lost ({of.loss_rate:.3f}){step}, {gaps} long gaps")
    print(f"  {sum(map(len, of.runs(lost=True)))} bursts of {of.mean_burst:.2f} lost packets in the mean")
    rows = [
        (fit.name, f"{fit.log_likelihood:.1f}", str(fit.n_parameters), f"{fit.bic:.1f}",
         f"{fit.bic - found[0].bic:+.1f}", f"{fit.mean_burst:.2f}") for fit in found
    ]  # fmt: skip
    for row in [COLUMNS, *rows]:
        print(f"  {row[0]:<16}", *(f"{text:>16}" for text in row[1:]))


def _as_json(of: Recorded, found: list[Fit], share: float, source: str) -> dict[str, Any]:
    """All of it as data."""
    from exchange.acoustics.bursts import best

    links = [
        {"sender": sender, "receiver": receiver, "packets": n, "lost": n_lost}
        for (sender, receiver), (n, n_lost) in of.per_link.items()
    ]
    models = [
        {
            "name": fit.name,
            "parameters": fit.n_parameters,
            "log_likelihood": fit.log_likelihood,
            "bic": fit.bic,
            "mean_burst": fit.mean_burst,
            "per_step": None if fit.model is None or not fit.intervals else fit.model._asdict(),
            "intervals_95": fit.intervals,
            "channel": settings_of(fit, share),
        }
        for fit in found
    ]
    return {
        "file": source,
        "packets": len(of.lost),
        "lost": of.n_lost,
        "loss_rate": of.loss_rate,
        "mean_burst": of.mean_burst,
        "step_s": of.step_s,
        "slot_s": share * of.step_s,
        "pieces": of.n_pieces,
        "links": links,
        "models": models,
        "best": best(found).name,
        "verdict": verdict(of, found),
    }


def _draw(of: Recorded, found: list[Fit], source: str, out: Path, file_format: str, as_json: bool) -> None:
    """Write the figure of the lengths of runs."""
    from visualisation import output
    from visualisation.bursts import BurstsDrawn, FittedRuns, RunLengths, bursts_contents

    lost, received = (RunLengths(*of.runs(outcome)) for outcome in (True, False))
    n_lost, n_received = (max(map(max, filter(None, runs))) + 1 for runs in (lost, received))
    models = [
        FittedRuns(
            fit.name, fit.model.run_shares(True, n_lost).tolist(), fit.model.run_shares(False, n_received).tolist()
        )
        for fit in found
        if fit.model is not None
    ]
    drawn = BurstsDrawn(len(of.lost), len(of.per_link), lost, received, models)
    written = output.write_folder(out, bursts_contents(drawn, Path(source).name, file_format))
    print(*written, sep="\n", file=sys.stderr if as_json else sys.stdout)
