"""Invariants of how a run ends, of motion, of its tables, of results read independently, and of answers that hold."""

from __future__ import annotations

import itertools
import json
import math
from collections import Counter
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass, fields
from typing import Any

from stress.invariants import EVENT, TICK, Heard, Invariant, Scene
from stress.schedules import AWAY, WORK

from exchange.packets import ItemUid
from missions.fault import Absence, absence
from missions.runs.results import MODEM_KEYS
from missions.runs.tables import arrow_table
from missions.scenarios.extending import water
from missions.verification.folder import verify_run
from missions.verification.record import CheckReport, Record, TableColumns
from remoras.behaviours import distance_m
from remoras.contents import Content
from remoras.faults import OVER
from remoras.recorder import PACKETS
from remoras.separation import SAME_DEPTH_M
from remoras.strategy import Situation, ask
from remoras.vehicle import Vehicle

# Ending -------------------------------------------------------------------------------------------

CLOSE = 1e-6
ROUNDED = {
    "energy_j": 0.006,
    "observations_per_min": 6e-5,
    "mean_latency_s": 6e-5,
    "p95_latency_s": 6e-5,
    "mission_time_s": 6e-5,
}
"""How far a figure may be off that the summary rounds: half a unit of its last place, and what sums are off."""
SENSES = WORK | {"random", "frozen"}
"""Kinds under which work may stay undone though nobody is to blame."""
LIES = frozenset({"forged", "forged-done", "bits", "cut"})


class NoException(Invariant):
    """No exception leaves a vehicle, but for one that names the plug-in which broke its promise."""

    name = "exceptions"


class SameDigest(Invariant):
    """The same schedule gives the same tables, byte for byte."""

    name = "repeats"


class Finishes(Invariant):
    """After what is transient has healed, the survivors complete the mission by the bound, if they are able to."""

    name = "finishes"
    not_under = SENSES | LIES

    def broken(self, scene: Scene) -> str | None:
        """Look at the verdict."""
        run, about = scene.finished, scene.schedule
        if run is None or not about.must_finish or run.completed or _is_unheard_of(scene) or scene.was_parted:
            return None
        if run.reachable_fraction < 1.0:  # the work is all of it, whoever is left: nobody may be able to do some of it
            return None
        return f"not complete by {about.bound_s:g} s, healed at {about.heal_s:g} s: {run.reason}"


class Ends(Invariant):
    """A run is over before its bound, complete or not: nobody goes on for ever."""

    name = "ends"
    not_under = SENSES | LIES

    def broken(self, scene: Scene) -> str | None:
        """Look at when the run ended, and at who could still have gone on."""
        run, about, fleet = scene.finished, scene.schedule, scene.fleet
        if run is None or not about.must_end or run.completed or fleet.ended_s + fleet.tick_s <= fleet.duration_s:
            return None
        if not scene.in_contact() or _is_unheard_of(scene) or scene.was_parted:
            return None
        return f"goes on at {fleet.ended_s:g} s: {run.reason}"


def _share_below(ordered: list[float], share: float) -> float:
    """The value that a share of ascending ones stays below, linear between them."""
    low, rest = divmod(share * (len(ordered) - 1), 1.0)
    here, next_one = ordered[int(low)], ordered[min(int(low) + 1, len(ordered) - 1)]
    return here * (1.0 - rest) + next_one * rest


def _is_unheard_of(scene: Scene) -> bool:
    """True where somebody does nothing any more, and nobody hears of it: the strategy lets none speak."""
    is_heard = any(vehicle.radio.is_heard for vehicle in scene.fleet.vehicles)
    return not is_heard and not all(vehicle.is_alive for vehicle in scene.fleet.vehicles)


