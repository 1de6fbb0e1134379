"""The stream of messages that MCAP and rosbag2 have in common: topics, frames and times.

Frame ``map`` has x east, y north, z up from the surface. Each vehicle has a frame of its own, x forward and y to port,
named like its topics: vehicle ``AUV00`` has ``/auv00/pose``. Time is that of the mission, from 0.

=================  ============================================  ===============================
topic              what                                          when
=================  ============================================  ===============================
/tf                frames of all vehicles in ``map``             at every motion tick
/auvN/pose         true pose of a vehicle                        at every motion tick
/auvN/fix          latitude, longitude, height                   likewise, where there is a datum
/auvN/role         roles that drive it, as one text              at 0 s and at every change
/scene             places and vehicles; each packet's links      at 0 s; as each packet is sent
/packets           what each packet held and who heard it        as each packet is sent
/log               milestones, roles, faults, missed peers       as they come
=================  ============================================  ===============================
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from heapq import merge
from typing import Any, NamedTuple, Protocol

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from visualisation import style
from visualisation.exports.clock import nanoseconds
from visualisation.exports.geodesy import Floats
from visualisation.exports.names import topic_names
from visualisation.exports.voyage import Entry, SentPacket, Voyage, VoyageTrack

MAP = "map"
PACKET = "remoras_msgs/msg/Packet"
PACKET_DEFINITION = """builtin_interfaces/Time start
builtin_interfaces/Time end
uint32 slot
string sender
uint32 size_bits
uint32 items
uint32 acks
string[] receivers
string[] lost_by
"""
STRING = "std_msgs/msg/String"
HEARD, LOST = style.GREEN, style.VERMILLION
"""Colours of the links of a packet in the scene."""
LINK_S = 1.5
"""How long the links of a packet are seen."""
VEHICLE_M = (6.0, 2.0, 2.0)
"""Length, width and height of a vehicle in the scene: larger than life, to be found on a map of a kilometre."""
LABEL_PX, LABEL_UP_M = 14.0, 6.0


PointM = tuple[float, float, float]
"""x east, y north, z up."""


class PoseMessage(NamedTuple):
    """Where a vehicle is, z up, and the quaternion of its heading about z."""

    x_m: float
    y_m: float
    z_m: float
    turn_z: float
    turn_w: float


class Shape(NamedTuple):
    """What a scene shows, in one colour: lines, a box, or a text at the first point.

    Args:
        name: replaces an earlier shape of that name.
        frame: the frame of its points.
        kind: ``loop`` (closed), ``pairs`` (every two points a line), ``box`` or ``text``.
        points_m: x, y, z.
        colour: as ``#rrggbb``.
        text: of a text.
        lifetime_s: how long it is seen; 0 for good.
    """

    name: str
    frame: str
    kind: str
    points_m: Sequence[PointM]
    colour: str
    text: str = ""
    lifetime_s: float = 0.0

    @property
    def rgba(self) -> tuple[float, float, float, float]:
        """Shares of red, green, blue and opacity."""
        red, green, blue = (int(self.colour[at : at + 2], 16) / 255 for at in (1, 3, 5))
        return red, green, blue, 1.0


class StampedMessage(NamedTuple):
    """A message of a topic."""

    time_ns: int
    topic: str
    kind: str
    message: Any


class Dialect(Protocol):
    """How a format says it: each method returns the name of a message type and a message of it."""

    store: Typestore
    """Types of messages."""

    def transforms(self, time_ns: int, poses: Sequence[tuple[str, PoseMessage]]) -> tuple[str, Any]:
        """Frames of vehicles in ``map``."""

    def pose(self, time_ns: int, pose: PoseMessage) -> tuple[str, Any]:
        """A pose in ``map``."""

    def fix(self, time_ns: int, frame: str, latitude_deg: float, longitude_deg: float, z_m: float) -> tuple[str, Any]:
        """A place on the globe."""

    def scene(self, time_ns: int, shapes: Sequence[Shape]) -> tuple[str, Any]:
        """Shapes to show from now on."""

    def log(self, time_ns: int, entry: Entry) -> tuple[str, Any]:
        """An entry of the log."""


def store_with(definitions: dict[str, str]) -> Typestore:
    """Types of ROS 2 and of packets, and those given by their definitions.

    Args:
        definitions: by the whole names of the types.
    """
    store = get_typestore(Stores.ROS2_JAZZY)
    types: dict[str, Any] = {}
    for name, text in {PACKET: PACKET_DEFINITION, **definitions}.items():
        types.update(get_types_from_msg(text, name))
    store.register(types)
    return store


def stream(voyage: Voyage, dialect: Dialect) -> Iterator[StampedMessage]:
    """All messages of a run in time order, said in a dialect."""
    names = topic_names(voyage.vehicles)
    streams = [_motion(voyage, dialect, names), _events(voyage, dialect, names), _scenes(voyage, dialect, names)]
    return merge(*streams, key=lambda sent: sent.time_ns)


def _poses(track: VoyageTrack) -> list[PoseMessage]:
    turns: Floats = track.heading_rad / 2.0
    columns = (track.x_m, track.y_m, 0.0 - track.depth_m, np.sin(turns), np.cos(turns))
    return [PoseMessage(*row) for row in zip(*(column.tolist() for column in columns), strict=True)]


def _motion(voyage: Voyage, dialect: Dialect, names: dict[str, str]) -> Iterator[StampedMessage]:
    """At each time the frames of all vehicles that were recorded then, and each one's pose and fix."""
    at: dict[int, list[tuple[str, PoseMessage, tuple[float, float] | None]]] = {}
    for vehicle, track in voyage.tracks.items():
        fixes: Sequence[tuple[float, float] | None] = [None] * track.time_s.size
        if voyage.datum is not None:
            latitudes, longitudes = voyage.datum.degrees(track.x_m, track.y_m)
            fixes = list(zip(latitudes.tolist(), longitudes.tolist(), strict=True))
        for time_s, pose, fix in zip(track.time_s.tolist(), _poses(track), fixes, strict=True):
            at.setdefault(nanoseconds(time_s), []).append((names[vehicle], pose, fix))
    for time_ns in sorted(at):
        yield StampedMessage(
            time_ns, "/tf", *dialect.transforms(time_ns, [(name, pose) for name, pose, _ in at[time_ns]])
        )
        for name, pose, fix in at[time_ns]:
            yield StampedMessage(time_ns, f"/{name}/pose", *dialect.pose(time_ns, pose))
            if fix is not None:
                yield StampedMessage(time_ns, f"/{name}/fix", *dialect.fix(time_ns, name, *fix, pose.z_m))


