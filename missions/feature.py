"""Optional scenario features, one file each in ``missions/features``; runs contain only the features in use."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pydantic import Field

from missions.errors import ConfigurationFault

if TYPE_CHECKING:
    from pathlib import Path

    from exchange.schedule import TdmaSchedule
    from missions.metric import Metric
    from missions.scenarios.scenario import Scenario
    from remoras.database import AUVDatabase, VehicleData
    from remoras.events import Observer
    from remoras.mission import Mission
    from remoras.recorder import Recorder
    from remoras.strategy import Strategy
    from worldmodel import Instance, TBox


@dataclass(frozen=True)
class Joining:
    """Data of a run for a feature; ``packet_s`` is the duration (s) of a packet of so many bits."""

    scenario: Scenario
    tbox: TBox
    instances: Sequence[Instance]
    database: AUVDatabase
    schedule: TdmaSchedule
    packet_s: Callable[[int], float]
    recorder: Recorder
    seed: int
    is_alone: bool = False


@dataclass(frozen=True)
class Feature:
    """A feature; all attributes except ``keys`` apply only to scenarios with one of its keys.

    Attributes:
        keys: type and field of each key, by table: "" is the scenario itself. Keys with their default are not written,
            unless the default is on.
        checks: called with well-formed tables and the mission class; yields faults between tables.
        words: Turtle files of the vocabulary, loaded only if used.
        states: attributes sent to all vehicles at the highest urgency.
        last_metrics: follow those of every run in the summary; all metrics are not applicable without the feature.
        needed: attributes that some vehicle needs, which are exchanged for it.
        apart_s: greatest clock difference that the slots tolerate (s).
        ahead_s: greatest lead of any clock (s).
        made_checks: called with a fault-free scenario and its mission; yields faults.
        real: returns the true data of a vehicle in a run.
        slower: largest relative loss of speed against the data, and its key.
        place_error_m: position error accumulated in the time of a fix (m); None without position errors.
        locating: vehicles near which others obtain fixes.
        water: current, see ``missions.scenarios.features.water``; None for still water.
        for_all: those of ``states`` that all need, if needs follow from groups.
    """

    keys: Mapping[str, Mapping[str, tuple[Any, Any]]]
    observer: Callable[[Joining], Observer | None] = lambda joining: None
    checks: Callable[[Scenario, type[Mission]], Iterable[ConfigurationFault]] = lambda scenario, mission: ()
    words: Callable[[Scenario], Sequence[Path]] = lambda scenario: ()
    states: Sequence[str] = ()
    metrics: Sequence[Metric] = ()
    last_metrics: Sequence[Metric] = ()
    instances: Callable[[Scenario], Sequence[tuple[str, str]]] = lambda scenario: ()
    needed: Callable[[Scenario], Iterable[str]] = lambda scenario: ()
    apart_s: Callable[[Scenario], float] = lambda scenario: 0.0
    ahead_s: Callable[[Scenario], float] = lambda scenario: 0.0
    made_checks: Callable[[Scenario, Mission], Iterable[ConfigurationFault]] = lambda scenario, made: ()
    real: Callable[[Scenario, VehicleData, int], VehicleData] = lambda scenario, data, seed: data
    slower: Callable[[Scenario], tuple[float, str]] = lambda scenario: (0.0, "")
    place_error_m: Callable[[Scenario, Sequence[VehicleData]], float | None] = lambda scenario, vehicles: None
    locating: Callable[[Scenario], Iterable[str]] = lambda scenario: ()
    water: Callable[[Scenario], Any] = lambda scenario: None
    for_all: Sequence[str] = ()
    strategy: Callable[[Scenario, Strategy], Strategy] = lambda scenario, strategy: strategy


def on_unless_off(key: str, description: str, without: Observer) -> Feature:
    """Return a feature on unless ``communication.KEY = false``; the run hooks ``without`` then remove it."""
    keys = {"communication": {key: (bool, Field(True, description=description))}}
    return Feature(keys, lambda joining: without)
