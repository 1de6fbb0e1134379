"""Checks of motion and energy (docs/model/vehicle.md, docs/model/sea.md); vehicles out of operation use none."""

from __future__ import annotations

import math
from itertools import combinations
from typing import Any

import numpy as np

from missions.verification.record import (
    ANGLE_STEP_RAD,
    AWAY,
    FLOATING,
    PLACE_STEP_M,
    SPEED_STEP_MPS,
    TIME_STEP_S,
    Array,
    CheckReport,
    Record,
    Track,
)

PLACE_M = 1.5 * PLACE_STEP_M  # rounding tolerance of the difference of two places (m)
BEYOND_M = 60.0  # tolerated distance beyond the borders during a turn back (m)
LAYER_M = 3.0  # depth difference above which vehicles do not conflict (m)


def check_tracks(record: Record, report: CheckReport) -> None:
    """Check that each vehicle has a row per tick that follows from the previous one."""
    n_ticks = round(record.end_s / record.tick_s) + 1
    due_s = np.arange(n_ticks) * record.tick_s
    for name, data in record.vehicles.items():
        track = record.tracks.get(name)
        report.look("ticks", n_ticks)
        if track is None or len(track.time_s) != n_ticks or (np.abs(track.time_s - due_s) > TIME_STEP_S).any():
            times_s = np.empty(0) if track is None else track.time_s
            shared = min(len(times_s), n_ticks)
            wrong = np.flatnonzero(np.abs(times_s[:shared] - due_s[:shared]) > TIME_STEP_S)
            row = int(wrong[0]) if len(wrong) else shared
            stated = f"{times_s[row]:g} s in row {row}" if row < len(times_s) else f"{len(times_s)} rows"
            follows = f"{due_s[row]:g} s" if row < n_ticks else f"{n_ticks} rows, one for each tick"
            report.add("ticks", "trajectories", None, name, stated, follows)
            continue
        _check_start(data, name, track, report)
        _check_steps(record, name, data, track, report)
        _check_energy(record, name, data, track, report)
        _check_borders(record, name, track, report)
    _check_conflicts(record, report)


def _check_start(data: dict[str, Any], name: str, track: Track, report: CheckReport) -> None:
    report.look("start")
    x_m, y_m = data["start_m"]
    if math.hypot(track.x_m[0] - x_m, track.y_m[0] - y_m) > PLACE_STEP_M:
        stated = f"at ({track.x_m[0]:g}, {track.y_m[0]:g})"
        report.add("start", "trajectories", track.time_s[0], name, stated, f"({x_m:g}, {y_m:g})")


def water_mps(record: Record, depth_m: Array, times_s: Array) -> tuple[Array, Array] | None:
    """Return the water velocity (east, north) at depths; None if random surges affect it."""
    current = record.of("current")
    if current.get("surge"):
        return None
    share = np.ones(len(times_s))
    if "shear_depth_m" in current:
        share = np.maximum(0.0, 1.0 - depth_m / current["shear_depth_m"])
    turns = times_s / (3600.0 * current["tide_period_h"]) if "tide_period_h" in current else np.zeros(len(times_s))
    height = share * np.cos(2.0 * math.pi * (turns + current.get("tide_phase", 0.0)))
    return height * current.get("east_mps", 0.0), height * current.get("north_mps", 0.0)


def over_ground_mps(record: Record, track: Track) -> tuple[Array, Array]:
    """Return the ground speed per tick and its rounding error, infinite under random surges."""
    speed = track.speed_mps
    if not record.of("current"):
        return speed, np.full(len(speed), SPEED_STEP_MPS)
    error_mps = SPEED_STEP_MPS + ANGLE_STEP_RAD * speed
    water = water_mps(record, track.depth_m[:-1], track.time_s[:-1])
    if water is None:
        return speed, np.full(len(speed), math.inf)
    east, north = (np.concatenate(([0.0], flow)) for flow in water)
    return np.hypot(speed * np.cos(track.heading_rad) + east, speed * np.sin(track.heading_rad) + north), error_mps


