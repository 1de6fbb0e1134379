"""Drawing schedules: a pure function of plan and seed; which kinds are on, whom, when and how strongly is drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from missions.errors import ConfigurationError, ConfigurationFault
from missions.runs.run import run
from missions.scenarios import load
from missions.scenarios.scenario import Scenario
from remoras.errors import PluginError
from stress.draws import Draws
from stress.kinds import ALL, KINDS, SELDOM, Family, Kind, kind_of
from stress.schedule import VERSION, Schedule, StressFault, StressTable, excludes, fleet_of, frame_s, overrides
from stress.settings import NONE, settings_named
from stress.steering import Instant, steered
from worldmodel import suggestion

MOST_KINDS, MOST_OF_A_KIND = 4, 2
P_STAYS = 0.25
"""Probability that a fault which may last for good does; of one vehicle at most in a schedule."""
P_CHECKED = 0.7
"""Probability that packets have a checksum where some are damaged and the scenario has none: else much passes."""
CRC_BITS = 32
DAMAGING = frozenset({"bits", "cut"})
LEASES = 3
"""Leases of absence that the survivors may wait for after what is transient has healed."""
SLACK = 1.5
"""How many times as long as without faults the mission may take then, beside what a head may wait at a meeting."""


@dataclass(frozen=True)
class Plan:
    """From what schedules are drawn.

    Attributes:
        scenario: name or file; strategy: its name; settings: KEY=VALUE that the user gave.
        draws: names of settings from which seeds draw; drawn: KEY=VALUE of those that were.
        vehicles: names by node; sensing: those with sensors.
        kinds: from which schedules are drawn.
        usual_s: time of the mission without faults (s); its whole duration where it does not complete.
        completes: True if it completes without faults.
        grace_s: what leases of absence take (s).
        wait_s: how long a head may wait for those who do not come to a meeting (s).
        is_checked: True if packets have a checksum anyway.
        duration_s: when the scenario ends a run (s).
        must_end: a run has to be over before its bound; instants: when something rare is under way without faults.
        cost_s: what that run took on this machine (s); nothing follows from it but estimates.
    """

    scenario: str
    strategy: str
    settings: tuple[str, ...]
    vehicles: tuple[str, ...]
    sensing: tuple[str, ...]
    kinds: tuple[str, ...]
    usual_s: float
    completes: bool
    grace_s: float
    wait_s: float
    is_checked: bool
    duration_s: float
    cost_s: float = 0.0
    draws: tuple[str, ...] = ()
    drawn: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    must_end: bool = False
    instants: tuple[Instant, ...] = ()


def kinds_named(names: Sequence[str]) -> tuple[str, ...]:
    """Kinds in the order of tables; all but the seldom without names.

    Raises:
        ConfigurationError: there is none of a name.
    """
    for unknown in (name for name in names if name not in KINDS):
        try:
            kind_of(unknown)
        except PluginError as error:
            families = [family.value for family in Family]
            known = f"allowed: {', '.join(KINDS)}; or {', '.join(families)}{suggestion(unknown, [*KINDS, *families])}"
            allowed = str(error) if ":" in unknown else known
            raise ConfigurationError(
                "remoras stress", [ConfigurationFault("--faults", f'"{unknown}"', allowed)]
            ) from None
    others = dict.fromkeys(name for name in names if name not in KINDS)
    return (*(kind.name for kind in ALL if (kind.name in names if names else kind.name not in SELDOM)), *others)


def plan_of(
    scenario: str, strategy: str = "", settings: Sequence[str] = (), kinds: Sequence[str] = (), draws: str = NONE
) -> Plan:
    """What a plan needs to know of a scenario: it is run once without faults of schedules.

    Args:
        scenario: shipped name or file.
        strategy: shipped name or ``package.module:object``; the scenario's if empty.
        settings: KEY=VALUE of the scenario.
        kinds: names of kinds or families; all if empty.
        draws: settings from which seeds draw, beside those that are given: ``none``, ``all``, or names with commas.

    Raises:
        ConfigurationError: something is wrong with the scenario, the kinds or the settings.
    """
    drawn = settings_named(draws, settings, strategy)
    named = [kind.name for kind in ALL if kind.family.value in kinds]
    found = kinds_named([*named, *(kind for kind in kinds if kind not in list(Family))])
    own = load(scenario, overrides(strategy, settings))
    usual = run(own, seed=1)
    possible = tuple(name for name in found if _is_possible(kind_of(name), own))
    if not possible:
        allowed = f"nothing in {scenario} that this may befall by chance; write a schedule, and --replay it"
        raise ConfigurationError("remoras stress", [ConfigurationFault("--faults", f'"{",".join(kinds)}"', allowed)])
    plan = Plan(
        scenario,
        strategy or own.strategy.name,
        tuple(settings),
        (),
        (),
        possible,
        usual.end_s,
        usual.completed,
        0.0,
        0.0,
        False,
        own.scenario.duration_s,
        usual.wall_s,
        drawn,
    )
    return of_scenario(plan, own)


def of_scenario(plan: Plan, own: Scenario) -> Plan:
    """The plan with what follows from the tables of a scenario alone."""
    sensing = {vehicle.name for vehicle in own.vehicle if vehicle.sensor}
    protection = own.communication.crc_bits or (CRC_BITS if own.communication.key_file else 0)
    return replace(
        plan,
        vehicles=fleet_of(own),
        sensing=tuple(name for name in fleet_of(own) if name in sensing),
        grace_s=LEASES * own.communication.lease_frames * frame_s(own),
        wait_s=getattr(own.mission, "meeting_deadline_s", 0.0),
        is_checked=protection >= CRC_BITS,
    )


def _is_possible(kind: Kind, scenario: Scenario) -> bool:
    """True unless no vehicle of a scenario can be befallen by a kind."""
    if kind.is_of_scenario and not kind.by_chance:
        return False
    if kind.family is not Family.SENSOR or kind.name == "misplaced":
        return True
    return any(vehicle.sensor for vehicle in scenario.vehicle)


def schedule_of(plan: Plan, seed: int) -> Schedule:
    """The schedule of a seed."""
    draws = Draws(seed, 0)
    heal_s = round(plan.usual_s * draws.between(0.15, 0.6), 1)
    kinds = draws.some_of(plan.kinds, 1 + int(draws.uniform() * MOST_KINDS))
    settings = list(plan.settings)
    if not DAMAGING.isdisjoint(kinds) and not plan.is_checked and draws.uniform() < P_CHECKED:
        settings.append(f"communication.crc_bits={CRC_BITS}")
    staying = draws.one_of(plan.vehicles) if draws.uniform() < 0.5 else ""
    faults: list[StressFault] = []
    for number, name in enumerate(kinds, 1):
        own = Draws(seed, number)
        for _ in range(1 + int(own.uniform() * MOST_OF_A_KIND)):
            fault = _drawn(kind_of(name), own, plan, heal_s, staying)
            if not any(excludes(fault, other) for other in faults):
                faults.append(fault)
    if plan.instants:
        heal_s, faults = steered(plan.instants, seed, heal_s, faults, plan.sensing)
    bound_s = plan.usual_s
    if plan.completes or plan.must_end:
        staying_on = [fault for fault in faults if fault.is_permanent]
        factor = min((fault.speed_left for fault in staying_on), default=1.0)
        n_sensing, n_hit = len(plan.sensing), len({fault.vehicle for fault in staying_on}.intersection(plan.sensing))
        share = max(1, n_sensing - n_hit) / n_sensing if n_sensing else 1.0  # of those who work, who are left to
        bound_s = round(heal_s + SLACK * plan.usual_s / (factor * share) + plan.wait_s + plan.grace_s, 1)
    about = StressTable(
        version=VERSION,
        scenario=plan.scenario,
        strategy=plan.strategy,
        settings=tuple(settings),
        vehicles=plan.vehicles,
        seed=seed,
        heal_s=heal_s,
        bound_s=bound_s,
        must_finish=plan.completes,
        must_end=plan.must_end,
    )
    ordered = sorted(faults, key=lambda fault: (fault.at_s, fault.kind, fault.vehicle))
    return Schedule(stress=about, settings=dict(plan.drawn), fault=tuple(ordered))


def _drawn(kind: Kind, draws: Draws, plan: Plan, heal_s: float, staying: str) -> StressFault:
    """One fault of a kind, over by ``heal_s`` unless it befalls ``staying`` and stays."""
    at_s = round(draws.uniform() * 0.8 * heal_s, 1)
    until_s: float | None = round(at_s + max(10.0, draws.uniform() * (heal_s - at_s)), 1)
    if until_s is not None and until_s > heal_s:
        until_s = round(heal_s, 1)
    with_sensors = kind.family is Family.SENSOR and kind.name != "misplaced"
    able = plan.sensing if with_sensors else plan.vehicles
    vehicle = draws.one_of(able)
    whose: dict[str, Any] = {"vehicle": vehicle}
    if kind.family is Family.LINK:
        peers = [name for name in plan.vehicles if name != vehicle]
        whose = [{}, {"vehicle": vehicle}, {"vehicle": vehicle, "peer": draws.one_of(peers)}][int(3 * draws.uniform())]
        if kind.name in ("partition", "echo"):
            whose.setdefault("vehicle", vehicle)
        if kind.name == "echo":
            whose.pop("peer", None)
    if kind.may_stay and staying in able and draws.uniform() < 2.0 * P_STAYS:
        whose, until_s = {"vehicle": staying}, None
    if kind.is_of_start:
        at_s = max(at_s, 1.0)
    if kind.is_sudden:
        until_s = None
    return StressFault(kind=kind.name, at_s=at_s, until_s=until_s, **whose, **kind.drawn(draws))
