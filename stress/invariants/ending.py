"""Invariants of how a run ends: it is what its tables say, and the survivors finish."""

from __future__ import annotations

import math

from missions.fault import Danger
from remoras.contents import Content
from stress.invariants.motion import has_current
from stress.invariants.seam import Moment, Scene
from stress.kinds import ENDING

CLOSE = 1e-6
ROUNDED = {
    "energy_j": 0.006,
    "observations_per_min": 6e-5,
    "mean_latency_s": 6e-5,
    "p95_latency_s": 6e-5,
    "mission_time_s": 6e-5,
}
"""How far a figure may be off that the summary rounds: half a unit of its last place, and what sums are off."""
SENSES = frozenset({Danger.WORK, "random", "frozen"})
"""Kinds under which work may stay undone though nobody is to blame."""
LIES = frozenset({"forged", "forged-done", "bits", "cut"})


class NoException:
    """No exception leaves a vehicle, but for one that names the plug-in which broke its promise."""

    name = "exceptions"
    moment = Moment.END
    not_under = frozenset[str]()

    def broken(self, scene: Scene) -> str | None:
        """Nothing here: whoever steps the fleet sees what leaves it."""
        return None


class SameDigest:
    """The same schedule gives the same tables, byte for byte."""

    name = "repeats"
    moment = Moment.END
    not_under = frozenset[str]()

    def broken(self, scene: Scene) -> str | None:
        """Nothing here: whoever runs a schedule twice compares."""
        return None


class Finishes:
    """After what is transient has healed, the survivors complete the mission by the bound, if they are able to."""

    name = "finishes"
    moment = Moment.END
    not_under = SENSES | LIES | ENDING

    def broken(self, scene: Scene) -> str | None:
        """Look at the verdict."""
        run, about = scene.finished, scene.schedule.stress
        if run is None or not about.must_finish or run.completed or _is_unheard_of(scene) or scene.was_parted:
            return None
        if run.reachable_fraction < 1.0:  # the work is all of it, whoever is left: nobody may be able to do some of it
            return None
        return f"not complete by {about.bound_s:g} s, healed at {about.heal_s:g} s: {run.reason}"


class Ends:
    """A run is over before its bound, complete or not: nobody goes on for ever."""

    name = "ends"
    moment = Moment.END
    not_under = SENSES | LIES | ENDING

    def broken(self, scene: Scene) -> str | None:
        """Look at when the run ended, and at who could still have gone on."""
        run, about, fleet = scene.finished, scene.schedule.stress, scene.fleet
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


class TrueVerdict:
    """A mission counts as complete if, and only if, its goal is reached, and then there is no reason against it.

    What is within reach is no less than what is reached, and no more than all.
    """

    name = "verdict"
    moment = Moment.END
    not_under = frozenset[str]()

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


class SummaryOfTables:
    """The figures of the summary follow from the tables."""

    name = "summary"
    moment = Moment.END
    not_under = frozenset[str]()

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
