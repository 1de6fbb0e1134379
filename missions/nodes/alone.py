"""Builder of one vehicle of a scenario, without the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from exchange.wire.codec import renewed
from exchange.wire.sealing import fresh_salt
from missions.document import Document
from missions.errors import ConfigurationError
from missions.fault import Absence, kinds
from missions.nodes.frontseat import Steered
from missions.runs.assembly import (
    Shared,
    VehicleLife,
    actual,
    faults_in,
    feature_observers,
    vehicle_anew,
    vehicle_of,
)
from missions.runs.setup import Setup, recorder_of_mission, sensors_of
from missions.runs.setup import resolved as setup_of
from missions.scenarios.communication import key_of
from missions.scenarios.faults import kind_named
from missions.scenarios.loading import scenario_from
from missions.scenarios.scenario import Scenario
from remoras.faults import Fault, Faults
from remoras.fleet.standalone import Solo
from worldmodel import EPOCHS, suggestion

if TYPE_CHECKING:
    from exchange.wire.definitions import Introductions


@dataclass(frozen=True, slots=True)
class NodePlan:
    """Inputs of a single vehicle, except the packets that it receives.

    ``scenario`` is resolved TOML text, ``epoch`` the number of earlier restarts without memory. The vehicle starts at
    ``begins_s``, acts until ``until_s`` and exchanges until ``end_s`` (s of the mission). ``is_steered``: True for a
    real body instead of a simulated one (``missions.nodes.frontseat``).
    """

    scenario: str
    vehicle: str
    seed: int
    epoch: int
    begins_s: float
    until_s: float
    end_s: float
    is_steered: bool = False

    @classmethod
    def of(cls, scenario: Scenario, vehicle: str, seed: int, until_s: float | None, settle_s: float) -> NodePlan:
        """Return the plan of a vehicle present from the start; ConfigurationError if it or ``until_s`` is impossible.

        ``until_s`` is the end of its actions, by default that of the scenario; its exchange lasts ``settle_s`` longer.
        """
        names, duration_s = [table.name for table in scenario.vehicle], scenario.scenario.duration_s
        name = scenario.scenario.name
        if vehicle not in names:
            allowed = f"one of {', '.join(names)}{suggestion(vehicle, names)}"
            raise ConfigurationError.of(name, "VEHICLE", vehicle, allowed)
        if until_s is not None and not 0.0 < until_s <= duration_s:
            allowed = f"a time up to scenario.duration_s = {duration_s:g} s; raise that with --set"
            raise ConfigurationError.of(name, "--until", f"{until_s:g}", allowed)
        stop_s = duration_s if until_s is None else until_s
        return cls(scenario.for_seed(seed).text, vehicle, seed, 0, 0.0, stop_s, stop_s + settle_s)

    def setup(self) -> Setup:
        """Return the resolved scenario; raise ConfigurationError for an invalid ``epoch``.

        It is also raised for a strategy or mission that needs more than packets between vehicles.
        """
        scenario = scenario_from(Document.of_text(self.scenario, "scenario"))
        name = scenario.scenario.name
        setup = setup_of(scenario)
        if setup.strategy.declaration.sharing is not None:
            allowed = "a bound without packets; allowed: a strategy that exchanges packets"
            raise ConfigurationError.of(name, "strategy.name", setup.strategy.name, allowed)
        if setup.mission.nature(setup.mission.world(self.seed)) is not None:
            allowed = (
                "allowed: a mission without physical transfer between vehicles, as a node does not know true positions"
            )
            raise ConfigurationError.of(name, "scenario.mission", f'"{scenario.scenario.mission}"', allowed)
        if not 0 <= self.epoch < EPOCHS:
            raise ConfigurationError.of(name, "--epoch", str(self.epoch), f"allowed: 0 to {EPOCHS - 1}")
        return setup


@dataclass(frozen=True, slots=True)
class LoneVehicle:
    """Single vehicle; ``salt`` is empty without a key, ``lives`` counts its incarnations."""

    plan: NodePlan
    setup: Setup
    solo: Solo
    salt: bytes = b""
    lives: int = 1
    steered: Steered | None = None


Pause = tuple[float, float]  # start and end of a period without the vehicle's process (s of the mission)


def alone(plan: NodePlan, salts: Sequence[bytes] = (), pauses: Sequence[Pause] = ()) -> LoneVehicle:
    """Build the vehicle of a plan, as in a run of its scenario and seed; raises as ``NodePlan.setup``.

    Args:
        salts: salts of its incarnations, if the scenario has a key; missing ones are fresh, a replay passes all.
        pauses: periods without its process; after each the vehicle restarts with its memory.
    """
    setup, introductions, by_life = plan.setup(), None, [b""]
    if key := key_of(setup.scenario.communication.key_file):
        # Each incarnation needs a salt of its own: a nonce used twice under one key would reveal both packets.
        by_life = [*salts, *(fresh_salt() for _ in range(1 + len(pauses) - len(salts)))]
        introductions = _introductions(setup, plan.vehicle, key, by_life[0])
        setup = replace(setup, codec=renewed(setup.codec, introductions.salt_of))
    scenario, mission = setup.scenario, setup.mission
    real = actual(setup, setup.database[plan.vehicle], plan.seed)
    recorder = recorder_of_mission(mission, [sensors_of(data) for data in setup.database.values()])
    steered = Steered() if plan.is_steered else None
    observers = feature_observers(setup, recorder, plan.seed, is_alone=True)
    if steered is not None:
        observers.append(steered)
    shared = Shared(setup, plan.seed, mission.world(plan.seed), recorder, observers)

    faults = [fault for fault in faults_in(setup, plan.seed) if fault.vehicle == plan.vehicle]
    if plan.begins_s > 0.0:
        # A late start is an absence from the start, as a scenario could declare it.
        faults.insert(0, _away(setup, plan, Absence.BEFORE, at_s=plan.begins_s))
    for from_s, until_s in pauses:
        faults.append(_away(setup, plan, Absence.PAUSE, at_s=from_s, until_s=until_s, memory="kept"))
    solo = Solo(
        lambda model: vehicle_of(model, shared, VehicleLife(real, plan.begins_s, plan.epoch)),
        lambda model, before, remembers: vehicle_anew(model, shared, before, remembers),
        setup.schedule,
        recorder,
        scenario.scenario.tick_s,
        plan.until_s,
        introductions,
        [Faults(faults), *observers],
    )
    if introductions is not None:
        for (_, until_s), salt in zip(pauses, by_life[1:], strict=True):
            solo.note(partial(_begin_again, introductions, salt), until_s)
    return LoneVehicle(plan, setup, solo, by_life[-1], 1 + len(pauses), steered)


def _away(setup: Setup, plan: NodePlan, absence: Absence, *, at_s: float, **keys: Any) -> Fault:
    away = next((name for name, kind in kinds().items() if kind.ABSENCE is absence), None)
    if away is None:
        allowed = f"no kind of fault keeps a vehicle away as {absence}: 0 s"
        raise ConfigurationError.of(setup.scenario.scenario.name, "begins", f"{at_s:g}", allowed)
    declared = kind_named(away)(kind=away, vehicle=plan.vehicle, at_s=at_s, **keys)
    return declared.befalling(setup.database[plan.vehicle], at_s)


def _begin_again(introductions: Introductions, salt: bytes, solo: Solo) -> None:
    introductions.begin(salt)


def _introductions(setup: Setup, vehicle: str, key: bytes, salt: bytes) -> Introductions:
    from exchange.wire.definitions import Introductions

    tolerance_s, node = setup.scenario.communication.clock_tolerance_s, setup.database[vehicle].node
    return Introductions(node, key, salt, setup.codec, setup.schedule, setup.modem.payload_bits, tolerance_s)