def _events(voyage: Voyage, dialect: Dialect, names: dict[str, str]) -> Iterator[StampedMessage]:
    """Roles, packets and the log, in time order."""
    types = dialect.store.types
    time = types["builtin_interfaces/msg/Time"]
    found = []
    for state in voyage.states:
        said = types[STRING](data=state.text)
        found.append(StampedMessage(nanoseconds(state.time_s), f"/{names[state.vehicle]}/role", STRING, said))
    for packet in voyage.packets:
        start_ns, end_ns = nanoseconds(packet.time_s), nanoseconds(packet.end_s)
        message = types[PACKET](
            time(*divmod(start_ns, 10**9)), time(*divmod(end_ns, 10**9)), packet.slot, packet.sender,
            packet.size_bits, packet.items, packet.acks, list(packet.receivers), list(packet.lost_by),
        )  # fmt: skip
        found.append(StampedMessage(start_ns, "/packets", PACKET, message))
    for entry in voyage.log:
        time_ns = nanoseconds(entry.time_s)
        found.append(StampedMessage(time_ns, "/log", *dialect.log(time_ns, entry)))
    return iter(sorted(found, key=lambda sent: sent.time_ns))


def _scenes(voyage: Voyage, dialect: Dialect, names: dict[str, str]) -> Iterator[StampedMessage]:
    """What the map shows from the start, then the links of every packet."""
    yield StampedMessage(0, "/scene", *dialect.scene(0, [*_places(voyage), *_vehicles(voyage, names)]))
    packets = [packet for packet in voyage.packets if packet.sender in voyage.tracks]
    times_s = [packet.time_s for packet in packets]
    points = {
        vehicle: [(x_m, y_m, 0.0 - depth_m) for x_m, y_m, depth_m in track.at(times_s)]
        for vehicle, track in voyage.tracks.items()
    }
    for number, packet in enumerate(packets):
        time_ns = nanoseconds(packet.time_s)
        where = {vehicle: along[number] for vehicle, along in points.items()}
        yield StampedMessage(time_ns, "/scene", *dialect.scene(time_ns, _links(where, packet, names[packet.sender])))


def _places(voyage: Voyage) -> Iterator[Shape]:
    for place in voyage.places:
        corners = [(x_m, y_m, 0.0) for x_m, y_m in place.outline_m]
        name = f"{place.kind} {place.name}"
        if len(corners) > 1:
            yield Shape(f"{name} outline", MAP, "loop", corners, style.GREY)
        middle = tuple(math.fsum(along) / len(corners) for along in zip(*corners, strict=True))
        yield Shape(name, MAP, "text", [middle], style.GREY, place.name)  # type: ignore[list-item]


def _vehicles(voyage: Voyage, names: dict[str, str]) -> Iterator[Shape]:
    for number, vehicle in enumerate(voyage.vehicles):
        if vehicle in voyage.tracks:
            colour = style.vehicle_look(number).colour
            yield Shape(f"{names[vehicle]} hull", names[vehicle], "box", [(0.0, 0.0, 0.0)], colour)
            yield Shape(names[vehicle], names[vehicle], "text", [(0.0, 0.0, LABEL_UP_M)], colour, vehicle)


def _links(where: Mapping[str, PointM], packet: SentPacket, name: str) -> list[Shape]:
    """Lines from the sender to all who heard the packet, and half-way to those who lost it."""
    start = where[packet.sender]
    ends = [where[receiver] for receiver in packet.receivers if receiver in where]
    broken = [where[one] for one in packet.lost_by if one in where]
    halves = [((start[0] + x) / 2.0, (start[1] + y) / 2.0, (start[2] + z) / 2.0) for x, y, z in broken]
    return [
        Shape(f"{name} {what}", MAP, "pairs", [point for end in ends for point in (start, end)], colour, "", LINK_S)
        for what, ends, colour in (("heard", ends, HEARD), ("lost", halves, LOST))
    ]