class TrueVerdict(Invariant):
    """A mission counts as complete if, and only if, its goal is reached, and then there is no reason against it.

    What is within reach is no less than what is reached, and no more than all.
    """

    name = "verdict"

    def broken(self, scene: Scene) -> str | None:
        """Compare verdict, goal, reason and milestones."""
        run, summary = scene.finished, scene.summary
        if run is None:
            return None
        noted_s = [milestone.time_s for milestone in run.milestones if milestone.name == "mission_complete"]
        if run.completed and (run.goal_fraction < 1.0 or run.reason):
            return f"completed with {run.goal_fraction:g} of the goal, reason {run.reason!r}"
        ended_s, tick_s = scene.fleet.ended_s, scene.fleet.tick_s
        if len(noted_s) != run.completed or any(not 0.0 <= ended_s - at_s <= tick_s for at_s in noted_s):
            return f"completed: {run.completed} at {ended_s:g} s; milestones mission_complete at {noted_s}"
        if not run.goal_fraction <= run.reachable_fraction <= 1.0:
            return f"{run.goal_fraction:g} of the goal is reached, and {run.reachable_fraction:g} within reach"
        if not run.completed and not run.reason:
            return "not completed, for no reason"
        if bool(summary["completed"]) is not run.completed or summary["goal_fraction"] > 1.0:
            return f"the summary says {summary['completed']} and {summary['goal_fraction']:g} of the goal"
        return None


class SummaryOfTables(Invariant):
    """The figures of the summary follow from the tables."""

    name = "summary"

    def broken(self, scene: Scene) -> str | None:
        """Work figures out anew."""
        if (run := scene.finished) is None:
            return None
        rows, packets = run.recorder.trajectories, run.recorder.packets
        distance_m, at, energy_j = 0.0, dict[str, tuple[float, float]](), dict[str, float]()
        for _, vehicle, x_m, y_m, _, _, used_j, _ in rows:
            if vehicle in at:
                distance_m += math.hypot(x_m - at[vehicle][0], y_m - at[vehicle][1])
            at[vehicle], energy_j[vehicle] = (x_m, y_m), used_j
        n_heard, n_lost = sum(len(row[6]) for row in packets), sum(len(row[7]) + len(row[-1]) for row in packets)
        observed_s = {row[2]: row[0] for row in run.recorder.knowledge if row[4] == "observed"}
        received = [(row[0], row[2]) for row in run.recorder.knowledge if row[4] == "received"]
        waits_s = [time_s - observed_s[item] for time_s, item in received if item in observed_s]
        expected = {
            "n_packets": len(packets),
            "observations_per_min": 60.0 * len(received) / (len(at) * run.end_s) if run.end_s else 0.0,
            "mean_latency_s": math.fsum(waits_s) / len(waits_s) if waits_s else None,
            "p95_latency_s": _share_below(sorted(waits_s), 0.95) if waits_s else None,
            "n_bytes": sum(row[3] for row in packets) // 8,
            "delivery_ratio": n_heard / (n_heard + n_lost) if n_heard + n_lost else None,
            "energy_j": math.fsum(energy_j.values()),
            "mission_time_s": rows[-1][0] if run.completed else scene.setup.scenario.scenario.duration_s,
            "n_vehicles": len(at),
        }
        for name, value in expected.items():
            given = scene.summary.get(name)
            is_close = math.isclose(value or 0.0, given or 0.0, rel_tol=CLOSE, abs_tol=ROUNDED.get(name, CLOSE))
            if (value is None) != (given is None) or not is_close:
                return f"{name} is {given}; the tables say {value}"
        n_bits, by_content = (
            sum(row[3] for row in packets),
            [scene.summary[f"bits_{content.value}"] for content in Content],
        )
        if sum(by_content) != n_bits or min(by_content) < 0:
            return f"bits are {by_content} by their contents; the tables say {n_bits} in all"
        if not has_current(scene) and abs(scene.summary["distance_m"] - distance_m) > 1.0:
            return f"distance_m is {scene.summary['distance_m']}; the tracks are {distance_m:.3f} m long"
        times = [milestone.time_s for milestone in run.milestones]
        if times != sorted(times) or (times and times[-1] > rows[-1][0] + CLOSE):
            return f"milestones at {times}, the last row is of {rows[-1][0]:g} s"
        return None


# Motion -------------------------------------------------------------------------------------------

