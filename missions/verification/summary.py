"""Checks of the summary: metrics recomputed from the tables (docs/howto/results.md)."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from missions.verification.mapping import cells_of
from missions.verification.motion import PLACE_M, floats, least_distances_m, listening_w, sending_j, way_through_water
from missions.verification.record import CheckReport, Record, Track

LATENCY_S = 2e-3  # tolerance (s) of two times rounded to 1/4096 s and a mean rounded to 0.1 ms
IDENTITY = {
    "scenario": ("scenario", "name"), "strategy": ("strategy", "name"), "policy": ("communication", "policy"),
    "channel": ("channel", "name"),
}  # fmt: skip
NOT_DERIVED = {
    "bits_headers": "purposes of a packet's bits are in no table; only their sum is checked",
    "false_beliefs": "beliefs of receivers after each packet are in no table",
    "wrong_belief_fraction": "beliefs about holders of jobs are in no table",
    "reason": "only whether there is one is checked",
    **dict.fromkeys(
        ("n_doubted", "view_divergence", "holder_conflict_fraction", "malformed_s", "idle_s", "left_when_given_up"),
        "its definition is not repeated here",
    ),
}
"""Fields that tables do not determine, with the reason."""


def check_figures(record: Record, report: CheckReport) -> None:
    """Compare all metrics of the summary that the tables determine."""
    summary = record.summary
    for name, path in IDENTITY.items():
        is_foreign = record.access and name in ("strategy", "policy")
        expected = "none" if is_foreign else record.of(path[0]).get(path[1])
        report.same("identity", "summary", name, summary.get(name), expected)
    report.same("identity", "summary", "seed", summary.get("seed"), record.seed)
    report.same("identity", "summary", "n_vehicles", summary.get("n_vehicles"), len(record.vehicles))
    channel = record.of("channel")
    if channel["name"] in ("perfect", "bernoulli"):
        report.same("identity", "summary", "per", summary.get("per"), float(channel.get("per", 0.0)), 1e-9)
    else:
        report.skip("per", "on this channel it is a mean of its model")
    for name, why in NOT_DERIVED.items():
        if name in summary:
            report.skip(name, why)
    derived: dict[str, tuple[Any, float]] = {}
    parts: list[Callable[[Record, CheckReport], dict[str, tuple[Any, float]]]] = [
        _of_motion, _of_packets, _of_knowledge, _of_organisation,
    ]  # fmt: skip
    if "coverage" in record.tables and "area" in record.scenario:
        parts.append(_of_mapping)
    for part in parts:
        derived |= part(record, report)
    for name, (value, within) in derived.items():
        if name in summary:
            report.same("figures", "summary", name, summary[name], value, within)
    known = {*derived, *NOT_DERIVED, *IDENTITY, "seed", "n_vehicles", "per", "run_id", "milestones", "completed"}
    known |= {"mission_time_s", "wall_s", *(["goal_fraction"] if _of_mapping in parts else [])}
    for name in summary:
        if name not in known and not name.startswith("bits_"):
            report.not_checked.setdefault(name, "no check of this figure from the tables")


def way_error_m(track: Track) -> float:
    """Return the error (m) of a path computed from rounded places.

    Errors of different steps are independent and grow with the square root of their number. A vehicle on a repeated
    circuit repeats its errors: m equal steps count as m squared.
    """
    places = np.column_stack((track.x_m[:-1], track.y_m[:-1], track.x_m[1:], track.y_m[1:], track.heading_rad[1:]))
    moves = (places[:, 0] != places[:, 2]) | (places[:, 1] != places[:, 3])
    _, times = np.unique(places[moves], axis=0, return_counts=True)
    return PLACE_M * math.sqrt(int((~moves).sum()) + int((times.astype(np.int64) ** 2).sum()))


def _of_motion(record: Record, report: CheckReport) -> dict[str, tuple[Any, float]]:
    derived: dict[str, tuple[Any, float]] = {}
    last_j = [float(track.energy_j[-1]) for track in record.tracks.values()]
    derived["energy_j"] = math.fsum(last_j), 0.5 * len(last_j) + 0.01
    ways, error_m = [], 0.0
    for name, track in record.tracks.items():
        path = way_through_water(record, name, track)
        if path is None:
            report.skip("distance_m", "when a surge begins is drawn by the seed")
            break
        along_m, _ = path
        along_m[floats(record, name, track)] = 0.0
        ways.append(float(along_m.sum()))
        error_m = math.hypot(error_m, way_error_m(track))
    else:
        derived["distance_m"] = math.fsum(ways), 0.05 + error_m
    listening = listening_w(record)
    if listening is not None:
        used = [np.diff(track.energy_j.astype(float)) for track in record.tracks.values() if listening]
        powered_s = record.tick_s * sum(int((used_j > 0.0).sum()) for used_j in used)
        n_sent = len(record["packets"])
        slack_j = 0.005 + (0.0 if record.packet_s else 0.01 * n_sent)
        derived["modem_energy_j"] = float(sending_j(record).sum()) + listening * powered_s, slack_j
        if listening and any(data["hotel_w"] < 1.0 for data in record.vehicles.values()):
            del derived["modem_energy_j"]
            report.skip("modem_energy_j", "with so little power, ticks with and without it cannot be distinguished")
    apart = least_distances_m(record)
    least_m = min((gap_m for gap_m, _ in apart.values()), default=None)
    derived["closest_approach_m"] = least_m, PLACE_M
    separation_m = float(record.of("guidance").get("separation_m", 5.0))
    # Within rounding of the separation, a pair may or may not be a conflict.
    if not any(abs(gap_m - separation_m) < PLACE_M + 0.001 for gap_m, _ in apart.values()):
        derived["conflicts"] = sum(gap_m < separation_m for gap_m, _ in apart.values()), 0
    return derived


def _of_packets(record: Record, report: CheckReport) -> dict[str, tuple[Any, float]]:
    packets = record["packets"]
    n_bits = int(np.sum(packets["size_bits"])) if len(packets) else 0
    received = sum(map(len, packets["receivers"]))
    lost = sum(map(len, packets["lost_by"])) + sum(map(len, packets["collided_at"]))
    by_content = [value for name, value in record.summary.items() if name.startswith("bits_")]
    report.same("figures", "summary", "sum of bits_...", sum(by_content), n_bits)
    if by_content and min(by_content) < 0:
        report.add("figures", "summary", None, "", f"bits_... of {min(by_content)}", "0 or more")
    return {
        "n_packets": (len(packets), 0),
        "n_bytes": (n_bits // 8, 0),
        "delivery_ratio": (received / (received + lost) if received + lost else None, 1e-9),
    }


def _of_knowledge(record: Record, report: CheckReport) -> dict[str, tuple[Any, float]]:
    rows = list(record.rows("knowledge", "time_s vehicle item event"))
    observed = {item: time_s for time_s, _, item, event in rows if event == "observed"}
    received = [(time_s, item) for time_s, _, item, event in rows if event == "received"]
    waits_s = [time_s - observed[item] for time_s, item in received if item in observed]
    minutes = record.end_s / 60.0
    derived: dict[str, tuple[Any, float]] = {
        "observations_per_min": (len(received) / len(record.vehicles) / minutes if minutes else 0.0, 1e-4),
        "mean_latency_s": (math.fsum(waits_s) / len(waits_s) if waits_s else None, LATENCY_S),
        "p95_latency_s": (float(np.quantile(waits_s, 0.95)) if waits_s else None, LATENCY_S),
    }
    if "deliveries" in record.tables:
        lost = record.rows("deliveries", "event reason")
        n_expired = sum(event == "expired" and reason in ("time to live", "overflow") for event, reason in lost)
        derived["n_expired"] = n_expired, 0
    n_lacking: Counter[str] = Counter()
    last_s: dict[str, float] = {}
    held: set[tuple[str, str]] = set()
    for time_s, vehicle, item, event in rows:
        if event == "observed":
            held.add((vehicle, item))
        elif event == "received" and time_s >= observed.get(item, math.inf) and (vehicle, item) not in held:
            held.add((vehicle, item))
            n_lacking[item] += 1
            last_s[item] = time_s
    whole = [item for item in observed if n_lacking[item] >= len(record.vehicles) - 1]
    derived["consistent_fraction"] = len(whole) / len(observed) if observed else None, 1e-6
    waits_s = [last_s.get(guid, observed[guid]) - observed[guid] for guid in whole]
    derived["consistency_time_s"] = (math.fsum(waits_s) / len(waits_s) if waits_s else None), LATENCY_S
    return derived


def _of_organisation(record: Record, report: CheckReport) -> dict[str, tuple[Any, float]]:
    return {
        "deadlock_s": (_first_s(record, "deadlock"), 1e-3),
        "n_refused_acts": (sum(event == "refused" for event in record["organisation"]["event"]), 0),
    }


def _first_s(record: Record, name: str) -> Any:
    return next((stone["time_s"] for stone in record.milestones(name)), None)


def _of_mapping(record: Record, report: CheckReport) -> dict[str, tuple[Any, float]]:
    cells, first, n_rows = cells_of(record), record.covered, len(record["coverage"])
    derived: dict[str, tuple[Any, float]] = {
        "coverage_fraction": (len(first) / len(cells) if cells else 0.0, 1e-9),
        "duplicate_fraction": (1.0 - len(first) / n_rows if n_rows else 0.0, 1e-9),
    }
    for share in (50, 80, 95, 100):
        reached = record.rows("goal", "time_s goal_fraction")
        when = next((time_s for time_s, fraction in reached if fraction >= share / 100.0 - 1e-9), None)
        derived[f"time_to_{share}_s"] = when, 1e-3
    areas = {area["name"] for area in record.scenario["area"]}
    exploring = {key for key, role in record.declared_roles.items() if role.get("job") in areas}
    held = record.rows("roles", "vehicle group role")
    holders = {vehicle for vehicle, group, role in held if (group, role) in exploring}
    n_first = Counter(vehicle for _, vehicle in first.values())
    least = min(n_first[holder] for holder in holders) / len(first) if holders and first else None
    derived["least_mapped_fraction"] = least, 1e-9
    derived["given_up_s"] = _first_s(record, "mapping_stopped"), 1e-3
    if n_inspected := int(record.of("finds").get("number", 0)):
        derived["finds_inspected_fraction"] = len(record.milestones("inspected")) / n_inspected, 1e-9
    return derived
