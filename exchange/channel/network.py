"""Channel ``network``: losses measured at sea, per directed link or over range.

A network is a table of a TOML file:

    [[network]]
    name = "harbour"
    title = "two nodes in a harbour"                # only name and losses are compulsory
    citation = "author and publication of the measurement"
    packet = "type of the packets counted"
    unknown = ["unknown property"]

    [[network.node]]                                # two or more nodes, each with
    name = "quay"
    position_m = [0.0, 0.0]                         # x east, y north
    depth_m = 3.0
    per = { buoy = 0.2 }                            # share of its packets lost at each other node

or in place of nodes

    per_over_range = [[100.0, 0.05], [400.0, 0.6]]  # range in metres, share lost

One of several networks in a file is given as ``seas.toml:harbour``. A CSV file with the columns sender, receiver and
per is a network with losses only. Links between nodes are static; losses over range follow the vehicles.
"""

from __future__ import annotations

import csv
import io
import json
import math
import tomllib
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from itertools import pairwise, permutations
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, WithJsonSchema

from exchange.channel import loss
from exchange.channel.link import LinkModel, Matrix, Transmission
from exchange.channel.models import (
    ChannelModel,
    Deployment,
    LinkFileError,
    LinkFileGoneError,
    SettingFault,
    hash_of,
    number_in,
)
from exchange.channel.modems import Probability

KINDS = "a TOML or CSV file"
COLUMNS = ("sender", "receiver", "per")
FARTHEST_M, DEEPEST_M = 100_000.0, 11_000.0
"""Maximum coordinates (m, east and north) and depth (m) of a node."""
MOST_NODES = 100

Metres = Annotated[float, Field(ge=-FARTHEST_M, le=FARTHEST_M)]


NodeName = Annotated[
    str,
    BeforeValidator(lambda value: str(value) if type(value) is int else value),
    WithJsonSchema({"type": ["string", "integer"]}, mode="validation"),
]


class NetworkFileError(LinkFileError):
    """Invalid network file; ``faults`` has all faults."""

    def __init__(self, faults: Sequence[SettingFault]) -> None:
        first = faults[0]
        super().__init__(f"{first.file}: {first.key}{f' = {first.given}' if first.given else ''}: {first.allowed}")
        self.faults = tuple(faults)


class NetworkNode(BaseModel):
    """Node, with the losses of its packets at the others."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    name: str = Field(min_length=1, max_length=40)
    position_m: tuple[Metres, Metres] | None = None
    depth_m: float | None = Field(None, ge=0.0, le=DEEPEST_M)
    per: dict[str, Probability] = {}


class Network(BaseModel):
    """Measured losses of links between nodes or over range, with their origin."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    name: str = Field(pattern=r"^[^/\\\x00-\x1f\x7f]{1,40}$")
    title: str = ""
    citation: str = ""
    packet: str = ""
    unknown: tuple[str, ...] = ()
    node: tuple[NetworkNode, ...] = Field((), max_length=MOST_NODES)
    per_over_range: tuple[tuple[Annotated[float, Field(ge=0.0, le=FARTHEST_M)], Probability], ...] = ()

    @property
    def assumption(self) -> str:
        """Assumption about vehicles with these losses."""
        return "losses over range as measured" if self.per_over_range else "static links on moving vehicles"

    @property
    def nodes(self) -> list[str]:
        """Names of the nodes; empty for losses over range."""
        return [node.name for node in self.node]

    @cached_property  # of all links, asked for each
    def per(self) -> dict[tuple[str, str], float]:
        """Share lost of each directed link, by (sender, receiver)."""
        return {(node.name, other): per for node in self.node for other, per in node.per.items()}

    def faults(self) -> Iterator[tuple[str, str, str]]:
        """Yield (key, value, allowed) of faults between individually valid values."""
        if bool(self.node) == bool(self.per_over_range):
            yield "node", "", "nodes with a per each, or else per_over_range, has to be given"
            return
        ranges_m = [range_m for range_m, _ in self.per_over_range]
        if self.per_over_range and (len(ranges_m) < 2 or not all(near < far for near, far in pairwise(ranges_m))):
            yield "per_over_range", str(ranges_m), "two ranges at least, each longer than the one before"
        twice = {name for name, count in Counter(self.nodes).items() if count > 1}
        for name in sorted(twice):
            yield f"node.{name}", "", "is there twice; each node has a name of its own"
        if len(self.node) == 1:
            yield f"node.{self.nodes[0]}", "", "is alone; a network has two nodes at least"
        for node in self.node:
            others = [name for name in self.nodes if name != node.name]
            for other in node.per:
                if other == node.name:
                    yield f"node.{node.name}.per.{other}", "", "is no link: a node does not send to itself"
                elif other not in others:
                    yield f"node.{node.name}.per.{other}", "", f"is no node; allowed: {', '.join(others)}"
            if missing := [other for other in others if other not in node.per]:
                allowed = f"the link from {node.name} to {' and to '.join(missing)} is missing: a number from 0 to 1"
                yield f"node.{node.name}.per", "", allowed