ROUNDING_M, ROUNDING_J, ROUNDING_MPS, ROUNDING_RAD = 1e-3, 1e-6, 1e-9, 1e-6
SENDER, SIZE_BITS = map(PACKETS.column_names.index, ("sender", "size_bits"))
CLOCKS_OFF_S = 35.0
"""By how much clocks may be off: jumps of 30 s, and what a scenario has beside them."""
OVERSHOOT_M = 60.0
"""How far beyond the borders a vehicle may drift while it turns."""
LEAST_SHARE = 0.5
"""Share of the separation that vehicles keep in any case; what is between is counted as a conflict."""


@dataclass(frozen=True)
class Water:
    """The keys of ``[current]``; what stands where a scenario has none."""

    east_mps: float = 0.0
    north_mps: float = 0.0
    shear_depth_m: float | None = None
    tide_period_h: float | None = None
    tide_phase: float = 0.0
    surge: tuple[Any, ...] = ()


def water_of(scene: Scene) -> Water:
    """How the water moves, as the scenario says."""
    table = water(scene.setup.scenario)
    return Water() if table is None else Water(**{field.name: getattr(table, field.name) for field in fields(Water)})


def has_current(scene: Scene) -> bool:
    """True if the water moves."""
    return water_of(scene) != Water()


STILL = (0.0, 0.0), 0.0
"""What ``carried`` gives where the water does not move."""


def carried(table: Water, depth_m: float, now_s: float) -> tuple[tuple[float, float], float]:
    """Velocity of the water (m/s, east and north) but for surges, and by how much clocks that are off may change it.

    Worked out from the keys, not by the model: full at the surface, nothing at ``shear_depth_m``, to and fro with the
    tide.

    >>> carried(Water(east_mps=0.4, shear_depth_m=40.0), 10.0, 0.0)
    ((0.30000000000000004, 0.0), 0.0)
    """
    share, turns = 1.0, 0.0
    if table.shear_depth_m is not None:
        share = max(0.0, 1.0 - depth_m / table.shear_depth_m)
    strength_mps = share * math.hypot(table.east_mps, table.north_mps)
    if table.tide_period_h is not None:
        turns = 2.0 * math.pi / (3600.0 * table.tide_period_h)
        share *= math.cos(turns * now_s + 2.0 * math.pi * table.tide_phase)
    return (share * table.east_mps, share * table.north_mps), strength_mps * min(2.0, turns * CLOCKS_OFF_S)


class Finite(Invariant):
    """All positions, headings, speeds and energies are finite numbers."""

    name = "finite"
    moment = TICK

    def broken(self, scene: Scene) -> str | None:
        """Look at the state of motion of each vehicle; at the end at all numbers of all tables."""
        for vehicle in scene.fleet.vehicles:
            m = vehicle.functional.motion
            if not math.isfinite(m.x_m + m.y_m + m.ahead[0] + m.ahead[1] + m.speed_mps + m.energy_j):
                return f"{vehicle.name} at {scene.now_s:g} s: {m}"
        if scene.finished is None:
            return None
        recorder = scene.finished.recorder
        for name, table in recorder.tables.items():
            rows = recorder.rows(name)
            for column, values in zip(table.columns, zip(*rows, strict=True), strict=False):
                if column.kind == "float" and not math.isfinite(sum(filter(None, values))):
                    for row, value in zip(rows, values, strict=True):
                        if value is not None and not math.isfinite(value):
                            return f"table {name}: {row}"
        return None


class Borders(Invariant):
    """No vehicle leaves the area of operations by more than it takes to turn."""

    name = "borders"
    moment = TICK

    def __init__(self) -> None:
        self._is_carried: bool | None = None

    def broken(self, scene: Scene) -> str | None:
        """Look at where vehicles are; a current may carry one that is off away."""
        if self._is_carried is None:
            self._is_carried = has_current(scene)
        if self._is_carried:
            return None
        x_min, y_min, x_max, y_max = scene.setup.bounds_m
        for vehicle in scene.fleet.vehicles:
            m = vehicle.functional.motion
            out_m = max(x_min - m.x_m, m.x_m - x_max, y_min - m.y_m, m.y_m - y_max)
            if out_m > OVERSHOOT_M and vehicle.is_alive:
                return f"{vehicle.name} is {out_m:.1f} m outside at {scene.now_s:g} s"
        return None


