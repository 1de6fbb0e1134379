"""Independent vehicles that survey an area: behaviour, sensor and knowledge, without a fleet."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from sample_vehicles import AUV
from watched import Facts

from missions.mapping.behaviours import WorkLeft, ZigzagExploring
from missions.mapping.jobs import SurveyJob, ground_of
from missions.mapping.sensors import Seabed, SwathSettings
from remoras.behaviours import Perception
from remoras.database import VehicleData
from remoras.motion import Motion, advance
from remoras.picture import Picture
from remoras.sensor import Pose
from remoras.work import Point

CORNERS_M = ((100.0, 100.0), (100.0, 350.0), (350.0, 350.0), (350.0, 100.0))
CELL_M = 25.0
JOB = SurveyJob("area", CORNERS_M, (), ground_of(CORNERS_M, CELL_M))
SEABED = Seabed.of_areas(CELL_M, {"area": CORNERS_M})


def mapper(name: str = "AUV00", swath_m: float = 25.0, **changes: Any) -> VehicleData:
    """A vehicle whose sensor has that swath."""
    sensor = SwathSettings(name="mapping", swath_m=swath_m, speed_limit_mps=1.25)
    return replace(AUV, name=name, sensors=(sensor,), **changes)


def cells_known(known: Sequence[int] = ()) -> Facts:
    """Knowledge of these cells as mapped."""
    return Facts(cells={"area": {float(index) for index in known}})  # as the world model has them


@dataclass
class Surveyor:
    """One vehicle at the area: ``covered`` are truly passed cells, ``claims`` is None for a sound sensor."""

    data: VehicleData
    facts: Facts
    at_m: Point = (0.0, 0.0)
    others: Sequence[str] = ()
    dead: bool = False
    covered: set[int] = field(default_factory=set)
    track: list[Point] = field(default_factory=list)
    last: Perception = field(default_factory=lambda: Perception(1.0))

    def __post_init__(self) -> None:
        self.exploring = ZigzagExploring(JOB, self.data, WorkLeft([JOB], 0.03), self.others)
        self.motion = Motion(*self.at_m)
        self.sensor = self.data.sensors[0].make(self.data)
        self.picture = Picture(facts=self.facts)
        self.picture.body.sensors_on = ("mapping",)
        self.rows: list[Point] = []

    def step(self, now_s: float) -> None:
        """One second: move, sense, and every other second perceive."""
        motion = self.motion
        if (reference := self.exploring.reference(motion, self.picture)) is not None:
            if not self.rows or self.rows[-1] != reference.target_m:
                self.rows.append(reference.target_m)
            advance(motion, self.data, reference.target_m, reference.speed_mps, 1.0)
        self.picture.body.now_s = now_s
        self.track.append(motion.position_m)
        pose = Pose(motion.x_m, motion.y_m, 20.0, motion.heading_rad, motion.speed_mps)
        found = [] if self.dead else self.sensor.sense(pose, SEABED, now_s)
        for observation in found:
            self.picture.body.yields_s[self.data.sensors[0].name] = now_s
            for _, _, index in observation.facts:
                self.covered.add(int(index))
                self.facts.cells["area"].add(float(index))
        if now_s % 2.0 == 0.0:
            self.last = self.exploring.perceive(motion, self.picture, True)
            self.picture.body.decided_s = now_s


def survey(*vehicles: Surveyor, until_s: float = 4000.0) -> float:
    """Let the vehicles survey until all are done or have failed; when that was."""
    now_s = 0.0
    for one in vehicles:
        one.picture.peers.positions_m |= {other.data.name: other.at_m for other in vehicles}
        one.last = one.exploring.perceive(one.motion, one.picture, False)
    while now_s < until_s and not all(one.last.done or one.last.failed for one in vehicles):
        now_s += 1.0
        for one in vehicles:
            if not (one.last.done or one.last.failed):
                one.step(now_s)
                for other in vehicles:
                    other.picture.peers.positions_m[one.data.name] = one.motion.position_m
    return now_s
