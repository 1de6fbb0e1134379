"""Clocks: ``[communication.clocks]`` and ``[vehicle.clock]``, how far the clocks of vehicles are off, and the guard."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from pydantic import Field

from missions.errors import ConfigurationFault
from missions.scenarios.deployment import Deployed, sound_speed_mps
from missions.scenarios.tables import Section

PPM, ROUNDING_S = 1e-6, 1e-6
MOST_OFF_S, MOST_DRIFT_PPM = 86_400.0, 10_000.0
"""Clocks are off by no more than a day, and gain no more than one part in a hundred."""


class ClocksTable(Section):
    """The table ``[communication.clocks]``."""

    offset_s: float = Field(
        0.0,
        ge=0.0,
        le=MOST_OFF_S,
        description="every clock is by up to this ahead or behind at the start, evenly, drawn once per run",
    )
    drift_ppm: float = Field(
        0.0,
        ge=0.0,
        le=MOST_DRIFT_PPM,
        description="every clock gains or loses by up to this many millionths, evenly, drawn once per run",
    )
    apart_s: float = Field(
        0.0,
        ge=0.0,
        le=MOST_OFF_S,
        description="most by which two clocks differ that slots stand: the guard and clock tolerances cover it",
    )
    discipline: bool = Field(
        False, description="vehicles set their clocks by when packets of their peers arrive, one way"
    )


class VehicleClockTable(Section):
    """The table ``[vehicle.clock]``: what is given here is not drawn."""

    offset_s: float | None = Field(
        None, ge=-MOST_OFF_S, le=MOST_OFF_S, description="by how much it is ahead at the start"
    )
    drift_ppm: float | None = Field(
        None, ge=-MOST_DRIFT_PPM, le=MOST_DRIFT_PPM, description="by how many millionths it gains"
    )


class _Timed(Protocol):
    """A vehicle."""

    @property
    def name(self) -> str: ...

    @property
    def slot(self) -> int: ...

    @property
    def depth_m(self) -> float: ...

    @property
    def clock(self) -> VehicleClockTable | None: ...


class _Exchange(Protocol):
    @property
    def modem(self) -> str: ...

    @property
    def range_m(self) -> float: ...

    @property
    def guard_s(self) -> float | None: ...

    @property
    def clocks(self) -> ClocksTable | None: ...


class _WithClocks(Deployed, Protocol):
    @property
    def vehicle(self) -> Sequence[_Timed]: ...

    @property
    def communication(self) -> _Exchange: ...


def has_clocks(scenario: _WithClocks) -> bool:
    """True if a scenario says anything of clocks."""
    return scenario.communication.clocks is not None or any(one.clock is not None for one in scenario.vehicle)


def apart_s(scenario: _WithClocks) -> float:
    """The most by which two clocks differ that guard and tolerances cover (s)."""
    clocks = scenario.communication.clocks
    return 0.0 if clocks is None else clocks.apart_s


def most_ahead_s(scenario: _WithClocks) -> float:
    """The most by which any clock may come to be ahead in a run (s), set by its peers' or not."""
    spread, duration_s = scenario.communication.clocks or ClocksTable(), scenario.scenario.duration_s
    ahead_s = [spread.offset_s + PPM * spread.drift_ppm * duration_s]
    for given in (one.clock for one in scenario.vehicle if one.clock is not None):
        offset_s = spread.offset_s if given.offset_s is None else given.offset_s
        drift_ppm = spread.drift_ppm if given.drift_ppm is None else given.drift_ppm
        ahead_s.append(offset_s + PPM * drift_ppm * duration_s)
    return max(0.0, *ahead_s) + apart_s(scenario)


def least_guard_s(scenario: _WithClocks) -> float:
    """The time in which a packet travels over the whole range, and by which two clocks may differ (s)."""
    return scenario.communication.range_m / sound_speed_mps(scenario) + apart_s(scenario)


def guard_s(scenario: _WithClocks) -> float:
    """The guard of a slot: as given, or the least (s)."""
    given_s = scenario.communication.guard_s
    return least_guard_s(scenario) if given_s is None else given_s


def guard_faults(scenario: _WithClocks) -> list[ConfigurationFault]:
    """A guard in which packets of one slot run into the next."""
    given_s, least_s = scenario.communication.guard_s, least_guard_s(scenario)
    if given_s is None or given_s >= least_s - ROUNDING_S:
        return []
    range_m, speed_mps = scenario.communication.range_m, sound_speed_mps(scenario)
    allowed = (
        f"{least_s:.4g} s or more: communication.range_m = {range_m:g} at {speed_mps:g} m/s takes "
        f"{range_m / speed_mps:.4g} s, and clocks differ by communication.clocks.apart_s = {apart_s(scenario):g} s; "
        "leave the key out, or lower one of these"
    )
    return [ConfigurationFault("communication.guard_s", f"{given_s:g}", allowed)]