class Energy(Invariant):
    """A vehicle has used what its systems, its motion, its modem and its faults took, and no more than it has."""

    name = "energy"
    moment = TICK

    def __init__(self) -> None:
        self._used_j: dict[str, float] = {}
        self._before_s = 0.0
        self._n_packets = 0

    def broken(self, scene: Scene) -> str | None:
        """Work it out from the tick before; an empty battery gives nothing more."""
        if scene.finished is not None:
            return None
        dt_s, self._before_s = scene.now_s - self._before_s, scene.now_s
        packets = scene.fleet.recorder.packets
        sent, self._n_packets = packets[self._n_packets :], len(packets)
        for vehicle in scene.fleet.vehicles:
            m, data, name = vehicle.functional.motion, vehicle.functional.data, vehicle.name
            before_j = due_j = self._used_j.get(name, 0.0)
            for row in sent:
                if row[SENDER] == name:
                    due_j += data.transmit_j_per_packet + row[SIZE_BITS] * data.transmit_j_per_bit
            if vehicle.is_alive:
                own_w = data.hotel_w + data.drag_w_per_mps3 * m.speed_mps**3
                due_j += (own_w + math.fsum(vehicle.functional.loads_w)) * dt_s
            is_right = abs(m.energy_j - due_j) <= ROUNDING_J * (1.0 + due_j)
            is_within = before_j - ROUNDING_J <= m.energy_j <= data.energy_j + ROUNDING_J
            if not is_within or not (is_right or vehicle.functional.exhausted):
                used = f"{name} had used {before_j:.1f} J, now {m.energy_j:.1f} J"
                return f"{used} at {scene.now_s:g} s; due {due_j:.1f} J"
            self._used_j[name] = m.energy_j
        return None


class Speed(Invariant):
    """No vehicle is anywhere else than it can have gone, or turns or gains speed faster than it can."""

    name = "speed"
    moment = TICK

    def __init__(self) -> None:
        self._before: dict[str, tuple[float, float, float, tuple[float, float], float]] = {}
        """By name: place, speed, direction, depth."""
        self._before_s = 0.0
        self._was_alive: set[str] = set()
        self._water: Water | None = None
        self._flow_mps = 0.0
        self._is_still = True

    def broken(self, scene: Scene) -> str | None:
        """Compare with the tick before: its way through the water, and what the water carried it."""
        if scene.finished is not None:
            return None
        if (table := self._water) is None:
            table = self._water = water_of(scene)
            self._flow_mps = math.fsum(math.hypot(surge.east_mps, surge.north_mps) for surge in (table, *table.surge))
            self._is_still = table == Water()
        alive = {vehicle.name for vehicle in scene.fleet.vehicles if vehicle.is_alive}
        moved_itself = frozenset[str]() if table.surge else alive & self._was_alive
        before_s, self._before_s = self._before_s, scene.now_s
        dt_s, flow_mps = self._before_s - before_s, self._flow_mps
        for vehicle in scene.fleet.vehicles:
            m, data, name = vehicle.functional.motion, vehicle.functional.data, vehicle.name
            x_m, y_m, speed_mps, ahead = m.x_m, m.y_m, m.speed_mps, m.ahead
            now = x_m, y_m, speed_mps, ahead, vehicle.functional.depth_m
            before, self._before[name] = self._before.get(name), now
            if before is None:
                continue
            dx_m, dy_m, gained_mps = x_m - before[0], y_m - before[1], speed_mps - before[2]
            most_m = (max(data.transit_speed_mps, data.survey_speed_mps) + flow_mps) * dt_s * 1.001 + ROUNDING_M
            if dx_m * dx_m + dy_m * dy_m > most_m * most_m:
                return f"{name} went {math.hypot(dx_m, dy_m):.2f} m from {before_s:g} s to {scene.now_s:g} s"
            if name in moved_itself:
                (east_mps, north_mps), off_mps = STILL if self._is_still else carried(table, before[4], before_s)
                if now[4] != before[4]:  # it goes up or down
                    (to_east_mps, to_north_mps), _ = carried(table, now[4], before_s)
                    off_mps += math.hypot(to_east_mps - east_mps, to_north_mps - north_mps)
                x_gone_m, y_gone_m = dx_m - east_mps * dt_s, dy_m - north_mps * dt_s
                along_m = x_gone_m * ahead[0] + y_gone_m * ahead[1]
                aside_m = abs(x_gone_m * ahead[1] - y_gone_m * ahead[0])
                slack_m = off_mps * dt_s + ROUNDING_M
                if aside_m > slack_m or not -slack_m <= along_m <= speed_mps * dt_s + slack_m:
                    way = f"{along_m:.2f} m ahead through the water and {aside_m:.2f} m aside"
                    return f"{name} went {way} from {before_s:g} s to {scene.now_s:g} s"
            if gained_mps > data.acceleration_mps2 * dt_s + ROUNDING_MPS:
                return f"{name} gained {gained_mps:.2f} m/s from {before_s:g} s to {scene.now_s:g} s"
            if ahead != before[3]:
                along = ahead[0] * before[3][0] + ahead[1] * before[3][1]
                across = ahead[1] * before[3][0] - ahead[0] * before[3][1]
                turned_rad = abs(math.atan2(across, along))
                if turned_rad > data.turn_rate_radps * dt_s + ROUNDING_RAD:
                    return f"{name} turned by {turned_rad:.2f} rad from {before_s:g} s to {scene.now_s:g} s"
        self._was_alive = alive
        return None


