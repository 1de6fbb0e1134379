"""What a channel model may know of a scenario: the fleet that transmits; and where the file of a trace is."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol

from exchange.acoustics.models import Deployment
from exchange.acoustics.modems import modems
from exchange.acoustics.trace import TraceError, hash_of
from missions.scenarios.tables import Raw, entries, table_of


class _Vehicle(Protocol):
    @property
    def name(self) -> str: ...

    @property
    def slot(self) -> int: ...

    @property
    def depth_m(self) -> float: ...


class _Exchange(Protocol):
    @property
    def modem(self) -> str: ...

    @property
    def range_m(self) -> float: ...


class _Duration(Protocol):
    @property
    def duration_s(self) -> float: ...


class _Water(Protocol):
    @property
    def sound_speed_mps(self) -> float: ...


class _Channel(Protocol):
    def sound_speed_mps(self, deployment: Deployment) -> float | None: ...


class Deployed(Protocol):
    """What is asked of a scenario here; ``Scenario`` has it."""

    @property
    def scenario(self) -> _Duration:
        """The table ``[scenario]``."""

    @property
    def world(self) -> _Water:
        """The table ``[world]``."""

    @property
    def vehicle(self) -> Sequence[_Vehicle]:
        """The vehicles."""

    @property
    def communication(self) -> _Exchange:
        """The table ``[communication]``."""

    @property
    def channel(self) -> _Channel:
        """The table ``[channel]``."""


def deployment_of(scenario: Deployed) -> Deployment:
    """The fleet of a scenario, as channel models know it."""
    by_node = sorted(scenario.vehicle, key=lambda table: table.slot)
    return Deployment(
        nodes={table.name: table.slot for table in by_node},
        depths_m=tuple(table.depth_m for table in by_node),
        modem=modems()[scenario.communication.modem],
        range_m=scenario.communication.range_m,
        duration_s=scenario.scenario.duration_s,
    )


def scenario_sound_speed_mps(scenario: Deployed) -> float:
    """Speed of sound in a scenario: what its channel makes of the water, or that of its world."""
    speed_mps = scenario.channel.sound_speed_mps(deployment_of(scenario))
    return scenario.world.sound_speed_mps if speed_mps is None else speed_mps


def deployment_in(raw: Raw) -> Deployment | None:
    """The same of tables that are not checked yet; None where they are malformed, which is reported elsewhere."""
    communication, vehicles = table_of(raw, "communication"), entries(raw, "vehicle")
    modem = modems().get(str(communication.get("modem")))
    if not all(type(vehicle.get("slot")) is int for vehicle in vehicles):
        return None
    depths_m: dict[int, Any] = {vehicle["slot"]: vehicle.get("depth_m", 0.0) for vehicle in vehicles}
    numbers = [communication.get("range_m"), table_of(raw, "scenario").get("duration_s"), *depths_m.values()]
    nodes: dict[str, Any] = {str(vehicle.get("name")): vehicle.get("slot") for vehicle in vehicles}
    are_slots = sorted(depths_m) == list(range(len(vehicles)))
    if modem is None or not are_slots or len(nodes) < 2 or not all(map(_is_number, numbers)):
        return None
    range_m, duration_s = numbers[:2]
    by_node = dict(sorted(nodes.items(), key=lambda item: int(item[1])))
    return Deployment(by_node, tuple(depths_m[slot] for slot in range(len(vehicles))), modem, range_m, duration_s)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def with_trace_found(raw: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Tables in which the file of a trace has its whole path and its hash, so that results say which it was.

    Args:
        raw: tables of a scenario.
        folder: that the path of the trace's file starts from.
    """
    channel: Mapping[str, Any] = table_of(raw, "channel")
    file = channel.get("file")
    if channel.get("name") != "trace" or not isinstance(file, str) or not file:
        return raw
    path = str((folder / file).resolve())
    found = {"file": path, "sha256": channel.get("sha256")}
    with suppress(TraceError):  # a check says that it is not there
        found["sha256"] = found["sha256"] or hash_of(path)
    return {**raw, "channel": {**channel, **{key: value for key, value in found.items() if value}}}
