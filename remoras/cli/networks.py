"""The command about networks that were measured: network."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

import typer

from missions.errors import LONGEST_VALUE, cut
from remoras.cli import completion
from remoras.cli.app import FigureFolder, FigureFormat, Format, Json, command, fail, show_json

if TYPE_CHECKING:
    from exchange.acoustics.network import Network


@command("network", "remoras network mission-2012 --out seas")
def describe_network(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME", help="Shipped network, or a TOML or CSV file of one.", autocompletion=completion.network
        ),
    ],
    out: FigureFolder = None,
    file_format: FigureFormat = Format.PNG,
    as_json: Json = False,
) -> None:
    """Tell what was measured of a network: source, losses, what is not known; with --out draw map and losses."""
    found = network_named(name)
    if out is not None:
        from visualisation import output
        from visualisation.networks import network_contents

        written = output.write_folder(out, network_contents(found, file_format.value))
        print(*written, sep="\n", file=sys.stderr if as_json else sys.stdout)
    show_network(found, as_json)


def network_named(name: str) -> Network:
    """The network that a user names; ends the command if there is none."""
    from exchange.acoustics.models import LinkFileError
    from exchange.acoustics.network import network_of, shipped
    from worldmodel import suggestion

    try:
        return network_of(name)
    except LinkFileError as error:
        fail(f"network {cut(name, LONGEST_VALUE)!r}: {error}{suggestion(name, shipped())}")


def show_network(network: Network, as_json: bool) -> None:
    """Print what is known of a network."""
    if as_json:
        show_json({**network.model_dump(mode="json"), "assumed": network.assumption})
        return
    print(f"{network.name}: {network.title}".removesuffix(": "))
    for what, text in (("source", network.citation), ("packet", network.packet), ("assumed", network.assumption)):
        if text:
            print(f"  {what}: {text}")
    for text in network.unknown:
        print(f"  not known: {text}")
    for node in network.node:
        place = "" if node.position_m is None else " at {:g}, {:g} m".format(*node.position_m)
        depth = "" if node.depth_m is None else f", {node.depth_m:g} m deep"
        print(f"  node {node.name}{place}{depth}")
    rows = list(_rows(network))
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    for row in rows:
        print("  " + "  ".join(f"{text:>{width}}" for text, width in zip(row, widths, strict=True)))


def _rows(network: Network) -> Iterator[list[str]]:
    """The losses as a table, its heading first."""
    if network.per_over_range:
        yield ["range (m)", "lost"]
        yield from ([f"{range_m:g}", f"{per:.3f}"] for range_m, per in network.per_over_range)
        return
    names = network.nodes
    yield ["lost: row sends, column hears", *names]
    for sender in names:
        yield [sender, *("-" if sender == other else f"{network.per[sender, other]:.3f}" for other in names)]