def way_through_water(record: Record, name: str, track: Track) -> tuple[Array, Array] | None:
    """Return the path through the water per tick, ahead and to the left (m); None under random surges."""
    moving = ~record.away(name, track.time_s[1:])
    for spell in record.spells:
        if spell.vehicle == name and spell.kind == "energy":
            moving |= np.abs(track.time_s[1:] - spell.from_s) <= TIME_STEP_S
    water = water_mps(record, track.depth_m[:-1], track.time_s[:-1])
    if water is None:
        return None
    dt_s, ahead = np.diff(track.time_s), (np.cos(track.heading_rad[1:]), np.sin(track.heading_rad[1:]))
    east_m = np.diff(track.x_m) - moving * water[0] * dt_s
    north_m = np.diff(track.y_m) - moving * water[1] * dt_s
    return east_m * ahead[0] + north_m * ahead[1], north_m * ahead[0] - east_m * ahead[1]


def floats(record: Record, name: str, track: Track) -> Array:
    """Return for each tick if a vehicle drifts with the water: lost, off or without energy."""
    afloat: Array = record.during(name, FLOATING, track.time_s[1:]) & record.during(name, FLOATING, track.time_s[:-1])
    afloat &= ~record.during(name, ("joins",), track.time_s[:-1])  # late vehicles are not yet in the water
    return afloat


def _check_steps(record: Record, name: str, data: dict[str, Any], track: Track, report: CheckReport) -> None:
    time_s, dt_s = track.time_s[1:], np.diff(track.time_s)
    away = record.away(name, time_s)
    drained = record.drained(name, time_s)
    ends = drained & ~record.drained(name, track.time_s[:-1])  # it moved until its battery was empty
    moves = ~away
    speed, before = track.speed_mps[1:], track.speed_mps[:-1]
    top_mps = max(data["transit_speed_mps"], data["survey_speed_mps"]) * (1.0 + record.spread)
    path = way_through_water(record, name, track)
    if path is None:
        report.skip("places in surges", "when a surge begins is drawn by the seed")
    else:
        # Rounding errs by half a step; 0.6 leaves a margin.
        tolerance_m = PLACE_M + dt_s * (0.6 * ANGLE_STEP_RAD * speed + 0.6 * SPEED_STEP_MPS)
        along_m, across_m = path
        wrong = (np.abs(across_m) > tolerance_m) | (along_m > speed * dt_s + tolerance_m) | (along_m < -tolerance_m)
        report.look("positions", int(moves.sum()))
        for row in np.flatnonzero(wrong & moves):
            stated = f"went {along_m[row]:.3f} m ahead and {across_m[row]:.3f} m to the left, through the water"
            follows = f"0 to {speed[row] * dt_s[row]:.3f} m ahead and none aside, by heading, speed and current"
            report.add("positions", "trajectories", time_s[row], name, stated, follows)
    still = away & ~ends
    report.look("away", int(still.sum()))
    afloat = floats(record, name, track)
    water = water_mps(record, np.zeros(len(time_s)), track.time_s[:-1])
    carried_m = (afloat * flow * dt_s for flow in (water or (0.0, 0.0)))
    gone_m = np.hypot(*(np.diff(at_m) - way_m for at_m, way_m in zip((track.x_m, track.y_m), carried_m, strict=True)))
    if water is None:
        gone_m[afloat] = 0.0
    for row in np.flatnonzero(still & ((gone_m > PLACE_M) | ((speed > SPEED_STEP_MPS) & ~drained))):
        stated = f"went {gone_m[row]:.3f} m by itself at {speed[row]:g} m/s"
        report.add("away", "trajectories", time_s[row], name, stated, "none: it is lost, off or without energy")
    report.look("limits", 3 * len(speed))
    limit = data["acceleration_mps2"] * dt_s + 1.5 * SPEED_STEP_MPS
    stops_s = sorted(spell.from_s for spell in record.spells if spell.vehicle == name and spell.kind in AWAY)
    begins = np.diff(np.searchsorted(stops_s, track.time_s, side="right")) > 0
    most_turn = data["turn_rate_radps"] * dt_s
    turned = np.abs((np.diff(track.heading_rad) + math.pi) % (2.0 * math.pi) - math.pi)
    for quantity, wrong, values, most in (
        ("speed", speed > top_mps + SPEED_STEP_MPS, speed, np.full(len(speed), top_mps)),
        ("change of speed", (np.abs(speed - before) > limit) & ~begins & ~ends, speed - before, limit),
        ("turn", turned > most_turn + 1.5 * ANGLE_STEP_RAD, turned, most_turn),
    ):
        for row in np.flatnonzero(wrong):
            stated = f"{quantity} {values[row]:.4f}"
            report.add("limits", "trajectories", time_s[row], name, stated, f"at most {most[row]:.4f}")
    _check_depth(record, name, data["depth_m"], track, report)


