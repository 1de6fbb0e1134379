"""Command that offers the channel to other programs, or describes it: sea."""

from __future__ import annotations

import ipaddress
import time
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from remoras.cli import completion
from remoras.cli.app import FigureFormat, Json, aligned, command, fail, figure_format, note, show
from remoras.cli.exchange import DEFAULT_RANGES, describe, is_network
from remoras.cli.nodes import Speed, addresses_in, check_speed
from remoras.cli.runs import Seed, Settings, set_keys
from remoras.process import instead

ALWAYS = "station", "sent", "received"
SHARED = "name", "settings", "out", "as_json", "no_plugins"
DESCRIPTION = "described", "modem", "ranges", "file_format"
"""Parameters of both uses of the command, and of the description alone."""
LONGEST_S = 604_800.0
"""Longest duration of a scenario, so of a recording: a week."""


@command("sea", "remoras sea mission-2012 --port 47000 --seed 3 --out recording")
def sea(
    context: typer.Context,
    name: Annotated[str, typer.Argument(autocompletion=completion.sea)] = "mapping-rendezvous",
    port: Annotated[int, typer.Option(min=0, max=65_535)] = 47_000,
    access: Literal["free", "slots"] = "free",
    stations: str = "",
    programs: str = "",
    positions: Path | None = None,
    bind: str = "127.0.0.1",
    token: Path | None = None,
    speed: Speed = 1.0,
    seed: Seed = 1,
    until: Annotated[float, typer.Option(min=0.0, max=LONGEST_S)] = LONGEST_S,
    described: Annotated[bool, typer.Option("--describe")] = False,
    modem: str | None = None,
    ranges: Annotated[
        str | None, typer.Option(metavar="METRES", help=f"Ranges described.  [default: {DEFAULT_RANGES}]")
    ] = None,
    settings: Settings = None,
    out: Path | None = None,
    file_format: FigureFormat = None,
    as_json: Json = False,
) -> None:
    """Serve the sea of a network or scenario to other programs, by UDP and the UnetStack API; record their packets.

    With --describe, show source, losses and unknowns of a measured network, or the share of packets that modems deliver
    over range on the channel acoustic.

    Args:
        name (NETWORK|SCENARIO): Measured network, or scenario with its channel and vehicles: a shipped name or a file.
            Or the --out of a killed service, to write its recording.

    Options:
        port (N): Port of the first station, N + 1 of the next; 0: any.
        access (free|slots): Stations send at once, or in their TDMA slots.
        stations (NAMES): Stations in a network; default: all nodes.
        programs (NAME=HOST:PORT,...): UDP addresses of programs that receive before they send.
        positions (FILE|DIR): Positions: CSV with time_s,vehicle,x_m,y_m, or the results of a run.
        bind (HOST): Local address; any other than loopback needs --token.
        token (FILE): 32, 48 or 64 hexadecimal digits that programs send first.
        until (T): End at T s, unless Ctrl-C comes first.
        described: Serve nothing: show losses of the network, or reach of modems.
        modem (NAMES): Modems described, comma-separated; default: the scenario's.
        out (DIR): Folder for the recording, or the figure.
    """
    for parameter in context.command.params:
        source = context.get_parameter_source(str(parameter.name))
        is_other = parameter.name not in SHARED and (parameter.name in DESCRIPTION) is not described
        if is_other and source is not None and source.name == "COMMANDLINE":
            fail(f"{parameter.opts[0]}: applies {'without' if described else 'with'} --describe only")
    if described:
        describe(name, modem, ranges, settings, out, figure_format(file_format, out), as_json)
        return
    from exchange.drivers.driver import Paced
    from missions.disk import check_output
    from missions.nodes.recording import ROWS, RowLog, of_network, of_scenario, restored, traces_in, written
    from missions.nodes.sea import Sea
    from missions.nodes.serving import Ports
    from missions.runs.setup import resolved

    if (Path(name) / ROWS).is_file():
        restored(Path(name))
        show({"restored": name}, as_json, [name])
        return
    secret = _token(bind, token)
    check_speed(speed)
    overrides = set_keys(settings)
    if is_network(name):
        scenario = of_network(name, access, [part for part in stations.split(",") if part], overrides)
    elif stations:
        fail(f"--stations: applies to networks; the stations of {name} are its vehicles")
    else:
        scenario = of_scenario(name, access, overrides)
    if out is not None:
        check_output(out, False)
    names = scenario.names_by_slot
    known = addresses_in(programs, "--programs", names)
    sea = Sea(resolved(scenario), seed, {} if positions is None else traces_in(positions, scenario))
    ports = Ports(sea, Paced(time.monotonic(), speed), (bind, port), known, secret)
    for station, number in ports.numbers.items():
        note(f"station {station} at {bind}:{number}, UDP and TCP")
    note("Ctrl-C ends it")
    logs = () if out is None else (RowLog(out, sea.setup, seed, sea.recorder).keep,)
    with instead(ports.stop):  # the usual end
        ports.run(until, *logs)
    end_s = sea.finish()
    ports.close()
    if out is not None:
        written(sea.setup, sea.seed, sea.recorder, out)
    rows: list[dict[str, Any]] = [{"station": station.data.name, **station.counts} for station in sea.stations]
    used = list(dict.fromkeys((*ALWAYS, *(key for row in rows for key, count in row.items() if count))))
    lines = aligned([used, *([str(row.get(key, 0)) for key in used] for row in rows)], right=range(1, len(used)))
    outcome = {"scenario": scenario.scenario.name, "time_s": end_s, "late_s": round(ports.late_s, 3), "stations": rows}
    show(outcome, as_json, [*lines, f"behind by at most {ports.late_s:.3f} s"])


def _token(host: str, file: Path | None) -> bytes:
    from exchange.errors import ConfigurationError
    from exchange.wire.sealing import key_in

    try:
        is_own = ipaddress.IPv4Address(host).is_loopback
    except ValueError:
        fail(f"--bind {host}: allowed is an IPv4 address of this machine, such as 127.0.0.1")
    if file is None:
        if not is_own:
            fail(f"--bind {host}: other machines can reach it; add --token FILE, of 32, 48 or 64 hexadecimal digits")
        return b""
    try:
        return key_in(file).hex().encode()
    except ConfigurationError as error:
        fail(f"--token {file}: {error}")