class NetworkFile(BaseModel):
    """Content of a network file in TOML."""

    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)

    network: tuple[Network, ...] = ()


@dataclass(frozen=True, slots=True)
class OverRange:
    """Losses over range: linear between measured ranges, constant beyond them.

    >>> OverRange((100.0, 300.0), (0.0, 0.5)).at(200.0)
    0.25
    """

    ranges_m: tuple[float, ...]
    per: tuple[float, ...]

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """Return the loss at the range, for any link."""
        return self.at(range_m)

    def at(self, range_m: float) -> float:
        """Return the share lost at a range."""
        after = bisect_right(self.ranges_m, range_m)
        if after in (0, len(self.ranges_m)):
            return self.per[min(after, len(self.per) - 1)]
        near_m, far_m = self.ranges_m[after - 1 : after + 1]
        near, far = self.per[after - 1 : after + 1]
        return near + (far - near) * ((range_m - near_m) / (far_m - near_m))

    def mean(self, range_m: float) -> float:
        """Return the mean over ranges from 0 to ``range_m``."""
        knots_m = [0.0, *(knot_m for knot_m in self.ranges_m if 0.0 < knot_m < range_m), range_m]
        sums = (0.5 * (self.at(near) + self.at(far)) * (far - near) for near, far in pairwise(knots_m))
        return math.fsum(sums) / range_m


