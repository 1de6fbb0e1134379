"""MCAP for Foxglove: its schemas in ROS 2 encoding, so that readers of ROS 2 read the file too.

A metadata record named ``remoras`` says what was run: version, key, seed, scenario. The same run gives the same bytes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import CompressionType, Writer

from visualisation.exports.formats import Counts
from visualisation.exports.foxglove import DEFINITIONS
from visualisation.exports.stream import LABEL_PX, MAP, VEHICLE_M, PoseMessage, Shape, store_with, stream
from visualisation.exports.voyage import Entry, Voyage

PACKAGE = "foxglove_msgs/msg/"
METADATA = "remoras"
INFO, WARNING = 2, 3
LOOP, PAIRS = 1, 2
LINE_PX = 2.0


def write(voyage: Voyage, target: Path) -> Counts:
    """Write one file; see ``formats.Writer``."""
    dialect = Foxglove()
    store = dialect.store
    counts: Counter[str] = Counter()
    channels: dict[str, int] = {}
    schemas: dict[str, int] = {}
    with target.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start(profile="ros2", library="remoras")
        for time_ns, topic, kind, message in stream(voyage, dialect):
            if (channel := channels.get(topic)) is None:
                if kind not in schemas:
                    text, _ = store.generate_msgdef(kind, ros_version=2)
                    schemas[kind] = writer.register_schema(kind, "ros2msg", text.encode())
                channel = channels[topic] = writer.register_channel(topic, "cdr", schemas[kind])
            data = bytes(store.serialize_cdr(message, kind))
            writer.add_message(channel, time_ns, data, time_ns, counts[topic])
            counts[topic] += 1
        writer.add_metadata(METADATA, voyage.about)
        writer.finish()  # type: ignore[no-untyped-call]
    return dict(sorted(counts.items()))


class Foxglove:
    """The dialect of Foxglove; see ``stream.Dialect``."""

    def __init__(self) -> None:
        self.store = store_with({f"{PACKAGE}{name}": text for name, text in DEFINITIONS.items()})
        types = self.store.types
        self._of = {name: types[f"{PACKAGE}{name}"] for name in DEFINITIONS}
        self._time, self._duration = types["builtin_interfaces/msg/Time"], types["builtin_interfaces/msg/Duration"]
        self._point, self._vector = types["geometry_msgs/msg/Point"], types["geometry_msgs/msg/Vector3"]
        self._turn, self._pose = types["geometry_msgs/msg/Quaternion"], types["geometry_msgs/msg/Pose"]
        self._last: tuple[int, Any] = (-1, None)
        self._unknown = np.zeros(9)
        self._none = np.empty(0, dtype=np.uint32)

    def transforms(self, time_ns: int, poses: Sequence[tuple[str, PoseMessage]]) -> tuple[str, Any]:
        """See ``stream.Dialect``."""
        stamp = self._stamp(time_ns)
        made = [
            self._of["FrameTransform"](
                stamp, MAP, name, self._vector(pose.x_m, pose.y_m, pose.z_m),
                self._turn(0.0, 0.0, pose.turn_z, pose.turn_w),
            )
            for name, pose in poses
        ]  # fmt: skip
        return f"{PACKAGE}FrameTransforms", self._of["FrameTransforms"](made)

    def pose(self, time_ns: int, pose: PoseMessage) -> tuple[str, Any]:
        """See ``stream.Dialect``."""
        return f"{PACKAGE}PoseInFrame", self._of["PoseInFrame"](self._stamp(time_ns), MAP, self._placed(*pose))

    def fix(self, time_ns: int, frame: str, latitude_deg: float, longitude_deg: float, z_m: float) -> tuple[str, Any]:
        """See ``stream.Dialect``."""
        made = self._of["LocationFix"](self._stamp(time_ns), frame, latitude_deg, longitude_deg, z_m, self._unknown, 0)
        return f"{PACKAGE}LocationFix", made

    def scene(self, time_ns: int, shapes: Sequence[Shape]) -> tuple[str, Any]:
        """See ``stream.Dialect``."""
        stamp = self._stamp(time_ns)
        return f"{PACKAGE}SceneUpdate", self._of["SceneUpdate"]([], [self._entity(stamp, shape) for shape in shapes])

    def log(self, time_ns: int, entry: Entry) -> tuple[str, Any]:
        """See ``stream.Dialect``."""
        level = WARNING if entry.is_warning else INFO
        made = self._of["Log"](self._stamp(time_ns), level, entry.text, entry.about or "fleet", "", 0)
        return f"{PACKAGE}Log", made

    def _entity(self, stamp: Any, shape: Shape) -> Any:
        colour = self._of["Color"](*shape.rgba)
        lifetime = self._duration(*divmod(round(shape.lifetime_s * 1e9), 10**9))
        cubes, lines, texts = [], [], []
        if shape.kind == "box":
            cubes = [self._of["CubePrimitive"](self._placed(*shape.points_m[0]), self._vector(*VEHICLE_M), colour)]
        elif shape.kind == "text":
            where = self._placed(*shape.points_m[0])
            texts = [self._of["TextPrimitive"](where, True, LABEL_PX, True, colour, shape.text)]
        elif shape.points_m:
            points = [self._point(*point) for point in shape.points_m]
            kind = LOOP if shape.kind == "loop" else PAIRS
            lines = [
                self._of["LinePrimitive"](
                    kind, self._placed(0.0, 0.0, 0.0), LINE_PX, True, points, colour, [], self._none
                )
            ]
        return self._of["SceneEntity"](
            stamp, shape.frame, shape.name, lifetime, True, [], [], cubes, [], [], lines, [], texts, []
        )

    def _placed(self, x_m: float, y_m: float, z_m: float, turn_z: float = 0.0, turn_w: float = 1.0) -> Any:
        return self._pose(self._point(x_m, y_m, z_m), self._turn(0.0, 0.0, turn_z, turn_w))

    def _stamp(self, time_ns: int) -> Any:
        if self._last[0] != time_ns:  # all messages of a tick have the same
            self._last = time_ns, self._time(*divmod(time_ns, 10**9))
        return self._last[1]