class SeparationKept(Invariant):
    """No two vehicles of one layer that were apart come nearer than half of the separation."""

    name = "separation"
    moment = TICK
    not_under = AWAY

    def __init__(self) -> None:
        self._apart: set[tuple[str, str]] = set()

    def broken(self, scene: Scene) -> str | None:
        """Look at each pair; those that have not been apart yet are starting."""
        separation_m = scene.setup.scenario.guidance.separation_m
        for one, other in itertools.combinations([v for v in scene.fleet.vehicles if v.is_alive], 2):
            if abs(one.functional.depth_m - other.functional.depth_m) > SAME_DEPTH_M:
                self._apart.discard((one.name, other.name))
                continue
            a, b, pair = one.functional.motion, other.functional.motion, (one.name, other.name)
            distance_m = math.hypot(a.x_m - b.x_m, a.y_m - b.y_m)
            if distance_m >= separation_m:
                self._apart.add(pair)
            elif distance_m < LEAST_SHARE * separation_m and pair in self._apart:
                return f"{one.name} and {other.name} are {distance_m:.2f} m apart at {scene.now_s:g} s"
        return None


# Tables -------------------------------------------------------------------------------------------


class WholeTables(Invariant):
    """Tracks, packets, receptions, faults and roles stand in the tables as they were."""

    name = "tables"
    moment = EVENT

    def __init__(self) -> None:
        self._sent: set[tuple[int, str]] = set()
        self._received: Counter[tuple[str, ItemUid]] = Counter()

    def broken(self, scene: Scene) -> str | None:
        """Note what is heard during the mission; at the end compare."""
        if scene.heard is not None:
            if scene.fleet.running:
                self._note(scene, scene.heard)
            return None
        return next(self._missing(scene), None) if scene.finished is not None else None

    def _note(self, scene: Scene, heard: Heard) -> None:
        if heard.aired is not None:
            self._sent.add((heard.aired.slot, scene.fleet.vehicles[heard.aired.sender.node].name))
        if heard.reception.items and heard.reception.fault is None:
            self._received.update([(heard.vehicle.name, uid) for uid in heard.reception.items])

    def _missing(self, scene: Scene) -> Iterator[str]:
        fleet, recorder = scene.fleet, scene.fleet.recorder
        due, n_rows = len(fleet.vehicles) * fleet.n_ticks, len(recorder.trajectories)
        if n_rows != due:
            yield f"trajectories has {n_rows} rows of {len(fleet.vehicles)} vehicles in {fleet.n_ticks} ticks"
        for slot, sender in sorted(self._sent - {(row[0], row[2]) for row in recorder.packets}):
            yield f"packets lacks that of {sender} in slot {slot}, which was heard"
        rows = Counter((row[1], row[2]) for row in recorder.knowledge if row[4] == "received")
        received = Counter({(vehicle, str(uid)): n_times for (vehicle, uid), n_times in self._received.items()})
        wrong = received - rows
        if not scene.is_selective:  # there what was set aside is received when it comes to be needed
            wrong |= rows - received
        for vehicle, uid in sorted(wrong):
            n_rows, n_times = rows[vehicle, uid], received[vehicle, uid]
            yield f"knowledge has {n_rows} rows of {vehicle} receiving {uid}, which it did {n_times} times"
        yield from _heard(scene)
        yield from _faults(scene)
        yield from _roles(scene)


