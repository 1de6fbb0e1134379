"""ROS 2 interface of a node: a real body in the graph, or publication of a simulated one.

Topics are below the vehicle name (``/auv00/odometry``). Frames follow REP 103: x east, y north, z up; headings count
from east, counter-clockwise. ``rclpy`` is imported on use. Calls follow commit ba72a01 (December 2024).
"""

from __future__ import annotations

import math
import re
from importlib import import_module
from typing import Any

from exchange.arithmetic import atan2, length, sincos
from missions.errors import ConfigurationError
from missions.nodes.frontseat import Fix
from remoras.fleet.vehicle import Vehicle
from remoras.work import Point

KEPT = 10  # queue depth of a topic
FRAME = "map"
MOST_AT_ONCE = 64


class RosShare:
    """Topics of a real body, or of a simulated one; raises ConfigurationError without ROS 2."""

    def __init__(self, vehicle: str, is_body: bool) -> None:
        try:
            self._rclpy: Any = import_module("rclpy")
            quiet = import_module("rclpy.signals").SignalHandlerOptions.NO
            self._odometry: Any = import_module("nav_msgs.msg").Odometry
            self._pose: Any = import_module("geometry_msgs.msg").PoseStamped
            self._number: Any = import_module("std_msgs.msg").Float64
        except ImportError as error:
            lacks = (
                "is not here; allowed in a shell that has sourced the setup file of ROS 2, as /opt/ros/jazzy/setup.bash"
            )
            raise ConfigurationError.of("--ros", str(error.name), "", lacks) from None
        # The process of the node handles its signals itself.
        self._rclpy.init(args=[], signal_handler_options=quiet)
        name = re.sub(r"\W", "_", vehicle).lower()
        # Names in ROS may not begin with a digit.
        self._name = name if name[0].isalpha() else f"v{name}"
        self._node: Any = self._rclpy.create_node("remoras", namespace=self._name, use_global_arguments=False)
        self._fix: Fix | None = None
        self._n_heard = 0
        self._told_s = -math.inf
        if is_body:
            self._node.create_subscription(self._odometry, "odometry", self._hear, KEPT)
            self._goal: Any = self._node.create_publisher(self._pose, "goal_pose", KEPT)
            self._speed: Any = self._node.create_publisher(self._number, "goal_speed", KEPT)
        else:
            self._tracks: Any = self._node.create_publisher(self._odometry, "odometry", KEPT)

    def _hear(self, message: Any) -> None:
        point, turned, moves = message.pose.pose.position, message.pose.pose.orientation, message.twist.twist.linear
        # Yaw of the quaternion, about the upward axis.
        sine = 2.0 * (turned.w * turned.z + turned.x * turned.y)
        cosine = 1.0 - 2.0 * (turned.y * turned.y + turned.z * turned.z)
        east_m2, north_m2 = message.pose.covariance[0], message.pose.covariance[7]
        self._fix = Fix(
            point.x, point.y, atan2(sine, cosine), length(moves.x, moves.y), -point.z,
            sigma_m=math.sqrt(max(0.0, (east_m2 + north_m2) / 2.0)),
        )  # fmt: skip
        self._n_heard += 1

    def fix(self) -> Fix | None:
        """Return the last fix received since the last call."""
        for _ in range(MOST_AT_ONCE if self._node is not None else 0):
            # One spin handles one message, and only the last fix counts; the limit keeps a fast sender from blocking.
            before = self._n_heard
            self._rclpy.spin_once(self._node, timeout_sec=0.0)
            if self._n_heard == before:
                break
        fix, self._fix = self._fix, None
        return fix

    def guide(self, target_m: Point, speed_mps: float) -> None:
        """Publish target and speed; 0 stops the body."""
        if self._node is not None:
            pose, number = self._pose(), self._number()
            self._stamp(pose.header)
            pose.pose.position.x, pose.pose.position.y = map(float, target_m)
            pose.pose.orientation.w = 1.0
            number.data = float(speed_mps)
            self._goal.publish(pose)
            self._speed.publish(number)

    def witness(self, vehicle: Vehicle, now_s: float) -> None:
        """Publish the place of a simulated vehicle, once per mission time."""
        if self._node is not None and now_s > self._told_s:
            self._told_s = now_s
            layer, motion, message = vehicle.functional, vehicle.functional.motion, self._odometry()
            self._stamp(message.header)
            message.child_frame_id = self._name
            point, turned = message.pose.pose.position, message.pose.pose.orientation
            point.x, point.y, point.z = float(motion.x_m), float(motion.y_m), -float(layer.depth_m)
            turned.z, turned.w = sincos(motion.heading_rad / 2.0)
            message.twist.twist.linear.x = float(layer.guidance.ground_mps)
            self._tracks.publish(message)

    def _stamp(self, header: Any) -> None:
        header.frame_id = FRAME
        header.stamp = self._node.get_clock().now().to_msg()

    def close(self) -> None:
        """Leave the graph; a repeated call has no effect."""
        if self._node is not None:
            self._node.destroy_node()
            self._node = None
            self._rclpy.try_shutdown()
