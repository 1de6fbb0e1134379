"""Invariants of run ends, motion, tables and independently read results."""

from __future__ import annotations

import itertools
import json
import math

from stress.invariants import TICK, Invariant, Scene
from stress.schedules import AWAY, WORK

from missions.runs.results import MODEM_KEYS
from missions.runs.tables import arrow_table
from missions.verification.folder import verify_run
from missions.verification.record import KINDS, CheckReport, Record, TableColumns
from remoras.motion.separation import SAME_DEPTH_M

# Ending -------------------------------------------------------------------------------------------

SENSES = WORK | {"random", "frozen"}
"""Kinds under which work may stay undone though nobody is to blame."""
LIES = frozenset({"forged", "forged-done", "bits", "cut"})


class NoException(Invariant):
    """No exception leaves a vehicle, except one that names a faulty plug-in."""

    name = "exceptions"


class Finishes(Invariant):
    """After transient faults, able survivors complete the mission within the bound."""

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
    """A run ends before its time bound, complete or not."""

    name = "ends"
    not_under = SENSES | LIES

    def broken(self, scene: Scene) -> str | None:
        """Check the end time, and vehicles that could have continued."""
        run, about, fleet = scene.finished, scene.schedule, scene.fleet
        if run is None or not about.must_end or run.completed or fleet.ended_s + fleet.tick_s <= fleet.duration_s:
            return None
        if not scene.in_contact() or _is_unheard_of(scene) or scene.was_parted:
            return None
        return f"goes on at {fleet.ended_s:g} s: {run.reason}"


def _is_unheard_of(scene: Scene) -> bool:
    """True if a vehicle stopped without the others knowing: the strategy sends nothing."""
    is_heard = any(vehicle.radio.is_heard for vehicle in scene.fleet.vehicles)
    return not is_heard and not all(vehicle.is_alive for vehicle in scene.fleet.vehicles)


# Motion -------------------------------------------------------------------------------------------

LEAST_SHARE = 0.5
"""Share of the separation that vehicles keep in any case; what is between is counted as a conflict."""


class SeparationKept(Invariant):
    """No two vehicles of one layer that were apart come nearer than half of the separation."""

    name = "separation"
    moment = TICK
    not_under = AWAY

    def __init__(self) -> None:
        self._apart: set[tuple[str, str]] = set()

    def broken(self, scene: Scene) -> str | None:
        """Check each pair; pairs not yet separated are still starting."""
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


# Results ------------------------------------------------------------------------------------------

DAMAGED, LATE = {"knowledge", "received", "acknowledged", "senders"}, {"arrivals", "knowledge", "senders"}
UNTOLD = {
    "bits": DAMAGED, "cut": DAMAGED, "forged": DAMAGED, "twice": LATE, "late": LATE, "forged-done": {"milestones"},
}  # fmt: skip
"""Checks of ``remoras verify`` that ask what no table tells under a kind of fault that no scenario declares."""
RELATIONS = {
    "acknowledgements", "choices", "deliveries", "facts", "links", "mapped", "peers", "plans", "reports", "requests",
    "satisfaction", "signals", "weights",
}  # fmt: skip
"""Its checks of what one table says by another, which take vehicles to hear what arrives and to say what is so."""


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
        untold |= RELATIONS if scene.schedule.kinds - KINDS else set()
        return next((str(finding) for finding in report.findings if finding.check not in untold), None)
