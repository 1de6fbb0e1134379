"""The command about the acoustic channel: link-budget."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from missions.errors import LONGEST_VALUE, cut
from remoras.cli import completion
from remoras.cli.app import Format, Json, command, fail, show_json
from remoras.cli.runs import Settings
from remoras.cli.tables import on_terminal, show_table

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario
    from visualisation.reach import Reach

DEFAULT_RANGES = "250,500,1000,2000,3000,4000,5000,6000,8000,10000"
DRAWN = 200
"""Ranges at which the lines of the figure are computed."""
COLUMNS = ("modem", "range / m", "loss / dB", "SNR / dB", "Eb/N0 / dB", "delivered", "by frame")


def ranges_of(text: str) -> tuple[float, ...]:
    """Ranges of ``500,1000`` in metres.

    >>> ranges_of("500, 1e3")
    (500.0, 1000.0)
    """
    try:
        found = tuple(sorted(float(part) for part in text.split(",")))
    except ValueError:
        found = ()
    if not found or not all(0.0 < range_m <= 100_000.0 for range_m in found):  # a NaN is in no range
        fail(f"--ranges {cut(text, LONGEST_VALUE)!r}: allowed are metres such as 500,1000, above 0 and at most 100000")
    return found


@command("link-budget", "remoras link-budget --modem nanomodem-v3,whoi-fsk-0 --set channel.spreading=2")
def link_budget(
    name: Annotated[
        str, typer.Argument(metavar="SCENARIO", help="Whose sea and fleet.", autocompletion=completion.scenario)
    ] = "mapping-rendezvous",
    modem: Annotated[
        str | None, typer.Option(metavar="NAMES", help="Modem profiles, commas between; the scenario's if left out.")
    ] = None,
    ranges: Annotated[str, typer.Option(metavar="METRES", help="Ranges of the table.")] = DEFAULT_RANGES,
    settings: Settings = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for the figure, its caption and its CSV.")
    ] = None,
    file_format: Annotated[
        Format, typer.Option("--format", metavar="png|svg|pdf", help="File format of the figure.")
    ] = Format.PNG,
    as_json: Json = False,
) -> None:
    """Tell what of a modem's packets arrives against range, on the channel acoustic."""
    from missions.scenarios import load

    ranges_m = ranges_of(ranges)
    overrides = [("link-budget", "channel.name=acoustic"), *(("--set", setting) for setting in settings or ())]
    chosen = (
        [[]] if modem is None else [[("--modem", f"communication.modem={one.strip()}")] for one in modem.split(",")]
    )
    scenarios = [load(name, [*overrides, *more]) for more in chosen]
    reaches = [_reach(scenario, ranges_m) for scenario in scenarios]
    if out is not None:
        _draw(scenarios, ranges_m[-1], out, file_format.value, as_json)
    if as_json:
        show_json([{"modem": one.modem, **point._asdict()} for one in reaches for point in one.points])
    else:
        _print(reaches)


def _reach(scenario: Scenario, ranges_m: Sequence[float]) -> Reach:
    """The reach of a scenario's modem in its sea; the fleet's depths make the water, range is that of sound."""
    from exchange.acoustics.acoustic import AcousticChannel
    from missions.scenarios.deployment import deployment_of
    from visualisation.reach import Point, Reach

    channel, deployment = scenario.channel.settings(), deployment_of(scenario)
    assert isinstance(channel, AcousticChannel)
    modem, links, budget = deployment.modem, channel.links(deployment), channel.budget(deployment)
    points = tuple(
        Point(
            range_m,
            budget.loss_db(range_m),
            budget.snr_db(range_m),
            budget.ebn0_db(range_m),
            1.0 - links.loss_at(range_m, modem.payload_bits),
            links.delivered_at(range_m, modem.payload_bits),
        )
        for range_m in ranges_m
    )
    return Reach(modem.name, modem.range_m, math.ceil(modem.payload_bytes / modem.frame_bytes), points)


def _draw(scenarios: Sequence[Scenario], furthest_m: float, out: Path, file_format: str, as_json: bool) -> None:
    from visualisation import files
    from visualisation.reach import contents

    lines_m = [furthest_m * (number + 1) / DRAWN for number in range(DRAWN)]
    channel = scenarios[0].channel
    sea = (
        f"Spreading exponent {channel.spreading:g}, absorption {channel.absorption}, {channel.temperature_c:g} deg C, "
        f"salinity {channel.salinity_psu:g}, shipping {channel.shipping:g}, wind {channel.wind_mps:g} m/s, "
        f"fading: {channel.fading}."
    )
    drawn = contents([_reach(scenario, lines_m) for scenario in scenarios], sea, file_format)
    print(*files.write(out, drawn), sep="\n", file=sys.stderr if as_json else sys.stdout)


def _print(reaches: Sequence[Reach]) -> None:
    """A line for every modem and range."""
    rows = [
        (one.modem, f"{p.range_m:g}", f"{p.transmission_loss_db:.1f}", f"{p.snr_db:.1f}", f"{p.ebn0_db:.1f}",
         f"{p.delivered:.3f}", f"{p.frames_delivered:.3f}")
        for one in reaches for p in one.points
    ]  # fmt: skip
    if on_terminal():
        show_table(COLUMNS, rows, "full packets that arrive whole, and frame by frame", COLUMNS[1:])
        return
    for row in [COLUMNS, *rows]:
        print(f"{row[0]:<16}", *(f"{value:>10}" for value in row[1:]))
