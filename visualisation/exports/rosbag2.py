"""rosbag2: a folder that ``ros2 bag play`` takes, with messages of ROS 2 alone, stored as MCAP.

Packets are messages of a type of our own, whose definition is in the bag. The same run gives the same bytes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.rosbag2.errors import WriterError

from visualisation.exports.formats import Counts
from visualisation.exports.stream import MAP, VEHICLE_M, PoseMessage, Shape, store_with, stream
from visualisation.exports.voyage import Entry, Voyage
from visualisation.output import ExportError

INFO, WARNING = 20, 30
STRIP, PAIRS, BOX, TEXT, ADD = 4, 5, 1, 9, 0
LINE_M, TEXT_M = 1.0, 10.0


def write(voyage: Voyage, target: Path) -> Counts:
    """Make a folder with ``metadata.yaml`` and one MCAP file; see ``formats.Writer``."""
    dialect = Ros2()
    counts: Counter[str] = Counter()
    connections: dict[str, Any] = {}
    try:
        bag = Writer(target, version=Writer.VERSION_LATEST, storage_plugin=StoragePlugin.MCAP)
        bag.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        with bag:
            for name, text in voyage.about.items():
                bag.set_custom_data(name, text)
            for time_ns, topic, kind, message in stream(voyage, dialect):
                if topic not in connections:
                    connections[topic] = bag.add_connection(topic, kind, typestore=dialect.store)
                bag.write(connections[topic], time_ns, dialect.store.serialize_cdr(message, kind))
                counts[topic] += 1
    except WriterError as error:
        raise ExportError(f"rosbag2: {error}") from None
    _rename(target)
    return dict(sorted(counts.items()))


def _rename(target: Path) -> None:
    """Give the storage a name that does not depend on where the folder was made."""
    (made,) = target.glob("*.mcap")
    metadata = target / "metadata.yaml"
    metadata.write_text(metadata.read_text(encoding="utf-8").replace(made.name, "run.mcap"), encoding="utf-8")
    made.rename(target / "run.mcap")


class Ros2:
    """The dialect of ROS 2; see ``stream.Dialect``."""

    def __init__(self) -> None:
        self.store = store_with({})
        types = self.store.types
        self._types = types
        self._time, self._duration = types["builtin_interfaces/msg/Time"], types["builtin_interfaces/msg/Duration"]
        self._point, self._vector = types["geometry_msgs/msg/Point"], types["geometry_msgs/msg/Vector3"]
        self._turn, self._pose = types["geometry_msgs/msg/Quaternion"], types["geometry_msgs/msg/Pose"]
        self._ids: dict[str, int] = {}
        self._unknown = np.zeros(9)

    def transforms(self, time_ns: int, poses: Sequence[tuple[str, PoseMessage]]) -> tuple[str, Any]:
        """See ``stream.Dialect``."""
        head = self._head(time_ns, MAP)
        of, whole = self._types["geometry_msgs/msg/TransformStamped"], self._types["geometry_msgs/msg/Transform"]
        made = [
            of(
                head, name,
                whole(
                    self._vector(pose.x_m, pose.y_m, pose.z_m), self._turn(0.0, 0.0, pose.turn_z, pose.turn_w)
                ),
            )
            for name, pose in poses
        ]  # fmt: skip
        return "tf2_msgs/msg/TFMessage", self._types["tf2_msgs/msg/TFMessage"](made)

    def pose(self, time_ns: int, pose: PoseMessage) -> tuple[str, Any]:
        """See ``stream.Dialect``."""
        kind = "geometry_msgs/msg/PoseStamped"
        return kind, self._types[kind](self._head(time_ns, MAP), self._placed(*pose))

    def fix(self, time_ns: int, frame: str, latitude_deg: float, longitude_deg: float, z_m: float) -> tuple[str, Any]:
        """See ``stream.Dialect``."""
        kind = "sensor_msgs/msg/NavSatFix"
        status = self._types["sensor_msgs/msg/NavSatStatus"](0, 1)
        head = self._head(time_ns, frame)
        return kind, self._types[kind](head, status, latitude_deg, longitude_deg, z_m, self._unknown, 0)

    def scene(self, time_ns: int, shapes: Sequence[Shape]) -> tuple[str, Any]:
        """See ``stream.Dialect``."""
        kind = "visualization_msgs/msg/MarkerArray"
        made = [self._marker(time_ns, shape) for shape in shapes if shape.points_m]
        return kind, self._types[kind](made)

    def log(self, time_ns: int, entry: Entry) -> tuple[str, Any]:
        """See ``stream.Dialect``."""
        kind = "rcl_interfaces/msg/Log"
        level = WARNING if entry.is_warning else INFO
        stamp = self._time(*divmod(time_ns, 10**9))
        return kind, self._types[kind](stamp, level, entry.about or "fleet", entry.text, "", "", 0)

    def _marker(self, time_ns: int, shape: Shape) -> Any:
        types = self._types
        points, where, scale = list(shape.points_m), (0.0, 0.0, 0.0), (LINE_M, 0.0, 0.0)
        kind = PAIRS
        if shape.kind == "loop":
            kind, points = STRIP, [*points, points[0]]
        elif shape.kind == "box":
            kind, where, points, scale = BOX, points[0], [], VEHICLE_M
        elif shape.kind == "text":
            kind, where, points, scale = TEXT, points[0], [], (0.0, 0.0, TEXT_M)
        picture = types["sensor_msgs/msg/CompressedImage"](self._head(0, ""), "", np.empty(0, dtype=np.uint8))
        mesh = types["visualization_msgs/msg/MeshFile"]("", np.empty(0, dtype=np.uint8))
        return types["visualization_msgs/msg/Marker"](
            self._head(time_ns, shape.frame), "remoras", self._ids.setdefault(shape.name, len(self._ids)), kind, ADD,
            self._placed(*where), self._vector(*scale), types["std_msgs/msg/ColorRGBA"](*shape.rgba),
            self._duration(*divmod(round(shape.lifetime_s * 1e9), 10**9)), True,
            [self._point(*point) for point in points], [], "", picture, [], shape.text, "", mesh, False,
        )  # fmt: skip

    def _placed(self, x_m: float, y_m: float, z_m: float, turn_z: float = 0.0, turn_w: float = 1.0) -> Any:
        return self._pose(self._point(x_m, y_m, z_m), self._turn(0.0, 0.0, turn_z, turn_w))

    def _head(self, time_ns: int, frame: str) -> Any:
        return self._types["std_msgs/msg/Header"](self._time(*divmod(time_ns, 10**9)), frame)