def _check_depth(record: Record, name: str, own_m: float, track: Track, report: CheckReport) -> None:
    low_m = np.where(record.drained(name, track.time_s), 0.0, own_m)
    high_m = low_m.copy()
    if record.drifts:
        before_m = np.concatenate(([own_m], track.depth_m[:-1]))
        speed_mps = float(record.of("navigation").get("vertical_speed_mps", 0.5))
        most_m = speed_mps * np.diff(track.time_s, prepend=track.time_s[0]) + PLACE_STEP_M
        has_energy = high_m > 0.0
        low_m = np.where(has_energy, np.maximum(0.0, before_m - most_m), low_m)
        high_m = np.where(has_energy, np.minimum(own_m, before_m + most_m), high_m)
    report.look("depth", len(low_m))
    for row in np.flatnonzero((track.depth_m < low_m - PLACE_STEP_M) | (track.depth_m > high_m + PLACE_STEP_M)):
        stated, follows = f"depth {track.depth_m[row]:g} m", f"{low_m[row]:g} m"
        if high_m[row] > low_m[row]:
            follows = f"{low_m[row]:g} to {high_m[row]:g} m"
        report.add("depth", "trajectories", track.time_s[row], name, stated, follows)


def listening_w(record: Record) -> float | None:
    """Return the additional listening power (W); None if unknown."""
    communication = record.of("communication")
    if not communication.get("count_listening"):
        return 0.0
    return None if record.modem is None else float(record.modem.get("receive_w") or 0.0)


def sending_j(record: Record) -> Array:
    """Return the energy of each packet (J): modem power times transmission time."""
    packets = record["packets"]
    power_w = float(record.of("communication")["transmit_power_w"])
    if record.packet_s is None:
        on_air_s = np.asarray(packets["end_s"]) - np.asarray(packets["time_s"])
    else:
        on_air_s = record.packet_s[0] + record.packet_s[1] * np.asarray(packets["size_bits"])
    return np.asarray(power_w * on_air_s)


def _check_energy(record: Record, name: str, data: dict[str, Any], track: Track, report: CheckReport) -> None:
    listening = listening_w(record)
    if listening is None:
        report.skip("energy", "the manifest has no receive power of the modem")
        return
    time_s, dt_s = track.time_s, np.diff(track.time_s)
    packets = record["packets"]
    own = np.array([sender == name for sender in packets["sender"]], dtype=bool)
    sent_s, each_j = np.asarray(packets["time_s"])[own], sending_j(record)[own]
    index = np.searchsorted(time_s, sent_s, side="right")
    sent_j = np.bincount(index, each_j, minlength=len(time_s) + 1)[: len(time_s)]
    at_tick = np.abs(sent_s - np.rint(sent_s / record.tick_s) * record.tick_s) < TIME_STEP_S
    near = np.bincount(index[at_tick], each_j[at_tick], minlength=len(time_s) + 2)
    unsure_j = np.maximum(near[1 : len(time_s)], near[2 : len(time_s) + 1])  # rounding may move a packet across a tick
    speed = track.speed_mps[1:]
    drained = record.drained(name, time_s)
    runs = ~record.away(name, time_s[1:])
    drained_w = np.zeros(len(dt_s))
    for spell in record.spells:
        if spell.vehicle == name and spell.lost_w:
            drained_w += spell.lost_w * record.lasting([spell], time_s[1:])
    due_j = runs * dt_s * (data["hotel_w"] + listening + drained_w + data["drag_w_per_mps3"] * speed**3) + sent_j[1:]
    step_j = dt_s * data["drag_w_per_mps3"] * 3.0 * speed**2 * 0.6 * SPEED_STEP_MPS
    step_j += dt_s * 1e-5 * drained_w  # a detail has six digits
    used_j = np.diff(track.energy_j.astype(float))
    asked = ~drained[1:]
    report.look("energy", 2 * len(used_j))
    # The difference of two whole numbers of joules errs by up to 1 J.
    wrong = asked & (np.abs(used_j - due_j) > 1.05 + step_j + unsure_j)
    all_j = np.cumsum(due_j)
    error_j = 1.05 + np.cumsum(step_j) + unsure_j + 1e-3 * index.size
    wrong |= asked & (np.abs(track.energy_j[1:] - track.energy_j[0] - all_j) > error_j)
    wrong |= (used_j < 0.0) | (track.energy_j[1:] > data["energy_j"] + 0.5)
    # The first only, since its error remains in all later sums.
    for row in np.flatnonzero(wrong)[:1]:
        stated = f"{track.energy_j[row + 1]:.0f} J used, {used_j[row]:.0f} J of them since the tick before"
        follows = f"{track.energy_j[0] + all_j[row]:.1f} J and {due_j[row]:.1f} J"
        report.add("energy", "trajectories", time_s[row + 1], name, stated, follows)
    report.same("energy", "trajectories", f"energy of {name} at 0 s", float(track.energy_j[0]), 0.0, 0.5)