def _heard(scene: Scene) -> Iterator[str]:
    """Packets that somebody is said to have heard who was deaf or off, or whose sender was mute."""
    for fault in scene.fleet.medium.faults:
        begins_s, ends_s = fault.from_s, fault.until_s
        for row in scene.fleet.recorder.packets:
            slot, sent_s, sender, receivers, arrivals_s = row[0], row[1], row[2], row[6], row[9]
            is_out = sender == fault.vehicle and begins_s < sent_s < ends_s
            if fault.leaves.is_mute and is_out and receivers:
                yield f"packets has {receivers} hearing {sender} in slot {slot}, which was mute"
            if not fault.leaves.hears and fault.vehicle in receivers:
                heard_s = arrivals_s[receivers.index(fault.vehicle)]
                if begins_s < heard_s and sent_s < ends_s:
                    yield f"packets has {fault.vehicle} hearing {sender} in slot {slot}: {fault.kind} befell it"


def _faults(scene: Scene) -> Iterator[str]:
    """Faults of which the begin or the end is missing."""
    fleet = scene.fleet
    told = {(row[1], row[2], row[3] == OVER, row[0]) for row in fleet.recorder.faults}
    for fault in fleet.medium.faults:
        for at_s, is_over in zip((fault.from_s, fault.until_s), (False, True), strict=True):
            if at_s < fleet.ended_s and (fault.vehicle, fault.kind, is_over, at_s) not in told:
                event = "was over at" if is_over else "befell"
                yield f"faults lacks that {fault.kind} {event} {fault.vehicle} at {at_s:g} s"


def _is_pause(kind: str) -> bool:
    """True if a vehicle begins anew once a fault of a kind is over."""
    return absence(kind) is Absence.PAUSE


def _roles(scene: Scene) -> Iterator[str]:
    """Roles that a vehicle plays, as it sees itself, and that its rows do not come to, or the other way round."""
    fleet = scene.fleet
    anew_s = {row[1]: row[0] for row in fleet.recorder.faults if row[3] == OVER and _is_pause(row[2])}
    for vehicle in fleet.vehicles:
        told: set[tuple[str, str]] = set()
        for time_s, name, group, role, event in fleet.recorder.roles:
            if name != vehicle.name or time_s < anew_s.get(name, 0.0):
                continue
            if event == "assigned":
                told.add((group, role))
            elif event == "left":
                told.discard((group, role))
        plays = {(role.group, role.role) for role in vehicle.social.organisation.roles_of(vehicle.name)}
        if told != plays:
            yield f"roles comes to {sorted(told)} of {vehicle.name}, which plays {sorted(plays)}"


DAMAGED, LATE = {"knowledge", "received", "acknowledged", "senders"}, {"arrivals", "knowledge", "senders"}
UNTOLD = {
    "bits": DAMAGED, "cut": DAMAGED, "forged": DAMAGED, "twice": LATE, "late": LATE, "forged-done": {"milestones"},
}  # fmt: skip
"""Checks of ``remoras verify`` that ask what no table tells under a kind of fault that no scenario declares."""


