"""Emission control: ``[[covert]]``, by which a vehicle hears but does not send, or sends only what is urgent.

While it holds, the radio of the vehicle is told a least priority: only what has a higher one goes into a packet, and a
slot in which nothing may go stays empty.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from pydantic import Field

from missions.errors import ConfigurationFault
from missions.feature import USUAL_S, Draws, Feature, Joining, Trial
from missions.scenarios.tables import (
    NotNegative,
    Positive,
    Raw,
    Section,
    entries,
    names_of,
    one_of,
    span_faults,
)
from remoras.events import Part

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario
    from remoras.mission import Mission
    from remoras.vehicle import Vehicle

KEY = "covert"


class CovertTable(Section):
    """One ``[[covert]]``."""

    vehicle: str = Field(description="vehicle that hears but does not send")
    above: int | None = Field(None, ge=0, le=1000, description="it sends what has a higher priority; nothing if absent")
    from_s: NotNegative = Field(0.0, description="when that begins")
    until_s: Positive | None = Field(None, description="when that is over; never if absent")


def covert_faults(raw: Raw, mission: type[Mission] | None) -> Iterator[ConfigurationFault]:
    """Vehicles that there are not, and times that cannot be."""
    for number, table in enumerate(entries(raw, KEY), 1):
        yield from one_of(f"{KEY}.{number}.vehicle", table.get("vehicle"), names_of(raw, "vehicle"))
        yield from span_faults(raw, f"{KEY}.{number}", table)


def least_priority(tables: Iterable[CovertTable], now_s: float) -> float:
    """Priority above which things may be said now: 0 for all, infinite for nothing.

    Args:
        tables: of one vehicle.
        now_s: the time by its clock (s).

    >>> tables = (CovertTable(vehicle="AUV01", above=50, from_s=10.0, until_s=40.0),
    ...           CovertTable(vehicle="AUV01", from_s=20.0, until_s=30.0))
    >>> [least_priority(tables, now_s) for now_s in (5.0, 10.0, 25.0, 30.0)]
    [0, 50, inf, 50]
    """
    holding = [table for table in tables if table.from_s <= now_s and (table.until_s is None or now_s < table.until_s)]
    return max((math.inf if covert.above is None else covert.above for covert in holding), default=0)


def part_of(joining: Joining) -> Part | None:
    """Let the radios of the vehicles that are named know what they may send."""
    tables: tuple[CovertTable, ...] = joining.scenario.of_feature(KEY)

    def equip(vehicle: Vehicle) -> None:
        if own := [table for table in tables if table.vehicle == vehicle.name]:
            vehicle.radio.limits.append(lambda now_s: least_priority(own, now_s))

    return Part(equip=equip) if tables else None


def drawn(draws: Draws, scenario: Scenario) -> Mapping[str, Any]:
    """A vehicle that does not send for a time."""
    from_s = draws.even(0.0, USUAL_S / 2)
    until_s = from_s + draws.scaled(20.0, 300.0)
    table: dict[str, Any] = {"vehicle": draws.one_of(scenario.names_by_slot), "from_s": from_s, "until_s": until_s}
    above = draws.one_of((None, 9, 19))
    return {KEY: [table if above is None else {**table, "above": above}]}


FEATURE = Feature(
    {"": {KEY: (tuple[CovertTable, ...], ())}},
    part_of,
    covert_faults,
    trials=(Trial("covert", "a vehicle hears and does not send for 20 to 300 s", (KEY,), drawn),),
)
