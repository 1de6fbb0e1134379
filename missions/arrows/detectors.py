"""Detectors that sweep, acoustic and magnetic, and a camera; draws are keyed by seed, vehicle, cell, detector, number.

A detector observes a cell when it comes into range and every ``look_s`` while it stays there.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import ClassVar

from exchange.arithmetic import distance
from exchange.channel import loss
from missions.arrows.belief_map import (
    MOST_LOOKS,
    MOST_PASSES,
    N_DETECTORS,
    TILE,
    Seafloor,
    Thing,
    contact_code,
    swept_code,
)
from missions.arrows.scenario import DETECTORS, NOTHING
from remoras.beliefs import Known
from remoras.database import VehicleData
from remoras.recorder import TIME, VEHICLE, Column, Table
from remoras.sensor import SELF, Observation, Pose, Quiet, Sensor, SensorSettings, normal_error
from remoras.work import Point

CONTACTS = Table("contacts", (
    TIME, VEHICLE, Column("detector", "str"), Column("cell", "int"), Column("kind", "str"), Column("x_m", "float", "m"),
    Column("y_m", "float", "m"),
))  # fmt: skip
"""Detections: apparent place, and true content of the cell (nothing for a false alarm)."""
IMAGES = Table("images", (
    TIME, VEHICLE, Column("shown", "str"), Column("kind", "str"), Column("x_m", "float", "m"),
    Column("y_m", "float", "m"),
))  # fmt: skip
"""Apparent and true content of images."""
ANOMALY = "Anomaly"
SAME_M = 30.0  # distance within which a detection is associated with a known anomaly
LOOK_EVERY_S = 4.0
TOLD_AFTER_S = 40.0  # time without observation of a tile after which its empty cells are reported
STILL_MPS = 0.3
MOST_IMAGES = 64
FULL = (1 << TILE * TILE) - 1
DRAWS = 4  # draws per observation: detection, and place


def shown_code(n_image: int, node: int, kind: int) -> int:
    """Encode an image result below 2^15; ``kind`` 0 is nothing."""
    return (n_image % MOST_IMAGES * 64 + node % 64) * 8 + kind


def shown_of(code: int) -> int:
    """Decode the kind of an image result, 0 for nothing."""
    return code % 8


def unidentified(facts: Known) -> dict[str, Point]:
    """Return places of known anomalies, except identified ones and their namesakes nearby."""
    known = ((name, facts.get(("location", name))) for name in facts.instances(ANOMALY))
    places_m = {name: place_m for name, place_m in known if place_m is not None}
    done_m = [place_m for name, place_m in places_m.items() if facts.get(("identity", name)) is not None]
    return {
        name: place_m
        for name, place_m in places_m.items()
        if all(distance(place_m, other_m) > SAME_M for other_m in done_m)
    }


class DetectorSettings(SensorSettings):
    """Table ``[vehicle.sensor]`` of a sweeping detector; ``[detector]`` has its parameters."""

    NUMBER: ClassVar[int]

    def make(self, data: VehicleData) -> Sensor:
        return Detector(self.NUMBER, data)


class AcousticSettings(DetectorSettings):
    """Side-scan sonar."""

    EQUIPMENT, NUMBER = "SideScanSonar", 0


class MagneticSettings(DetectorSettings):
    """Magnetometer."""

    EQUIPMENT, NUMBER = "Magnetometer", 1


class Detector:
    """Sweeping detector: each observation of a cell detects something or not."""

    table = CONTACTS

    def __init__(self, number: int, data: VehicleData) -> None:
        self._number, self._vehicle, self._node = number, data.name, data.node
        self._awake_s = 0.0
        self._next_s: dict[int, float] = {}
        self._n_looks: Counter[int] = Counter()
        self._n_passes: Counter[int] = Counter()
        self._empty: dict[int, tuple[int, float]] = {}  # by tile: cells, time of the last observation

    def sense(self, pose: Pose, world: Seafloor, now_s: float) -> Sequence[Observation]:
        """Return detections and completed passes over tiles."""
        if now_s < self._awake_s:
            return Quiet(until_s=self._awake_s)
        self._awake_s = now_s + LOOK_EVERY_S
        settings, observations = getattr(world.scenario.detector, DETECTORS[self._number]), list[Observation]()
        for cell in world.grid.near((pose.x_m, pose.y_m), settings.range_m):
            if now_s < self._next_s.get(cell, 0.0) or self._n_looks[cell] >= MOST_LOOKS:
                continue
            self._next_s[cell] = now_s + settings.look_s
            at_m = world.grid.centre_m(cell)
            claimed = world.grid.cell_at((at_m[0] + pose.error_m[0], at_m[1] + pose.error_m[1]))
            observations += self._look(cell, claimed, pose, world, now_s, settings.sigma_m)
            self._n_looks[cell] += 1
        over = [tile for tile, (_, last_s) in self._empty.items() if now_s - last_s > TOLD_AFTER_S]
        return [*observations, *(observation for tile in over for observation in self._tell(tile))]

    def _look(
        self, cell: int, claimed: int | None, pose: Pose, world: Seafloor, now_s: float, sigma_m: float
    ) -> list[Observation]:
        thing, n_look = world.things.get(cell), self._n_looks[cell]
        first = (cell * N_DETECTORS + self._number) * DRAWS
        chance, east, north = (loss.uniform(world.seed, loss.LOOKS, n_look, self._node, first + n) for n in range(3))
        # Outside of the area by its own belief, the vehicle has no cell to report.
        if claimed is None:
            return []
        if chance >= world.rates[self._number, 0 if thing is None else thing.kind]:
            return self._note_empty(world, claimed, now_s)
        x_m, y_m = _seen_m(thing, cell, world, (east, north), sigma_m)
        seen_m = x_m + pose.error_m[0], y_m + pose.error_m[1]
        contact = self._vehicle, "contact", contact_code(n_look, self._number, claimed)
        row = DETECTORS[self._number], cell, NOTHING if thing is None else thing.name, *seen_m
        return [Observation((pose.located(seen_m, sigma_m), contact), row, ANOMALY, SAME_M)]

    def _note_empty(self, world: Seafloor, cell: int, now_s: float) -> list[Observation]:
        tile, bit = world.grid.tile_of(cell)
        # A second empty observation of a cell begins another pass over its tile.
        reported = self._tell(tile) if self._empty.get(tile, (0, 0.0))[0] >> bit & 1 else []
        mask = self._empty.get(tile, (0, 0.0))[0] | 1 << bit
        self._empty[tile] = mask, now_s
        return [*reported, *(self._tell(tile) if mask == FULL else [])]

    def _tell(self, tile: int) -> list[Observation]:
        mask, _ = self._empty.pop(tile)
        n_pass = self._n_passes[tile]
        self._n_passes[tile] += 1
        if n_pass >= MOST_PASSES:
            return []
        return [Observation(((self._vehicle, "swept", swept_code(n_pass, self._number, tile, mask)),))]


def _seen_m(thing: Thing | None, cell: int, world: Seafloor, shares: Point, sigma_m: float) -> Point:
    if thing is None:
        x_m, y_m = world.grid.centre_m(cell)
        return x_m + (shares[0] - 0.5) * world.grid.cell_m, y_m + (shares[1] - 0.5) * world.grid.cell_m
    east_m, north_m = (sigma_m * normal_error(share) for share in shares)
    return thing.position_m[0] + east_m, thing.position_m[1] + north_m


class ClassifyingCameraSettings(SensorSettings):
    """Table ``[vehicle.sensor]`` of a camera; ``[detector.optical]`` has its parameters."""

    EQUIPMENT: ClassVar[str] = "Camera"

    def make(self, data: VehicleData) -> Sensor:
        return ClassifyingCamera(data)


class ClassifyingCamera:
    """Camera: images of the nearest thing while the vehicle is still, with random errors."""

    table = IMAGES

    def __init__(self, data: VehicleData) -> None:
        self._node, self._next_s, self._n_images = data.node, 0.0, 0

    def sense(self, pose: Pose, world: Seafloor, now_s: float) -> Sequence[Observation]:
        """Return the content of an image, if scheduled."""
        settings = world.scenario.detector.optical
        if now_s < self._next_s:
            return Quiet(until_s=self._next_s)
        if pose.ground_mps > STILL_MPS:
            return []
        self._next_s, number = now_s + settings.look_s, self._n_images
        self._n_images += 1
        at_m = pose.x_m, pose.y_m
        around = (
            world.things[cell]
            # Things lie off the centre of their cell, hence the margin.
            for cell in world.grid.near(at_m, settings.range_m + world.grid.cell_m)
            if cell in world.things
        )
        thing = min(around, key=lambda thing: distance(thing.position_m, at_m), default=None)
        if thing is not None and distance(thing.position_m, at_m) > settings.range_m:
            thing = None
        right, which, east, north = (loss.uniform(world.seed, loss.MISSES, number, self._node, n) for n in range(4))
        really = 0 if thing is None else thing.kind
        others = [kind for kind in range(1 + len(world.scenario.kinds)) if kind != really]
        shown = really if right >= settings.p_false or not others else others[int(which * len(others))]
        if thing is None:
            seen_m = pose.believed_m
        else:
            x_m, y_m = _seen_m(thing, 0, world, (east, north), settings.sigma_m)
            seen_m = x_m + pose.error_m[0], y_m + pose.error_m[1]
        names = world.scenario.names
        facts = pose.located(seen_m, settings.sigma_m), (SELF, "shown", shown_code(number, self._node, shown))
        return [Observation(facts, (names[shown], names[really], *seen_m), ANOMALY, SAME_M)]
