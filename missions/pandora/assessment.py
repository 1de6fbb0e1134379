"""Status assessment: expected against observed outcome of an action; estimates for later.

Sequential tests (``missions.meeting.sequential_tests``) check the residuals of readings, in standard deviations:

====================  ========================================  ================  ==============
reading               expected                                  estimate          diagnosis
====================  ========================================  ================  ==============
speed, by the log     ``thrustShare`` of the requested speed    ``thrustShare``   thruster
current, by the log   forecast, plus ``flow``                   ``flow``          current
power consumption     hotel load and drag, plus ``extraPower``  ``extraPower``    energy
panel, by the camera  its place, plus ``cameraOffset``          ``cameraOffset``  camera drifts
====================  ========================================  ================  ==============

An alarm sets the estimate to the mean since the change, which is then the expectation. Estimates are facts and outlast
the action.
"""

from __future__ import annotations

import math

from exchange.arithmetic import distance, length, log
from missions.meeting.sequential_tests import Cusum
from missions.pandora.scenario import Flow, PandoraSettings
from missions.pandora.structure import CameraSettings, LogSettings, PlannedPart
from remoras.beliefs import Known
from remoras.database import HOME_MARGIN, VehicleData
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.sensor import Fact
from remoras.work import Point

POWER_SIGMA_W = 3.0  # standard deviation of power readings, which include packets and manoeuvres
STEADY_S = 10.0  # time after which a requested speed is reached
QUALITY_S = 60.0  # averaging time of the station-keeping quality
SPARE_MPS = 0.15  # margin over the current's speed for station keeping
SPARE_BATTERY = 0.03  # battery share in reserve, beyond the estimated use, for the way home
SOUND_SHARE, SOUND_FLOW_MPS, SOUND_W, SOUND_M = 0.05, 0.05, 5.0, 0.2
"""Deviations of estimates from plan below which the vehicle is sound."""

NOWHERE: Point = (0.0, 0.0)


class VectorTest:
    """Sequential test of readings of a vector, per axis, with standard deviation ``sigma``."""

    def __init__(self, alarm_at: float, sigma: float) -> None:
        self._axes, self._sigma = (Cusum(alarm_at), Cusum(alarm_at)), sigma

    def add(self, read: Point, planned: Point, known: Point) -> Point | None:
        """Add a reading with its plan and the known deviation; return the new deviation at an alarm, else None."""
        parts = zip(self._axes, read, planned, known, strict=True)
        offs = [axis.add((reads - plans - off) / self._sigma) for axis, reads, plans, off in parts]
        if offs == [None, None]:
            return None
        east, north = (was + (off or 0.0) * self._sigma for was, off in zip(known, offs, strict=True))
        return east, north


