"""MCAP export for Foxglove, in ROS 2 encoding, so that ROS 2 readers work too.

Frame ``map`` has x east, y north, z up from the surface. Each vehicle has a frame, x forward and y to port, named like
its topics: vehicle ``AUV00`` has ``/auv00/pose``. Time is mission time from 0. Output is reproducible byte by byte.

=================  ============================================  ===============================
topic              content                                       time
=================  ============================================  ===============================
/tf                frames of all vehicles in ``map``             at every motion tick
/auvN/pose         true pose of a vehicle                        at every motion tick
/auvN/fix          latitude, longitude, height                   likewise, if there is a datum
/auvN/role         active roles, as one text                     at 0 s and at every change
/scene             places and vehicles; each packet's links      at 0 s; at each transmission
/packets           content and receivers of each packet          at each transmission
/log               milestones, roles, faults, missed peers       as they occur
=================  ============================================  ===============================

Metadata record ``remoras``: version, key, seed, scenario.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from heapq import merge
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from mcap.writer import CompressionType, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from visualisation import style
from visualisation.exports import Counts
from visualisation.exports.voyage import Voyage
from visualisation.run_records import Floats, Track

if TYPE_CHECKING:
    from missions.runs.reader import RunReader

MAP = "map"
PACKAGE = "foxglove_msgs/msg/"
METADATA = "remoras"
STRING = "std_msgs/msg/String"
COMMON_TYPES = (
    STRING, "builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration", "geometry_msgs/msg/Point",
    "geometry_msgs/msg/Vector3", "geometry_msgs/msg/Quaternion", "geometry_msgs/msg/Pose",
)  # fmt: skip
PACKET = "remoras_msgs/msg/Packet"
PACKET_FIELDS = ("slot", "sender", "size_bits", "items", "acks", "receivers", "lost_by")
TYPES = "messages.msg"
"""Definitions of the packet and of ``foxglove_msgs``, embedded in the output; Foxglove requires these names."""

INFO, WARNING = 2, 3
LOOP, PAIRS = 1, 2
LINE_PX = 2.0
HEARD, LOST = style.GREEN, style.VERMILLION
LINK_S = 1.5  # display time of packet links
VEHICLE_M = (6.0, 2.0, 2.0)  # length, width and height of a vehicle in the scene, enlarged for visibility at 1 km
LABEL_PX, LABEL_UP_M = 14.0, 6.0
NS_PER_S = 1_000_000_000

PointM = tuple[float, float, float]  # x east, y north, z up


class Pose(NamedTuple):
    """Position, z up, and heading quaternion about z."""

    x_m: float
    y_m: float
    z_m: float
    turn_z: float
    turn_w: float


class Sent(NamedTuple):
    """Message of a topic."""

    time_ns: int
    topic: str
    kind: str
    message: Any


def write(voyage: Voyage, target: Path) -> Counts:
    """Write one file; see ``Writer``."""
    messages = _Messages(voyage)
    counts: Counter[str] = Counter()
    channels: dict[str, int] = {}
    schemas: dict[str, int] = {}
    with target.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start(profile="ros2", library="remoras")
        streams = messages.motion(), messages.events(), messages.scenes()
        # Schemas and channels are registered at their first message, so that the file lists only topics with content.
        for time_ns, topic, kind, message in merge(*streams, key=lambda sent: sent.time_ns):
            if (channel := channels.get(topic)) is None:
                if kind not in schemas:
                    text, _ = messages.store.generate_msgdef(kind, ros_version=2)
                    schemas[kind] = writer.register_schema(kind, "ros2msg", text.encode())
                channel = channels[topic] = writer.register_channel(topic, "cdr", schemas[kind])
            data = bytes(messages.store.serialize_cdr(message, kind))
            # Mission time is also the log time: the wall clock would make each file different.
            writer.add_message(channel, time_ns, data, time_ns, counts[topic])
            counts[topic] += 1
        writer.add_metadata(METADATA, voyage.about)
        writer.finish()  # type: ignore[no-untyped-call]
    return dict(sorted(counts.items()))


def topic_names(vehicles: Iterable[str]) -> dict[str, str]:
    r"""Return unique ROS names (lower-case letters, digits, ``_``) for topics and frames.

    >>> topic_names(["AUV00", "auv00", "7 seas", "\U0001f420"])
    {'AUV00': 'auv00', 'auv00': 'auv00_2', '7 seas': 'v7_seas', '\U0001f420': 'vehicle'}
    """
    topics: dict[str, str] = {}
    for vehicle in vehicles:
        stem = re.sub(r"[^a-z0-9]+", "_", vehicle.lower()).strip("_") or "vehicle"
        # ROS names must not begin with a digit.
        stem = f"v{stem}" if stem[0].isdigit() else stem
        name, number = stem, 2
        while name in topics.values():
            name, number = f"{stem}_{number}", number + 1
        topics[vehicle] = name
    return topics


def nanoseconds(time_s: float) -> int:
    """Convert mission time to nanoseconds; negative times become 0."""
    return max(0, round(time_s * NS_PER_S))


class _Messages:
    def __init__(self, voyage: Voyage) -> None:
        self._voyage = voyage
        self._names = topic_names(voyage.vehicles)
        self.store = get_typestore(Stores.ROS2_JAZZY)
        types = get_types_from_msg((Path(__file__).parent / TYPES).read_text(encoding="utf-8"), PACKET)
        self.store.register(types)
        self._of = {name.rpartition("/")[2]: self.store.types[name] for name in (*types, *COMMON_TYPES)}

    def motion(self) -> Iterator[Sent]:
        poses: dict[int, list[tuple[str, Pose, tuple[float, float] | None]]] = {}
        for vehicle, track in self._voyage.tracks.items():
            fixes: Sequence[tuple[float, float] | None] = [None] * track.time_s.size
            if self._voyage.datum is not None:
                latitudes, longitudes = self._voyage.datum.degrees(track.x_m, track.y_m)
                fixes = list(zip(latitudes.tolist(), longitudes.tolist(), strict=True))
            for time_s, pose, fix in zip(track.time_s.tolist(), _poses(track), fixes, strict=True):
                poses.setdefault(nanoseconds(time_s), []).append((self._names[vehicle], pose, fix))
        unknown = np.zeros(9)
        for time_ns in sorted(poses):
            stamp = self._stamp(time_ns)
            frames = [
                self._of["FrameTransform"](
                    stamp, MAP, name, self._of["Vector3"](pose.x_m, pose.y_m, pose.z_m),
                    self._of["Quaternion"](0.0, 0.0, pose.turn_z, pose.turn_w),
                )
                for name, pose, _ in poses[time_ns]
            ]  # fmt: skip
            yield self._sent(time_ns, "/tf", "FrameTransforms", frames)
            for name, pose, fix in poses[time_ns]:
                yield self._sent(time_ns, f"/{name}/pose", "PoseInFrame", stamp, MAP, self._placed(*pose))
                if fix is not None:
                    yield self._sent(time_ns, f"/{name}/fix", "LocationFix", stamp, name, *fix, pose.z_m, unknown, 0)

    def events(self) -> Iterator[Sent]:
        queue = []
        for state in self._voyage.states:
            topic = f"/{self._names[state.vehicle]}/role"
            queue.append(Sent(nanoseconds(state.time_s), topic, STRING, self._of["String"](data=state.text)))
        for packet in self._voyage.results.rows("packets"):
            start_ns, end_ns = nanoseconds(packet["time_s"]), nanoseconds(packet["end_s"])
            content = [packet[name] for name in PACKET_FIELDS]
            message = self._of["Packet"](self._stamp(start_ns), self._stamp(end_ns), *content)
            queue.append(Sent(start_ns, "/packets", PACKET, message))
        for time_s, level, actor, text in sorted(_log(self._voyage.results), key=itemgetter(0)):
            time_ns = nanoseconds(time_s)
            queue.append(self._sent(time_ns, "/log", "Log", self._stamp(time_ns), level, text, actor or "fleet", "", 0))
        return iter(sorted(queue, key=lambda sent: sent.time_ns))

    def scenes(self) -> Iterator[Sent]:
        yield self._sent(0, "/scene", "SceneUpdate", [], [*self._places(), *self._vehicles()])
        tracks = self._voyage.tracks
        packets = [packet for packet in self._voyage.results.rows("packets") if packet["sender"] in tracks]
        times_s = [packet["time_s"] for packet in packets]
        points = {
            vehicle: [(x_m, y_m, 0.0 - depth_m) for x_m, y_m, depth_m in track.at(*times_s)]
            for vehicle, track in tracks.items()
        }
        for number, packet in enumerate(packets):
            where = {vehicle: along[number] for vehicle, along in points.items()}
            yield self._sent(nanoseconds(packet["time_s"]), "/scene", "SceneUpdate", [], self._links(where, packet))

    def _places(self) -> Iterator[Any]:
        for place in self._voyage.places:
            corners = [(x_m, y_m, 0.0) for x_m, y_m in place.outline_m]
            name = f"{place.kind} {place.name}"
            if len(corners) > 1:
                yield self._entity(0, MAP, f"{name} outline", style.GREY, "loop", corners)
            middle = (
                math.fsum(x for x, _, _ in corners) / len(corners),
                math.fsum(y for _, y, _ in corners) / len(corners),
                0.0,
            )
            yield self._entity(0, MAP, name, style.GREY, "text", [middle], place.name)

    def _vehicles(self) -> Iterator[Any]:
        for number, vehicle in enumerate(self._voyage.vehicles):
            if vehicle in self._voyage.tracks:
                name, colour = self._names[vehicle], style.vehicle_look(number).colour
                yield self._entity(0, name, f"{name} hull", colour, "box", [(0.0, 0.0, 0.0)])
                yield self._entity(0, name, name, colour, "text", [(0.0, 0.0, LABEL_UP_M)], vehicle)

    def _links(self, where: Mapping[str, PointM], packet: Mapping[str, Any]) -> list[Any]:
        start, name = where[packet["sender"]], self._names[packet["sender"]]
        ends = [where[receiver] for receiver in packet["receivers"] if receiver in where]
        broken = [where[v] for v in packet["lost_by"] if v in where]
        halves = [((start[0] + x) / 2.0, (start[1] + y) / 2.0, (start[2] + z) / 2.0) for x, y, z in broken]
        time_ns = nanoseconds(packet["time_s"])
        return [
            self._entity(
                time_ns, MAP, f"{name} {outcome}", colour, "pairs", [p for end in to for p in (start, end)], "", LINK_S
            )
            for outcome, to, colour in (("heard", ends, HEARD), ("lost", halves, LOST))
        ]

    def _entity(
        self, time_ns: int, frame: str, name: str, colour: str, shape: str, points_m: Sequence[PointM], text: str = "",
        lifetime_s: float = 0.0,
    ) -> Any:  # fmt: skip
        """Return a ``loop``, ``pairs`` of points, ``box`` or ``text``; it replaces an entity of equal name."""
        rgba = self._of["Color"](*(int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)), 1.0)
        lifetime = self._of["Duration"](*divmod(round(lifetime_s * 1e9), NS_PER_S))
        cubes, lines, texts = [], [], []
        if shape == "box":
            cubes = [self._of["CubePrimitive"](self._placed(*points_m[0]), self._of["Vector3"](*VEHICLE_M), rgba)]
        elif shape == "text":
            texts = [self._of["TextPrimitive"](self._placed(*points_m[0]), True, LABEL_PX, True, rgba, text)]
        elif points_m:
            kind, points = LOOP if shape == "loop" else PAIRS, [self._of["Point"](*point) for point in points_m]
            origin, none = self._placed(0.0, 0.0, 0.0), np.empty(0, dtype=np.uint32)
            lines = [self._of["LinePrimitive"](kind, origin, LINE_PX, True, points, rgba, [], none)]
        return self._of["SceneEntity"](
            self._stamp(time_ns), frame, name, lifetime, True, [], [], cubes, [], [], lines, [], texts, []
        )

    def _sent(self, time_ns: int, topic: str, kind: str, *fields: Any) -> Sent:
        return Sent(time_ns, topic, f"{PACKAGE}{kind}", self._of[kind](*fields))

    def _placed(self, x_m: float, y_m: float, z_m: float, turn_z: float = 0.0, turn_w: float = 1.0) -> Any:
        return self._of["Pose"](self._of["Point"](x_m, y_m, z_m), self._of["Quaternion"](0.0, 0.0, turn_z, turn_w))

    def _stamp(self, time_ns: int) -> Any:
        return self._of["Time"](*divmod(time_ns, NS_PER_S))


def _poses(track: Track) -> list[Pose]:
    turns: Floats = track.heading_rad / 2.0
    columns = (track.x_m, track.y_m, 0.0 - track.depth_m, np.sin(turns), np.cos(turns))
    return [Pose(*row) for row in zip(*(column.tolist() for column in columns), strict=True)]


def _log(results: RunReader) -> Iterator[tuple[float, int, str, str]]:
    for milestone in results.summary["milestones"]:
        actor = milestone["vehicle"] or milestone["group"]
        yield float(milestone["time_s"]), INFO, actor, milestone["name"].replace("_", " ")
    for row in results.rows("roles"):
        if row["event"] in ("assigned", "left"):
            verb = "takes" if row["event"] == "assigned" else "leaves"
            yield row["time_s"], INFO, row["vehicle"], f"{verb} {row['role']} of {row['group']}"
    for row in results.rows("faults"):
        yield row["time_s"], WARNING, row["vehicle"], f"{row['kind']}: {row['detail']}"
    for row in results.rows("membership"):
        yield row["time_s"], WARNING, row["vehicle"], f"takes {row['peer']} for {row['event']}"
