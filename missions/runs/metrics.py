"""Metrics of every run, whatever its mission, each next to its function."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import replace

from missions.errors import ConfigurationError
from missions.files import shown
from missions.metric import NOT_APPLICABLE, Absent, Better, MeasuredRun, MeasuredTables, Metric, collected
from missions.runs.fleet_metrics import closest_approach_m, conflicts, idle_s, recovery_time_s
from missions.runs.organisation_metrics import (
    holder_conflict_fraction,
    malformed_s,
    n_refused_acts,
    view_divergence,
)
from missions.scenarios.features import features
from missions.scenarios.fleet import modem_energy
from missions.scenarios.parts import METRICS, metric_named, mission_class
from missions.scenarios.scenario import Scenario
from missions.statements import stated
from remoras.mission import Mission
from remoras.recorder import Content
from worldmodel import doubted

HIGHER, LOWER = Better.HIGHER, Better.LOWER
NEVER_RECEIVED = "Items never received do not count."


def n_doubted(run: MeasuredRun) -> int | Absent:
    """Number of vehicles whose numbers and points contradict others'; see ``worldmodel.fusion``."""
    tbox = run.setup.tbox
    slots = stated(run.recorder.rows("items"), tbox, run.setup.database)
    if not any(len({o.origin for o in observations}) > 1 for observations in slots.values()):
        return NOT_APPLICABLE
    return len(doubted((tbox.attribute_named(name), observations) for (_, name), observations in slots.items()))


def deadlock_s(run: MeasuredRun) -> float | None:
    """Time (s) since which vehicles waited for each other until the end; None without a deadlock."""
    return next((milestone.time_s for milestone in run.milestones if milestone.name == "deadlock"), None)


def energy_j(run: MeasuredRun) -> float:
    """Energy (J) used by all vehicles by the end of the run."""
    rows = run.recorder.rows("trajectories")
    last = itertools.takewhile(lambda row: row[0] == rows[-1][0], reversed(rows))
    return round(math.fsum(row[6] for row in last), 2)


def n_bits(run: MeasuredRun) -> int:
    """Bits transmitted."""
    return sum(row[3] for row in run.recorder.rows("packets"))


def bits_of(content: Content) -> Callable[[MeasuredRun], int]:
    """Return the metric of bits sent for a purpose; all purposes sum to ``n_bits``."""
    return lambda run: run.recorder.bits[content]


def modem_energy_j(run: MeasuredRun) -> float:
    """Energy (J) of the modems for transmission and, if modelled, reception."""
    modem = modem_energy(run.scenario)
    sent_j = n_bits(run) * modem.transmit_j_per_bit + len(run.recorder.rows("packets")) * modem.transmit_j_per_packet
    return round(sent_j + (modem.listening_w * _powered_s(run) if modem.listening_w else 0.0), 2)


def _powered_s(run: MeasuredRun) -> float:
    """Total time (s) in which vehicles had power: ticks with consumption."""
    used_j: dict[str, float] = {}
    n_ticks = 0
    for _, vehicle, _, _, _, _, energy_j, _ in run.recorder.rows("trajectories"):
        # The first row of a vehicle has no tick before it, so it compares with itself.
        n_ticks += energy_j > used_j.get(vehicle, energy_j)
        used_j[vehicle] = energy_j
    return n_ticks * run.scenario.scenario.tick_s


def observations_per_min(run: MeasuredRun) -> float:
    """Items of others received per minute that the run lasted, mean over vehicles."""
    n_received = sum(event == "received" for *_, event in run.recorder.rows("knowledge"))
    minutes = run.ended_s / 60.0
    return round(n_received / len(run.scenario.vehicle) / minutes, 4) if minutes else 0.0


def delivery_ratio(run: MeasuredRun) -> float | None:
    """Packets received per (packet, receiver) pair, collisions included; None without packets."""
    received = sum(len(row[6]) for row in run.recorder.rows("packets"))
    lost = sum(len(row[7]) + len(row[-1]) for row in run.recorder.rows("packets"))
    return received / (received + lost) if received + lost else None


def mean_latency_s(run: MeasuredRun) -> float | None:
    """Mean time (s) from observation to reception, over all (item, receiver) pairs."""
    latencies = latencies_s(run.recorder)
    return round(math.fsum(latencies) / len(latencies), 4) if latencies else None