class Follows(Invariant):
    """``remoras verify``, which knows nothing of the program, finds nothing in the results that does not follow."""

    name = "follows"

    def broken(self, scene: Scene) -> str | None:
        """Give the results, as they would be written, to the checker."""
        if (run := scene.finished) is None:
            return None
        recorder, modem = run.recorder, run.setup.modem
        tables = {
            name: TableColumns(arrow_table(table, recorder.rows(name))) for name, table in recorder.tables.items()
        }
        written = run.scenario.model_dump(mode="json", exclude_none=True)
        profile = {key: getattr(modem, key) for key in MODEM_KEYS}
        report = CheckReport()
        verify_run(Record(written, run.seed, json.loads(json.dumps(scene.summary)), tables, profile), report)
        untold = set[str]().union(*(UNTOLD[kind] for kind in scene.schedule.kinds & UNTOLD.keys()))
        return next((str(finding) for finding in report.findings if finding.check not in untold), None)


# Answers ------------------------------------------------------------------------------------------


class AnswersHold(Invariant):
    """Whoever has said that an answer holds gives the same when it is asked again."""

    name = "answers"
    moment = TICK

    def broken(self, scene: Scene) -> str | None:
        """The first answer that is another one before it was to be."""
        for vehicle in scene.fleet.vehicles:
            if vehicle.is_alive:
                found = _reference(vehicle) or _decision(vehicle) or _move(vehicle, scene.now_s) or _conclusion(vehicle)
                if found is not None:
                    return f"{found}, at {scene.now_s:g} s"
        return None


def _reference(vehicle: Vehicle) -> str | None:
    """The behaviour that guides gives another reference than the one that it said would hold."""
    layer = vehicle.functional
    held, behaviour = layer.held, layer.guiding
    if held is None or behaviour is None:
        return None
    to_go_m = distance_m(layer.believed, held.target_m)
    if to_go_m <= held.holds_m or (asked := behaviour.reference(layer.believed, layer.picture)) == held:
        return None
    return (
        f"{type(behaviour).__name__}.reference of {vehicle.name} said to hold to {held.holds_m:g} m from its target, "
        f"and {to_go_m:g} m from it answers {asked} in place of {held}"
    )


# What stands is asked again of the parts themselves: nothing in the program has a use for a second answer.


def _decision(vehicle: Vehicle) -> str | None:
    """The best combination of activities is another one; before the first decision nothing moves a vehicle."""
    executive = vehicle.executive
    if not any(executive.motivations):
        return None
    chosen = executive._choice.searched(executive.motivations)
    if chosen == executive.decision.chosen:
        return None
    return f"the decision of {vehicle.name} stands at sets {executive.decision.chosen}, and {chosen} are the best"


def _move(vehicle: Vehicle, now_s: float) -> str | None:
    """A copy of a negotiator that is not asked before there is news answers otherwise."""
    social = vehicle.social
    peers, negotiation = social._picture.peers, social._negotiation
    if social._is_news or peers.unheard or not negotiation.until_news:
        return None
    work = social._work({**peers.positions_m, social.me: vehicle.functional.believed.position_m}, now_s)
    for group, move in negotiation.until_news.items():
        about = work[group], negotiation._rally_m[group], (), peers.known_s, {}, {}, peers.links
        situation = Situation(now_s, negotiation._round + 1, *about)
        now = ask(negotiation._strategy, deepcopy(negotiation._negotiators[group]), situation)
        if now != move:
            return f"negotiate of {vehicle.name} for {group} said to stand until news, and answers {now} for {move}"
    return None


def _conclusion(vehicle: Vehicle) -> str | None:
    """A mission that has said that it concludes nothing before there is news concludes something."""
    conclusions, of = vehicle.social.conclusions, (vehicle.social.present, vehicle.functional.picture)
    found = conclusions._own(vehicle.data, *of, vehicle.functional.believed) if conclusions.holds(*of) else ()
    return f"conclusions of {vehicle.name} said to be none until news, and are {list(found)}" if found else None
