"""Ground truth of the mission: found and identified sites, and progress of the maps."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence

from exchange.arithmetic import distance
from missions.arrows.belief_map import CONTACT, SWEPT, Chart, Seafloor, disagreement, divergence
from missions.arrows.detectors import CONTACTS, SAME_M, ClassifyingCameraSettings, DetectorSettings
from missions.arrows.scenario import NOTHING, SITES, ArrowsScenario
from missions.meeting.meeting import Meeting
from missions.meeting.truth import JobTruth
from remoras.mission import FleetView, Milestone
from remoras.recorder import TIME, VEHICLE, Column, Recorder, Table, Unread
from remoras.truth import left
from remoras.work import Point

IDENTIFIED = Table("identified", (
    TIME, VEHICLE, Column("anomaly", "str"), Column("identity", "str"), Column("p", "float", "1"),
    Column("kind", "str"), Column("x_m", "float", "m"), Column("y_m", "float", "m"),
))  # fmt: skip
"""Identifications with probability, and the true content."""
MAPS = Table("maps", (TIME, VEHICLE, Column("told_bits", "float", "bit"), Column("missing_bits", "float", "bit")))
"""Known information (divergence from the prior) and distance to the joint map, per vehicle."""
FLEET_MAPS = Table("fleet_maps", (TIME, Column("told_bits", "float", "bit"), Column("apart_bits", "float", "bit")))
"""Information of all observations, and distance between the vehicles' maps (Jensen-Shannon)."""
MAP_EVERY_S = 120.0
Look = tuple[float, str, int]
"""Time of knowledge, attribute, code."""


def looks_known(recorder: Recorder, vehicles: Sequence[str]) -> dict[str, list[Look]]:
    """Observations known to each vehicle by time of knowledge; under ``""`` all by creation."""
    looks: dict[str, list[tuple[str, int]]] = {}
    known: dict[str, list[Look]] = {name: [] for name in ("", *vehicles)}
    for uid, origin, _, recorded_s, _, attribute, value, kind, _ in recorder.items:
        if attribute in (SWEPT, CONTACT):
            look = attribute, int(float(value))
            looks.setdefault(uid, []).append(look)
            known[""].append((recorded_s, *look))
            if kind == "kept":  # private observations are known to their origin
                known[origin].append((recorded_s, *look))
    for time_s, vehicle, uid, _, event in recorder.rows("knowledge"):
        if event in ("observed", "received") and uid in looks:
            known[vehicle] += [(time_s, *look) for look in looks[uid]]
    return {name: sorted(of) for name, of in known.items()}


class ArrowsTruth(JobTruth):
    """Referee of a run; ``chart`` creates a map of the prior."""

    work = "identify what lies there"
    ends_with_meeting = True

    def __init__(
        self,
        meeting: Meeting,
        scenario: ArrowsScenario,
        recorder: Recorder,
        seafloor: Seafloor,
        chart: Callable[[], Chart],
        vehicles: Sequence[str],
    ) -> None:
        super().__init__(meeting, "", recorder)
        self._scenario, self._seafloor, self._recorder = scenario, seafloor, recorder
        self._chart, self._vehicles = chart, vehicles
        self._contacts, self._identified_rows = Unread(recorder.rows(CONTACTS.name)), recorder.rows(IDENTIFIED.name)
        self._statements = Unread(recorder.items)
        self._places_m: dict[str, Point] = {}
        self._sites = {cell for cell, thing in seafloor.things.items() if thing.name in SITES}
        self._found: set[int] = set()
        self._identified: set[int] = set()

    @property
    def goal_fraction(self) -> float:
        """Correctly identified sites as share of the required number."""
        return self._share(len(self._identified))

    def _share(self, n_identified: int) -> float:
        if not self._sites:
            return 1.0
        return min(1.0, n_identified / (self._scenario.mission.goal * len(self._sites)))

    def reachable_fraction(self, fleet: FleetView) -> float:
        """Share of the goal reachable with the remaining detectors and cameras."""
        carried = [sensor for _, data in left(fleet) for sensor in data.sensors]
        if not any(isinstance(settings, ClassifyingCameraSettings) for settings in carried):
            return self.goal_fraction
        is_searched = any(isinstance(settings, DetectorSettings) for settings in carried)
        return self._share(len(self._sites if is_searched else self._found | self._identified))

    def out_of_reach(self, fleet: FleetView) -> Sequence[str]:
        """Empty: sites have no names."""
        return ()

    def watch(self, fleet: FleetView, now_s: float) -> None:
        """Record detections and identifications since the last call."""
        for time_s, vehicle, _, cell, kind, _, _ in self._contacts:
            if kind in SITES and cell not in self._found:
                self._found.add(cell)
                self.milestones.append(Milestone(time_s, "site_found", vehicle))
        for _, origin, _, recorded_s, subject, attribute, value, _, uncertainty in self._statements:
            if attribute == "location":
                x_m, y_m = (float(part) for part in value.removeprefix("POINT (").removesuffix(")").split())
                self._places_m[subject] = x_m, y_m
            elif attribute == "identity" and subject in self._places_m:
                self._note_identity(recorded_s, origin, subject, value, float(uncertainty or 0.0))

    def _note_identity(self, time_s: float, vehicle: str, anomaly: str, identity: str, p: float) -> None:
        at_m = self._places_m[anomaly]
        near = [
            (distance(at_m, thing.position_m), cell, thing.name)
            for cell, thing in self._seafloor.things.items()
            if distance(at_m, thing.position_m) <= SAME_M
        ]
        _, cell, kind = min(near, default=(0.0, -1, NOTHING))
        self._identified_rows.append((time_s, vehicle, anomaly, identity, p, kind, *at_m))
        if identity == kind and cell in self._sites and cell not in self._identified:
            self._identified.add(cell)
            self.milestones.append(Milestone(time_s, "site_identified", vehicle))

    def close(self, fleet: FleetView, now_s: float) -> str:
        """Compute the maps of all times; return the reason of failure."""
        self._note_maps(now_s)
        reason = super().close(fleet, now_s)
        if self.goal_fraction >= 1.0:
            return reason
        missing = f"{len(self._identified)} of {len(self._sites)} sites identified"
        return f"{reason}; {missing}" if reason else missing

    def _note_maps(self, now_s: float) -> None:
        known = looks_known(self._recorder, self._vehicles)
        charts = {name: self._chart() for name in known}
        placed = dict.fromkeys(known, 0)
        maps, fleet_maps = self._recorder.rows(MAPS.name), self._recorder.rows(FLEET_MAPS.name)
        prior = charts[""].prior
        for number in range(int(now_s // MAP_EVERY_S) + 1):
            at_s = number * MAP_EVERY_S
            for name, looks in known.items():
                end = bisect_right(looks, at_s, key=lambda look: look[0])
                for _, attribute, code in looks[placed[name] : end]:
                    charts[name].add(attribute, (code,))
                placed[name] = end
            whole = charts[""].shares
            own = [charts[name].shares for name in self._vehicles]
            fleet_maps.append((at_s, divergence(whole, prior), disagreement(own)))
            for name, shares in zip(self._vehicles, own, strict=True):
                maps.append((at_s, name, divergence(shares, prior), disagreement([shares, whole])))
