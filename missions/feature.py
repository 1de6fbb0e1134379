"""Features: what a scenario may do without, each in one file of ``missions/features`` that has its name.

A file there has a ``FEATURE``: the keys that it brings to the tables of scenarios, what it checks, the words that it
adds to the ontology, and how it takes part in a run. There is no list of them: whoever puts a file there has a feature,
and whoever takes it away has one less, and nothing else changes. What a scenario does not use is not made in its runs.
"""

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
    """What a feature may know of the run that it is to take part in.

    Attributes:
        scenario: the whole input.
        tbox: core ontology and the words that mission, scenario and features add.
        instances: what the whole fleet has names for.
        database: vehicles as the fleet knows them.
        schedule: of the slots.
        packet_s: time that the modem takes to send so many bits (s).
        recorder: takes the rows; a feature declares tables of its own.
        seed: root of all draws.
        is_alone: True for a vehicle by itself, which has the clock of its hull.
    """

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
    """One feature. All but its keys is asked for only where a scenario has one of them.

    Attributes:
        keys: type and field of each key that it brings, by the table that has the key: "" is the scenario itself,
            "vehicle" or "communication" a table of it. A key is left out of what is written while it has its default,
            unless that is to be on.
        observer: called once for each run; takes part in it, if the feature does anything.
        checks: called when a scenario is checked, with its well-formed tables and the class of its mission; yields what
            is wrong between them.
        words: called with each checked scenario; Turtle files whose words its items use, read only where it uses them.
        states: attributes of these words that vehicles tell all others, as urgent as what is most urgent.
        metrics: figures of a run; each is not applicable where the scenario does not use the feature.
        last_metrics: the same; they stand in the summary behind the others that every run has.
        instances: called with each checked scenario; class and name of what the whole fleet has names for on top.
        needed: called when a scenario is checked; attributes of which somebody needs values.
        on_demand: called with each checked scenario; attributes that are exchanged once somebody needs them.
        apart_s: called with each checked scenario; the most by which two clocks differ that slots stand (s).
        ahead_s: called with each checked scenario; the most by which any clock may come to be ahead (s).
        made_checks: called with a scenario that has no other faults and its mission; yields what is wrong.
        real: called with each scenario, the data of a vehicle and the seed; the vehicle as it really is in that run.
        slower: called when a scenario is checked; the share by which vehicles may be slower than their data, and the
            key that says so.
        place_error_m: called with each checked scenario and data of vehicles; how far off these may take themselves to
            be in the time in which they learn their place (m); None where they know it.
        locating: called with each checked scenario; names of the vehicles near which others learn where they are.
        water: called with each checked scenario; how the water moves, see ``missions.scenarios.tables.water``; None
            where it stands.
        for_all: those of ``states`` that concern everybody, where needs follow from groups.
        strategy: called with each scenario and its strategy; the strategy that its runs have.
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
    on_demand: Callable[[Scenario], Iterable[str]] = lambda scenario: ()
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


def on_unless_off(key: str, description: str, without: Callable[[], Observer]) -> Feature:
    """What vehicles have unless a scenario says ``communication.KEY = false``.

    Args:
        key: of the table ``communication``.
        description: of the key.
        without: takes it out of the vehicles of a run that does without.
    """
    return Feature({"communication": {key: (bool, Field(True, description=description))}}, lambda joining: without())
