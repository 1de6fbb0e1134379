"""What befell the vehicles, the water and the structure in a run, and what the vehicles made of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

from missions.metric import MeasuredRun
from missions.pandora.truth import MET
from remoras.faults import OVER

if TYPE_CHECKING:
    from missions.pandora.scenario import PandoraScenario

FAULTS = {"slow": "thruster", "sensor": "camera dead", "biased": "camera drifts", "drains": "energy"}
"""What is to be diagnosed of vehicles, by kind of fault."""
UPSETS = {"moved": ("missing", "displaced"), "turned": ("turned",), "stuck": ("resists",)}
"""Anomalies that say what is upset, by kind of upset."""
CURRENT = "current"
OF_CAMERAS = "camera"
"""Faults of other sensors are not what this mission assesses."""
AFTER_S = 1200.0
"""A finding this long after its cause has ended is still owed to it: the estimate goes back step by step."""


@dataclass(frozen=True, slots=True)
class SiteEvent:
    """Something that befell a vehicle, a part or, with an empty subject, the water.

    Attributes:
        kind: of fault or upset, or current.
        subject: whom it befell.
        findings: that say so.
        from_s, until_s: while it held; an upset begins when a vehicle that works there comes near.
    """

    kind: str
    subject: str
    findings: tuple[str, ...]
    from_s: float
    until_s: float = math.inf


@dataclass(frozen=True, slots=True)
class Found:
    """A finding: which vehicle said when that a subject has what."""

    time_s: float
    vehicle: str
    subject: str
    finding: str


def events_of(run: MeasuredRun) -> list[SiteEvent]:
    """What befell a run, in the order in which it began."""
    found = [
        SiteEvent(kind, part, UPSETS[kind], time_s)
        for time_s, _, part, kind in run.recorder.rows(MET.name)
    ]  # fmt: skip
    begun: dict[tuple[str, str], float] = {}
    for time_s, vehicle, kind, detail in run.recorder.rows("faults"):
        if kind not in FAULTS or (kind in ("sensor", "biased") and not detail.startswith((OF_CAMERAS, OVER))):
            continue
        if not detail.startswith(OVER):
            begun[vehicle, kind] = time_s
        elif (vehicle, kind) in begun:
            found.append(SiteEvent(kind, vehicle, (FAULTS[kind],), begun.pop((vehicle, kind)), time_s))
    found += [SiteEvent(kind, vehicle, (FAULTS[kind],), from_s) for (vehicle, kind), from_s in begun.items()]
    scenario = cast("PandoraScenario", run.scenario)
    for surge in scenario.surges(run.seed):
        if surge.from_s < _last_s(run):
            found.append(SiteEvent(CURRENT, "", (CURRENT,), surge.from_s, surge.until_s))
    return sorted(found, key=lambda event: (event.from_s, event.kind, event.subject))


def _last_s(run: MeasuredRun) -> float:
    rows = run.recorder.rows("trajectories")
    return float(rows[-1][0]) if rows else 0.0


def findings_of(run: MeasuredRun) -> Iterator[Found]:
    """What vehicles found, in the order in which they did; that all is well again is none."""
    for _, origin, _, recorded_s, subject, attribute, value, *_ in run.recorder.rows("items"):
        if attribute in ("diagnosis", "anomaly") and value != "sound":
            yield Found(recorded_s, origin, subject, value)


def is_of(found: Found, event: SiteEvent) -> bool:
    """True if a finding says what an event is."""
    if found.finding not in event.findings or (event.subject and found.subject != event.subject):
        return False
    return event.from_s <= found.time_s <= event.until_s + AFTER_S


def detected_s(event: SiteEvent, found: list[Found]) -> float | None:
    """How long after its begin an event was first found; None if it was not."""
    first = next((row for row in found if is_of(row, event)), None)
    return None if first is None else first.time_s - event.from_s