def _check_borders(record: Record, name: str, track: Track, report: CheckReport) -> None:
    if record.of("current").get("surge") or record.drifts:
        report.skip("borders in surges or under drift", "a vehicle may be where it does not take itself to be")
        return
    (x_min, x_max), (y_min, y_max) = record.of("world")["x_m"], record.of("world")["y_m"]
    out_m = np.maximum.reduce([x_min - track.x_m, track.x_m - x_max, y_min - track.y_m, track.y_m - y_max])
    report.look("borders", len(out_m))
    adrift = record.during(name, (*FLOATING, "slow") if record.of("current") else FLOATING, track.time_s)
    # It must not move further out.
    most_m = BEYOND_M + np.maximum.accumulate(np.where(adrift, np.maximum(out_m, 0.0), 0.0))
    for row in np.flatnonzero((out_m > most_m) & ~adrift):
        stated, most = f"{out_m[row]:.1f} m outside the area of operations", f"at most {most_m[row]:.1f} m"
        report.add("borders", "trajectories", track.time_s[row], name, stated, f"{most}, while it turns or comes back")


def least_distances_m(record: Record) -> dict[tuple[str, str], tuple[float, float]]:
    """Return the minimum distance (m) of each pair in one depth layer, and its time (s)."""
    least = {}
    for vehicle, other in combinations(record.tracks, 2):
        moves = record.drifts  # vehicles then leave their layers to fix their position
        if not moves and abs(record.vehicles[vehicle]["depth_m"] - record.vehicles[other]["depth_m"]) > LAYER_M:
            continue
        a, b = record.tracks[vehicle], record.tracks[other]
        if len(a.time_s) != len(b.time_s):
            continue
        together = ~(record.away(vehicle, a.time_s) | record.away(other, b.time_s))
        if moves:
            together &= np.abs(a.depth_m - b.depth_m) <= LAYER_M
        if together.any():
            apart_m = np.where(together, np.hypot(a.x_m - b.x_m, a.y_m - b.y_m), np.inf)
            row = int(apart_m.argmin())
            least[vehicle, other] = float(apart_m[row]), float(a.time_s[row])
    return least


def _check_conflicts(record: Record, report: CheckReport) -> None:
    if record.access:
        report.skip("conflicts", "other programs move the stations")
        return
    separation_m = float(record.of("guidance").get("separation_m", 5.0))
    noted: set[frozenset[str]] = set()
    for time_s, vehicle, kind, detail in record.rows("faults", "time_s vehicle kind detail"):
        if kind != "conflict":
            continue
        noted.add(frozenset((vehicle, detail)))
        report.look("conflicts")
        if vehicle not in record.tracks or detail not in record.tracks:
            report.add("conflicts", "faults", time_s, vehicle, f"conflict with {detail}", "no such pair")
            continue
        a, b = record.tracks[vehicle], record.tracks[detail]
        row = min(round(time_s / record.tick_s), len(a.time_s) - 1, len(b.time_s) - 1)
        apart_m = math.hypot(a.x_m[row] - b.x_m[row], a.y_m[row] - b.y_m[row])
        if apart_m > separation_m + PLACE_M:
            stated = f"conflict with {detail}"
            report.add("conflicts", "faults", time_s, vehicle, stated, f"none: they are {apart_m:.2f} m apart")
    for pair, (apart_m, time_s) in least_distances_m(record).items():
        report.look("conflicts")
        if apart_m < separation_m - PLACE_M and frozenset(pair) not in noted:
            follows = f"a conflict of {' and '.join(pair)}, {apart_m:.2f} m apart"
            report.add("conflicts", "faults", time_s, pair[0], "no row", follows)