def p95_latency_s(run: MeasuredRun) -> float | None:
    """95 % quantile of the latency (s) over all (item, receiver) pairs."""
    import numpy as np  # slow to load, and checking a scenario loads these metrics

    latencies = latencies_s(run.recorder)
    return round(float(np.quantile(latencies, 0.95)), 4) if latencies else None


def latencies_s(recorder: MeasuredTables) -> list[float]:
    """Return latencies (s) of received items; items made up by damage are ignored."""
    observed = {item: time_s for time_s, _, item, _, event in recorder.rows("knowledge") if event == "observed"}
    received = [(row[0], row[2]) for row in recorder.rows("knowledge") if row[4] == "received"]
    return [time_s - observed[item] for time_s, item in received if item in observed]


def consistency(recorder: MeasuredTables, n_vehicles: int) -> tuple[float | None, float | None]:
    """Return (consistency_time_s, consistent_fraction) of the fleet's items.

    An item is consistent once every vehicle, silent ones included, has held it. The time is the mean over these items
    from observation until the last vehicle first held it; None without such an item. The fraction is their share of all
    items observed; None without items.
    """
    observed_s: dict[str, float] = {}
    lacking: dict[str, int] = {}
    waits_s: list[float] = []
    held: set[tuple[str, str]] = set()
    for time_s, vehicle, item, _, event in recorder.rows("knowledge"):  # in time order
        if event == "observed":
            observed_s[item], lacking[item] = time_s, n_vehicles
        elif event != "received" or item not in observed_s or (vehicle, item) in held:
            continue
        held.add((vehicle, item))
        lacking[item] -= 1
        if not lacking[item]:
            waits_s.append(time_s - observed_s[item])
    if not observed_s:
        return None, None
    return (math.fsum(waits_s) / len(waits_s) if waits_s else None), len(waits_s) / len(observed_s)


def consistency_time_s(run: MeasuredRun) -> float | Absent | None:
    """Mean time (s) until all know an item; not applicable where needs follow from groups."""
    if run.setup.subjects is not None:
        return NOT_APPLICABLE
    time_s, _ = consistency(run.recorder, len(run.scenario.vehicle))
    return None if time_s is None else round(time_s, 4)


def consistent_fraction(run: MeasuredRun) -> float | Absent | None:
    """Share of items known to the whole fleet, see ``consistency``."""
    if run.setup.subjects is not None:
        return NOT_APPLICABLE
    return consistency(run.recorder, len(run.scenario.vehicle))[1]


def settling_s(run: MeasuredRun) -> float | Absent:
    """Duration (s) of the exchange after the mission, if it is on."""
    return NOT_APPLICABLE if run.settled is None else round(run.settled.time_s, 4)


def is_settled(run: MeasuredRun) -> bool | Absent:
    """True if no vehicle lacked anything after the final exchange."""
    return NOT_APPLICABLE if run.settled is None else run.settled.complete