class NetworkChannel(ChannelModel):
    """Losses of a measured network."""

    title = "losses as measured at sea, of the links of a network (static, while vehicles move) or over range"

    network: str = Field(
        "mission-2012",
        description="network: one of `remoras list networks`; or a file, TOML with [[network]] or CSV of the columns "
        "sender, receiver, per. Links are static on moving vehicles",
    )
    nodes: dict[str, NodeName] = Field(
        {}, description="network: node of a vehicle, by its name; nodes of others are drawn by the seed"
    )
    sha256: str = Field("", description="network: hash of the file, recorded in results")

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Return links between the nodes of the vehicles, or over range."""
        network = network_of(self.network, self.sha256)
        if network.per_over_range:
            return OverRange(*zip(*network.per_over_range, strict=True))
        node_of = self.drawn(network, deployment, seed)
        return Matrix(0.0, {(a, b): network.per[node_of[a], node_of[b]] for a, b in permutations(node_of, 2)})

    def drawn(self, network: Network, deployment: Deployment, seed: int) -> dict[int, str]:
        """Return the network node of each vehicle, by vehicle number; those not in ``nodes`` are drawn by the seed."""
        fixed = {deployment.nodes[vehicle]: node for vehicle, node in self.nodes.items()}
        # One number per node, in the order of names: the order in the file has no effect.
        numbers = {
            name: loss.uniform(seed, loss.NODES, 0, place, 0) for place, name in enumerate(sorted(network.nodes))
        }
        # Fixing the node of one vehicle keeps the order in which the others get theirs.
        left = sorted(self._left(network), key=lambda name: numbers[name])
        return {number: fixed[number] if number in fixed else left.pop(0) for number in range(len(deployment.nodes))}

    def _left(self, network: Network) -> list[str]:
        return [name for name in network.nodes if name not in self.nodes.values()]

    def mean_per(self, deployment: Deployment) -> float:
        """Return the mean over links and draws of nodes, or over ranges up to the declared one."""
        network = network_of(self.network, self.sha256)
        if network.per_over_range:
            return OverRange(*zip(*network.per_over_range, strict=True)).mean(deployment.range_m)
        left = self._left(network)
        may_be = [[self.nodes[vehicle]] if vehicle in self.nodes else left for vehicle in deployment.nodes]
        means = []
        # Every pair of different free nodes is equally likely, so this is the mean over all draws.
        for senders, receivers in permutations(may_be, 2):
            rates = [network.per[a, b] for a in senders for b in receivers if a != b]
            means.append(math.fsum(rates) / len(rates))
        return math.fsum(means) / len(means)

    def assumed(self, deployment: Deployment | None = None, seed: int = 0) -> str:
        """Return the network name, its assumption and, for one run, the node of each vehicle."""
        network = network_of(self.network, self.sha256)
        text = f"{network.name}: {network.assumption}"
        if deployment is None or not network.node:
            return text
        node_of = self.drawn(network, deployment, seed)
        return ", ".join([text, *(f"{name} = {node_of[number]}" for name, number in deployment.nodes.items())])

    def misfits(self, deployment: Deployment) -> Iterator[SettingFault]:
        """Yield faults of an unknown, invalid or too small network, or unknown nodes and vehicles."""
        try:
            network = network_of(self.network, self.sha256)
        except NetworkFileError as error:
            yield from error.faults
        except LinkFileGoneError as error:
            # With a hash, the settings are of results: these stay readable without the file, only a new run fails.
            if not self.sha256:
                yield SettingFault("network", f'"{self.network}"', str(error), tuple(shipped()))
        else:
            yield from self._misfits(network, deployment)

    def _misfits(self, network: Network, deployment: Deployment) -> Iterator[SettingFault]:
        fleet, nodes = tuple(deployment.nodes), tuple(network.nodes)
        if nodes and len(nodes) < len(fleet):
            allowed = f"has {len(nodes)} nodes, the fleet {len(fleet)} vehicles: as many nodes at least are needed"
            yield SettingFault("network", f'"{self.network}"', allowed)
        counts = Counter(self.nodes.values())
        for vehicle, node in self.nodes.items():
            if vehicle not in fleet:
                allowed = f"{vehicle} is no vehicle; allowed: {', '.join(fleet)}"
                yield SettingFault(f"nodes.{vehicle}", f'"{node}"', allowed)
            elif not nodes:
                allowed = f"{network.name} has losses over range and no nodes: leave nodes out"
                yield SettingFault(f"nodes.{vehicle}", f'"{node}"', allowed)
            elif node not in nodes:
                yield SettingFault(f"nodes.{vehicle}", f'"{node}"', f"allowed: {', '.join(nodes)}", nodes)
            elif counts[node] > 1:
                yield SettingFault(f"nodes.{vehicle}", f'"{node}"', "is the node of two vehicles; each has its own")


@cache  # parses the files, asked for each network
def shipped() -> dict[str, Network]:
    """Return the shipped networks by name."""
    files = sorted(Path(__file__).with_name("networks").glob("*.toml"))
    return {network.name: network for file in files for network in _of_toml(file.read_text("utf-8"), file.name)}


def file_in(setting: str) -> str:
    """Return the file of a setting without the network name; empty for a shipped network.

    >>> file_in("seas.toml:harbour"), file_in("links.csv"), file_in("mission-2012")
    ('seas.toml', 'links.csv', '')
    """
    stem, toml, _ = setting.partition(".toml:")
    file = stem + ".toml" if toml else setting
    return file if file.endswith((".toml", ".csv")) else ""


def network_of(setting: str, sha256: str = "") -> Network:
    """Return a shipped network, or that of a file, such as ``seas.toml:harbour``, with the hash ``sha256`` if given.

    Raises LinkFileGoneError for an unknown network, missing file or other hash, NetworkFileError for invalid content.
    """
    if not (file := file_in(setting)):
        if setting in shipped():
            return shipped()[setting]
        raise LinkFileGoneError(f"is no network; allowed: {', '.join(shipped())}, or {KINDS}")
    name = setting.removeprefix(file).removeprefix(":")
    networks = _read(file, hash_of(file, KINDS, sha256))
    if not name and len(networks) == 1:
        return networks[0]
    if name in (names := [network.name for network in networks]):
        return networks[names.index(name)]
    allowed = f"which of {', '.join(names)} is meant stands behind the file, as {Path(file).name}:{names[0]}"
    raise NetworkFileError([SettingFault("network", f'"{name}"' if name else "", allowed, tuple(names), file)])


@lru_cache(maxsize=16)  # a file, read by each check and run
def _read(file: str, sha256: str) -> list[Network]:
    content = Path(file).read_bytes()
    try:
        text = content.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise NetworkFileError([SettingFault("file", "", "is not UTF-8; save it as that", (), file, line)]) from None
    return _of_csv(text, file) if file.endswith(".csv") else _of_toml(text, file)


def _of_toml(text: str, file: str) -> list[Network]:
    try:
        tables = tomllib.loads(text)
    except (RecursionError, ValueError) as error:  # the base of TOMLDecodeError
        raise NetworkFileError([SettingFault("TOML", "", str(error), file=file)]) from None
    return _checked(tables, file)


def _checked(tables: dict[str, Any], file: str) -> list[Network]:
    try:
        networks = NetworkFile.model_validate_json(json.dumps(tables, default=str), strict=True).network
    except ValidationError as error:
        raise NetworkFileError([_of_detail(detail, tables, file) for detail in error.errors()]) from None
    faults = [
        SettingFault(f"network.{network.name}.{key}", value, allowed, file=file)
        for network in networks
        for key, value, allowed in network.faults()
    ]
    if not networks:
        faults.append(
            SettingFault("network", "", "missing: a file of networks has one [[network]] at least", file=file)
        )
    for name in [name for name, count in Counter(network.name for network in networks).items() if count > 1]:
        faults.append(SettingFault(f"network.{name}", "", "is there twice; each network has its own name", file=file))
    if faults:
        raise NetworkFileError(faults)
    return list(networks)


def _of_detail(detail: Mapping[str, Any], tables: Any, file: str) -> SettingFault:
    parts: list[str] = []
    for part in detail["loc"]:
        is_entry = isinstance(part, int)
        tables = tables[part] if is_entry else tables.get(part) if isinstance(tables, dict) else None
        name = tables.get("name") if is_entry and isinstance(tables, dict) else None
        parts.append(name if isinstance(name, str) else str(part + 1 if is_entry else part))
    key, value = ".".join(parts), json.dumps(detail["input"], default=str)
    if detail["type"] == "missing":
        return SettingFault(key, "", "missing", file=file)
    if detail["type"] == "extra_forbidden":
        n_entries = sum(isinstance(part, int) for part in detail["loc"])
        known = tuple((NetworkFile, Network, NetworkNode)[n_entries].model_fields)
        return SettingFault(key, value, f"unknown key, allowed here: {', '.join(known)}", known, file)
    if detail["type"] == "string_pattern_mismatch":  # the only pattern: network names, used in file names
        return SettingFault(
            key, value, "allowed: 1 to 40 characters, none of them / \\ or a control character", file=file
        )
    message = str(detail["msg"]).replace("tuple", "list").replace("Tuple", "list")
    return SettingFault(key, value, message[0].lower() + message[1:], file=file)


def _of_csv(text: str, file: str) -> list[Network]:

    def refused(line: int, key: str, value: str, allowed: str) -> NetworkFileError:
        return NetworkFileError([SettingFault(key, json.dumps(value) if value else "", allowed, (), file, line)])

    reader = csv.DictReader(io.StringIO(text), skipinitialspace=True, strict=True)
    lost: dict[str, dict[str, float]] = {}
    try:
        columns = [str(name).strip() for name in reader.fieldnames or ()]
        reader.fieldnames = columns
        if missing := [name for name in COLUMNS if name not in columns]:
            raise refused(
                1, "columns", ",".join(columns), f"{', '.join(missing)} is missing; needed: {','.join(COLUMNS)}"
            )
        for row in reader:
            sender, receiver, share = (str(row[name] or "").strip() for name in COLUMNS)
            per, line = number_in(share), reader.line_num
            if not sender or not receiver or sender == receiver:
                raise refused(line, "receiver", receiver, f"{sender!r} to {receiver!r} is no link of two nodes")
            if not 0.0 <= per <= 1.0:
                raise refused(line, "per", share, f"of {sender} to {receiver}: a number from 0 to 1")
            if receiver in lost.setdefault(sender, {}):
                raise refused(line, "receiver", receiver, f"a second row of {sender} to {receiver}")
            lost[sender][receiver] = per
            # A node that only receives is a node, too; its missing links are then reported.
            lost.setdefault(receiver, {})
    except csv.Error as error:
        raise refused(reader.line_num + 1, "CSV", "", str(error)) from None
    nodes = [{"name": name, "per": per} for name, per in lost.items()]
    return _checked({"network": [{"name": Path(file).stem[:40], "node": nodes}]}, file)
