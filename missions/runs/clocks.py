"""The clocks of the vehicles of a run, with the draws of a seed, and what vehicles make of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from exchange.acoustics import loss
from missions.scenarios.clocks import ClocksTable, has_clocks
from missions.scenarios.deployment import sound_speed_mps
from missions.scenarios.scenario import Scenario
from remoras.own_clock import CLOCKS, OwnClock, RecorderByClock
from remoras.recorder import Recorder
from remoras.timekeeping import Timekeeper

if TYPE_CHECKING:
    from missions.runs.setup import Setup

OFFSET, DRIFT = range(2)
"""Stand where receivers stand in the draws."""


def clocks_of(scenario: Scenario, seed: int) -> tuple[OwnClock, ...]:
    """The clocks of the vehicles, by node; draws are keyed by seed and node, in a stream of their own.

    Args:
        scenario: the whole input.
        seed: root of all draws.
    """
    spread = scenario.communication.clocks or ClocksTable()
    clocks = []
    for table in sorted(scenario.vehicle, key=lambda one: one.slot):
        given = table.clock
        offset_s = given.offset_s if given is not None else None
        drift_ppm = given.drift_ppm if given is not None else None
        clocks.append(
            OwnClock(
                _drawn(seed, table.slot, OFFSET, spread.offset_s) if offset_s is None else offset_s,
                _drawn(seed, table.slot, DRIFT, spread.drift_ppm) if drift_ppm is None else drift_ppm,
            )
        )
    return tuple(clocks)


def _drawn(seed: int, node: int, what: int, spread: float) -> float:
    """A number from -spread to spread; exactly 0 without spread."""
    return spread * (2.0 * loss.uniform(seed, loss.CLOCKS, 0, node, what) - 1.0) if spread else 0.0


def own_recorder(clock: OwnClock, recorder: Recorder, disciplines: bool) -> Recorder:
    """What takes the rows of the vehicle with that clock: their times are the true ones.

    Args:
        clock: of the vehicle.
        recorder: of the fleet.
        disciplines: True if vehicles set their clocks.
    """
    return recorder if clock.is_exact and not disciplines else RecorderByClock(recorder, clock)


def timekeeper_of(setup: Setup, node: int, clock: OwnClock, recorder: Recorder) -> Timekeeper | None:
    """What compares a vehicle's clock with its peers'; None in scenarios without clocks.

    Args:
        setup: the scenario resolved.
        node: of the vehicle.
        clock: of it.
        recorder: of the fleet, which gets a table of clocks.
    """
    scenario = setup.scenario
    if not has_clocks(scenario):
        return None
    recorder.declare(CLOCKS)
    return Timekeeper(
        setup.database.names,
        [data.depth_m for data in setup.database.values()],
        node,
        setup.schedule,
        setup.modem.packet_s,
        sound_speed_mps(scenario),
        clock,
        disciplines(scenario),
        recorder,
    )


def disciplines(scenario: Scenario) -> bool:
    """True if vehicles set their clocks by their peers'."""
    clocks = scenario.communication.clocks
    return clocks is not None and clocks.discipline