CORE_METRICS = (
    Metric("mission_time_s", "s", LOWER, "mission time", lambda run: round(run.end_s, 4), True, censored=True),
    Metric("completed", "", HIGHER, "success rate", lambda run: run.completed, headline=True),
    Metric("goal_fraction", "", HIGHER, "goal reached", lambda run: round(run.goal_fraction, 6), headline=True),
    Metric(
        "reachable_fraction", "", HIGHER, "achievable goal", lambda run: round(run.reachable_fraction, 6),
        note="Share of the whole goal that was achieved or that the remaining vehicles could achieve.",
    ),
    Metric("distance_m", "m", LOWER, "distance", lambda run: round(run.distance_m, 3)),
    Metric("energy_j", "J", LOWER, "energy", energy_j, headline=True),
    Metric("modem_energy_j", "J", LOWER, "modem energy", modem_energy_j),
    Metric("n_packets", "", LOWER, "packets", lambda run: len(run.recorder.rows("packets"))),
    Metric("n_bytes", "B", LOWER, "bytes", lambda run: n_bits(run) // 8, headline=True),
    *(Metric(f"bits_{content.value}", "bit", LOWER, f"{content.value} sent", bits_of(content)) for content in Content),
    Metric("delivery_ratio", "", HIGHER, "delivery ratio", delivery_ratio),
    Metric(
        "observations_per_min", "1/min", HIGHER, "observations received", observations_per_min,
        note="Observations by other vehicles that a vehicle received, each counted once; mean over vehicles.",
    ),
    Metric("mean_latency_s", "s", LOWER, "latency", mean_latency_s, note=NEVER_RECEIVED),
    Metric("p95_latency_s", "s", LOWER, "95 % latency", p95_latency_s, note=NEVER_RECEIVED),
    Metric(
        "consistency_time_s", "s", LOWER, "consistency time", consistency_time_s,
        note="Items that did not reach all vehicles do not count.",
    ),
    Metric("consistent_fraction", "", HIGHER, "consistent fraction", consistent_fraction),
    Metric("false_beliefs", "", LOWER, "false beliefs", lambda run: run.n_false_beliefs),
    Metric(
        "wrong_belief_fraction", "", LOWER, "wrong beliefs about job holders", lambda run: run.wrong_belief_fraction,
        note="Share of all beliefs of a vehicle about another holder of a job, at the ends of TDMA frames.",
    ),
    Metric(
        "view_divergence", "", LOWER, "divergence of views", view_divergence,
        note="Share of time, over pairs of vehicles, in which one has a wrong view of the roles of the other.",
    ),
    Metric(
        "holder_conflict_fraction", "", LOWER, "holders in conflict", holder_conflict_fraction,
        note="Share of time in which more vehicles hold a role, by their own views, than its maximum.",
    ),
    Metric(
        "malformed_s", "s", LOWER, "time of malformed organisation", malformed_s,
        note="Time with too few holders of a founding role, too many holders of a role, or a holder not allowed.",
    ),
    Metric("n_refused_acts", "", Better.NEITHER, "refused requests", n_refused_acts),
    Metric(
        "n_doubted", "", LOWER, "vehicles with contradicting values", n_doubted,
        note="Their numbers or points contradict those of others at the 1 % level; of two vehicles both count.",
    ),
    *(metric for feature in features().values() for metric in feature.metrics),
    Metric("idle_s", "s", LOWER, "idle time", idle_s, note="Mean over the vehicles able to do a job."),
    Metric(
        "recovery_time_s", "s", LOWER, "recovery time", recovery_time_s, censored=True,
        note="From the first fault until other vehicles hold the jobs; only runs with a lost vehicle count.",
    ),
    Metric(
        "deadlock_s", "s", HIGHER, "time until deadlock", deadlock_s, censored=True,
        note="Vehicles of a cycle each wait for the next until the run ends; milestones `deadlock` name them.",
    ),
    Metric(
        "closest_approach_m", "m", HIGHER, "closest approach", closest_approach_m,
        note="Smallest distance of two vehicles in one depth layer.",
    ),
    Metric(
        "settling_s", "s", LOWER, "exchange after the mission", settling_s,
        note="Until no item was outstanding, or the time limit of the exchange.",
    ),
    Metric("settled", "", HIGHER, "exchange completed", is_settled),
    Metric("conflicts", "", LOWER, "conflicts", conflicts, note="Pairs of vehicles closer than the separation."),
    *(metric for feature in features().values() for metric in feature.last_metrics),
)  # fmt: skip
"""Metrics of every run; those of features apply only where the feature is in use."""


def metrics_of(
    scenario: Scenario, mission: type[Mission] | None = None, own: Mapping[str, Metric] | None = None
) -> Mapping[str, Metric]:
    """Return the metrics of a scenario's runs by name: general, of its mission, and its own.

    ``mission`` and ``own`` are loaded if None. Raises ConfigurationError for a metric without direction or a duplicate
    name or label, PluginError if one cannot be loaded.
    """
    reference, added = scenario.scenario.mission, own_metrics(scenario) if own is None else own
    references = {f"metric {metric.name}": named for named, metric in added.items()}
    metrics = collected(reference, (*CORE_METRICS, *(mission or mission_class(reference)).metrics))
    try:
        return collected(scenario.scenario.name, (*metrics.values(), *added.values()))
    except ConfigurationError as error:
        faults = [
            replace(fault, key=METRICS, given=shown(references[fault.key.partition(",")[0]]),
                    allowed=f"{fault.key}: {fault.allowed}")
            for fault in error.faults
        ]  # fmt: skip
        raise ConfigurationError(scenario.scenario.name, faults) from None


def own_metrics(scenario: Scenario) -> dict[str, Metric]:
    """Return the scenario's own metrics by reference; raise PluginError if one fails to load."""
    return {reference: metric_named(reference) for reference in scenario.scenario.metrics}