class ActionMonitor:
    """Assessment of one action of one vehicle; ``foretold`` None means still water."""

    def __init__(self, data: VehicleData, settings: PandoraSettings, part: PlannedPart, foretold: Flow | None) -> None:
        self._me, self._data, self._part, self._foretold = data.name, data, part, foretold
        self._log, self._camera = data.sensor(LogSettings), data.sensor(CameraSettings)
        self.quality = 1.0
        self._asked_mps, self._asked_s = 0.0, 0.0
        self._told_quality = 1.0
        self._images: tuple[int, float] | None = None  # number of the last, and time of its (first expected) arrival
        self._logged: int | None = None
        self._energy: tuple[float, float, float] | None = None  # used before a reading, expected since, time of it
        self._seen_s: float | None = None
        if self._log is not None:
            alarm = settings.alarm_at(self._log.every_s)
            self._speed, self._power, self._flow = Cusum(alarm), Cusum(alarm), VectorTest(alarm, self._log.sigma_mps)
        if self._camera is not None:
            self._off = VectorTest(settings.alarm_at(self._camera.every_s), self._camera.sigma_m)
            per_image = settings.false_alarms_per_h * self._camera.every_s / 3600.0
            blank = max(self._camera.p_blank, 1e-9)
            # n images in succession are blank with probability p_blank^n; the allowed rate of false alarms gives n.
            self._blind_after = max(3, math.ceil(log(per_image) / log(blank)))

    # Estimates -----------------------------------------------------------------------------------

    def hold_speed_mps(self, facts: Known, now_s: float, planned_mps: float, gain: float) -> float:
        """Speed to request for station keeping; ``gain`` is the increase after poor quality."""
        share: float = max(0.1, facts.get(("thrustShare", self._me), 1.0))
        wanted_mps = gain * max(planned_mps, self._flow_mps(facts, now_s) + SPARE_MPS) / share
        return min(self._data.transit_speed_mps, wanted_mps)

    def _flow_mps(self, facts: Known, now_s: float) -> float:
        (east_mps, north_mps), planned = facts.get(("flow", self._me), NOWHERE), self._planned_flow(now_s)
        return length(east_mps + planned[0], north_mps + planned[1])

    def is_overpowered(self, facts: Known, now_s: float) -> bool:
        """Return True if the estimated current exceeds the attainable speed."""
        share: float = facts.get(("thrustShare", self._me), 1.0)
        return self._flow_mps(facts, now_s) >= share * self._data.transit_speed_mps

    def corrected(self, facts: Known, seen_m: Point) -> Point:
        """Return an observed place, corrected by the camera offset."""
        off_m = facts.get(("cameraOffset", self._me), NOWHERE)
        return seen_m[0] - off_m[0], seen_m[1] - off_m[1]

    def _planned_flow(self, now_s: float) -> Point:
        return NOWHERE if self._foretold is None else self._foretold(self._data.depth_m, now_s)

    # Assessment ----------------------------------------------------------------------------------

    def pause(self) -> None:
        """Suspend the comparison while the action is not performed."""
        self._seen_s = self._energy = self._images = None

    def hold(self, off_m: float, tolerance_m: float, dt_s: float) -> None:
        """Update the station-keeping quality with the current offset."""
        weight = min(1.0, dt_s / QUALITY_S)
        self.quality += weight * ((1.0 if off_m <= tolerance_m else 0.0) - self.quality)

    def assess(self, motion: Motion, picture: Picture, asked_mps: float) -> list[Fact]:
        """Return new facts at a decision; ``asked_mps`` is the requested speed, 0 on station."""
        now_s, facts = picture.body.now_s, picture.facts
        # Avoidance changes the speed as well, so a contact restarts the wait for a steady speed.
        if asked_mps != self._asked_mps or picture.body.contacts_m:
            self._asked_mps, self._asked_s = asked_mps, now_s
        since_s = 0.0 if self._seen_s is None else now_s - self._seen_s
        self._seen_s = now_s
        if self._energy is not None:
            before_j, due_j, from_s = self._energy
            self._energy = before_j, due_j + self._data.power_w(motion.speed_mps) * since_s, from_s
        news: list[Fact] = []
        logged = facts.get(("logged", self._me))
        if self._log is not None and logged is not None and logged != self._logged:
            is_first, self._logged = self._logged is None, logged
            # The first reading may be older than the action.
            if not is_first:
                news += self._assess_log(motion, facts, now_s)
            self._energy = motion.energy_j, 0.0, now_s
        if self._camera is not None:
            news += self._assess_camera(motion, facts, now_s)
        if abs(self.quality - self._told_quality) >= 0.25:
            self._told_quality = self.quality
            news.append((self._me, "holdQuality", self.quality))
        return news

    def _assess_log(self, motion: Motion, facts: Known, now_s: float) -> list[Fact]:
        assert self._log is not None
        news: list[Fact] = []
        sigma_mps, me = self._log.sigma_mps, self._me
        if self._asked_mps > 0.0 and now_s - self._asked_s >= STEADY_S:
            share = facts.get(("thrustShare", me), 1.0)
            off = self._speed.add((facts.get(("speedMeasured", me)) - share * self._asked_mps) / sigma_mps)
            if off is not None:
                share = min(2.0, max(0.0, share + off * sigma_mps / self._asked_mps))
                news += _told(me, "thrustShare", share, "thruster", abs(share - 1.0) > SOUND_SHARE)
        estimate, measured = facts.get(("flow", me), NOWHERE), facts.get(("flowMeasured", me))
        flow = self._flow.add(measured, self._planned_flow(now_s), estimate)
        if flow is not None:
            news += _told(me, "flow", flow, "current", length(*flow) > SOUND_FLOW_MPS)
        return news + self._assess_power(motion, facts, now_s)

    def _assess_power(self, motion: Motion, facts: Known, now_s: float) -> list[Fact]:
        if self._energy is None or self._log is None:
            return []
        before_j, due_j, from_s = self._energy
        # The mean of a short interval is dominated by single packets and manoeuvres.
        if now_s - from_s < self._log.every_s / 2.0:
            return []
        extra_w = facts.get(("extraPower", self._me), 0.0)
        taken_w = (motion.energy_j - before_j - due_j) / (now_s - from_s)
        off = self._power.add((taken_w - extra_w) / POWER_SIGMA_W)
        if off is None:
            return []
        extra_w = max(-1000.0, extra_w + off * POWER_SIGMA_W)
        return _told(self._me, "extraPower", extra_w, "energy", extra_w > SOUND_W)

    def _assess_camera(self, motion: Motion, facts: Known, now_s: float) -> list[Fact]:
        assert self._camera is not None
        looks, me = facts.get(("looks", self._me), -1), self._me
        if self._images is None or looks != self._images[0]:
            is_new, self._images = self._images is not None, (looks, now_s)
            return self._assess_offset(motion, facts) if is_new else []
        if now_s - self._images[1] <= (self._blind_after + 1) * self._camera.every_s:
            return []
        if facts.get(("cameraDead", me)):
            return []
        return [(me, "cameraDead", True), (me, "diagnosis", "camera dead")]

    def _assess_offset(self, motion: Motion, facts: Known) -> list[Fact]:
        part, camera = self._part, self._camera
        assert camera is not None
        if part.panel_m is None or distance(part.panel_m, motion.position_m) > camera.range_m - 1.0:
            return []
        seen_m = facts.get(("seenAt", part.panel))
        if seen_m is None:
            return []
        known = facts.get(("cameraOffset", self._me), NOWHERE)
        offset = self._off.add(seen_m, part.panel_m, known)
        if offset is None:
            return []
        return _told(self._me, "cameraOffset", offset, "camera drifts", length(*offset) > SOUND_M)

    # Energy --------------------------------------------------------------------------------------

    def must_return(self, motion: Motion, facts: Known, battery: float) -> bool:
        """Return True if the way home needs the remaining battery, by estimated consumption."""
        extra_w = max(0.0, facts.get(("extraPower", self._me), 0.0))
        # At the planned consumption, the energy rule of all vehicles is right.
        if extra_w == 0.0:
            return False
        data = self._data
        speed_mps = max(0.05, data.survey_speed_mps * min(1.0, facts.get(("thrustShare", self._me), 1.0)))
        way_s = distance(motion.position_m, data.start_m) / speed_mps
        need_j = HOME_MARGIN * way_s * (data.power_w(speed_mps) + extra_w)
        return bool(battery <= SPARE_BATTERY + need_j / data.energy_j)


def _told(me: str, attribute: str, value: float | Point, diagnosis: str, is_wrong: bool) -> list[Fact]:
    return [(me, attribute, value), (me, "diagnosis", diagnosis if is_wrong else "sound")]
