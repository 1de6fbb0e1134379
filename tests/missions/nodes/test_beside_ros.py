"""A ROS 2 graph beside a node, by a stand-in for the few calls of rclpy: no ROS was at hand.

The stand-in takes calls by the signatures that rclpy has (``SIGNATURES``, read from its sources at commit ba72a01), and
its messages are made of the definitions of ROS 2 Jazzy that ``rosbags`` has: a field that is not there cannot be set.
"""

import inspect
import math
import sys
from collections.abc import Iterator
from dataclasses import fields, replace
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from typer.testing import CliRunner

from exchange.drivers import AT_ONCE, Ether
from missions.errors import ConfigurationError
from missions.nodes import NodePlan, VehicleNode, alone
from missions.nodes.ros import RosShare
from missions.scenarios import load
from remoras.cli import app

SIGNATURES = {
    "init": "*, args=None, context=None, domain_id=None, signal_handler_options=None",
    "create_node": (
        "node_name, *, context=None, cli_args=None, namespace=None, use_global_arguments=True, enable_rosout=True, "
        "start_parameter_services=True, parameter_overrides=None, allow_undeclared_parameters=False, "
        "automatically_declare_parameters_from_overrides=False, enable_logger_service=False"
    ),
    "spin_once": "node, *, executor=None, timeout_sec=None",
    "try_shutdown": "*, context=None, uninstall_handlers=None",
    "create_subscription": (
        "msg_type, topic, callback, qos_profile, *, callback_group=None, event_callbacks=None, "
        "qos_overriding_options=None, raw=False"
    ),
    "create_publisher": (
        "msg_type, topic, qos_profile, *, callback_group=None, event_callbacks=None, qos_overriding_options=None, "
        "publisher_class=None"
    ),
}


def taken(name: str, *args: Any, **kwargs: Any) -> dict[str, Any]:
    """Arguments of a call by their names, if rclpy takes such a call."""
    namespace: dict[str, Any] = {}
    exec(f"def {name}({SIGNATURES[name]}): ...", namespace)
    return dict(inspect.signature(namespace[name]).bind(*args, **kwargs).arguments)


class Message:
    """A message of a type: its fields, and no others, each of the kind that it has."""

    def __init__(self, types: Any, name: str) -> None:
        object.__setattr__(self, "_types", types)
        for field in fields(types.types[name]):
            if field.name.startswith("__"):
                continue
            kind = field.type if isinstance(field.type, str) else getattr(field.type, "__name__", "")
            value: Any = 0.0 if "float" in kind.lower() else "" if "str" in kind.lower() else 0
            of = next((one for one in types.types if one.replace("/", "__") == kind.strip("'\"").split(".")[-1]), None)
            if of is not None:
                value = Message(types, of)
            object.__setattr__(self, field.name, value)

    def __setattr__(self, name: str, value: Any) -> None:
        before = getattr(self, name)  # AttributeError, as rclpy has it, for a field that is not there
        assert isinstance(value, type(before)), (name, value)  # and so are its assertions
        object.__setattr__(self, name, value)


class Graph(ModuleType):
    """The stand-in: what was published, and what waits for who subscribed."""

    def __init__(self, types: Any) -> None:
        super().__init__("rclpy")
        self.types = types
        self.published: dict[str, list[Any]] = {}
        self.waiting: list[Any] = []
        self.callbacks: dict[str, Any] = {}
        self.is_up = False
        self.namespace = ""

    def message(self, name: str) -> Any:
        return Message(self.types, name)

    def init(self, *args: Any, **kwargs: Any) -> None:
        assert taken("init", *args, **kwargs)["signal_handler_options"] == "NO"
        self.is_up = True

    def create_node(self, *args: Any, **kwargs: Any) -> Any:
        self.namespace = taken("create_node", *args, **kwargs)["namespace"]
        return self

    def create_subscription(self, *args: Any, **kwargs: Any) -> None:
        given = taken("create_subscription", *args, **kwargs)
        self.callbacks[given["topic"]] = given["callback"]

    def create_publisher(self, *args: Any, **kwargs: Any) -> Any:
        given = taken("create_publisher", *args, **kwargs)
        found = self.published.setdefault(given["topic"], [])
        return SimpleNamespace(publish=found.append)

    def spin_once(self, *args: Any, **kwargs: Any) -> None:
        assert taken("spin_once", *args, **kwargs) == {"node": self, "timeout_sec": 0.0}
        if self.waiting:
            self.callbacks["odometry"](self.waiting.pop(0))

    def get_clock(self) -> Any:
        stamp = self.message("builtin_interfaces/msg/Time")
        return SimpleNamespace(now=lambda: SimpleNamespace(to_msg=lambda: stamp))

    def destroy_node(self) -> None:
        assert self.is_up

    def try_shutdown(self, *args: Any, **kwargs: Any) -> None:
        taken("try_shutdown", *args, **kwargs)
        self.is_up = False


@pytest.fixture
def graph(monkeypatch: pytest.MonkeyPatch) -> Iterator[Graph]:
    typesys = pytest.importorskip("rosbags.typesys")
    found = Graph(typesys.get_typestore(typesys.Stores.ROS2_JAZZY))
    signals = ModuleType("rclpy.signals")
    signals.SignalHandlerOptions = SimpleNamespace(NO="NO")  # type: ignore[attr-defined]
    modules: dict[str, ModuleType] = {"rclpy": found, "rclpy.signals": signals}
    for package, kind in (("nav_msgs", "Odometry"), ("geometry_msgs", "PoseStamped"), ("std_msgs", "Float64")):
        module = ModuleType(f"{package}.msg")
        setattr(module, kind, lambda name=f"{package}/msg/{kind}": found.message(name))
        modules |= {package: ModuleType(package), f"{package}.msg": module}
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    yield found
    assert not found.is_up


def odometry(graph: Graph, x_m: float, y_m: float, heading_rad: float = 0.0, depth_m: float = 0.0) -> Any:
    message = graph.message("nav_msgs/msg/Odometry")
    at, turned = message.pose.pose.position, message.pose.pose.orientation
    at.x, at.y, at.z = x_m, y_m, -depth_m
    turned.z, turned.w = math.sin(heading_rad / 2.0), math.cos(heading_rad / 2.0)
    message.twist.twist.linear.x, message.twist.twist.linear.y = 0.6, 0.8
    return message


def test_a_vehicle_whose_body_is_in_the_graph_goes_where_that_goes(graph: Graph) -> None:
    share = RosShare("AUV00", True)
    assert graph.namespace == "auv00"
    assert share.fix() is None
    graph.waiting = [odometry(graph, 1.0, 2.0), odometry(graph, 3.0, -40.0, heading_rad=2.5, depth_m=12.0)]
    assert share.fix() == pytest.approx((3.0, -40.0, 2.5, 1.0, 12.0, math.nan), nan_ok=True)
    assert share.fix() is None
    ship, boat = (NodePlan.of(load("mapping-rendezvous"), name, 3, 120.0, 0.0) for name in ("ASV00", "AUV00"))
    own = [alone(plan) for plan in (ship, replace(boat, is_steered=True))]
    ether = Ether(own[0].setup.modem.packet_s)
    nodes = [VehicleNode(own[0], ether.driver(), AT_ONCE), VehicleNode(own[1], ether.driver(), AT_ONCE, body=share)]
    at_m = 3.0, -40.0
    while (node := min(nodes, key=lambda one: one.next_s)).next_s < 110.0:
        graph.waiting = [odometry(graph, *at_m)]
        node.step()
        if graph.published["goal_pose"]:
            goal, speed = graph.published["goal_pose"][-1], graph.published["goal_speed"][-1]
            assert goal.header.frame_id == "map"
            wanted_m = goal.pose.position.x, goal.pose.position.y
            far_m = math.dist(at_m, wanted_m)
            share_of_way = min(1.0, speed.data / far_m) if far_m else 0.0
            at_m = tuple(a + share_of_way * (b - a) for a, b in zip(at_m, wanted_m, strict=True))
    nodes[1].run()
    assert math.dist(at_m, (3.0, -40.0)) > 5.0
    assert graph.published["goal_speed"][-1].data == 0.0  # the mission is over
    n = len(graph.published["goal_pose"])
    share.guide((1.0, 1.0), 1.0)  # it has left
    share.close()
    assert len(graph.published["goal_pose"]) == n
    assert share.fix() is None


def test_a_simulated_vehicle_is_told(graph: Graph) -> None:
    command = [
        "node",
        "mapping-rendezvous",
        "AUV00",
        "--ros",
        "tell",
        "--until",
        "30",
        "--settle",
        "0",
        "--speed",
        "60",
    ]
    done = CliRunner().invoke(app, [*command, "--json"])
    assert done.exit_code == 0, done.output
    told = graph.published["odometry"]
    assert 25 <= len(told) <= 120
    assert told[-1].child_frame_id == "auv00"
    assert told[-1].pose.pose.position.z == -load("mapping-rendezvous").vehicle[1].depth_m
    turned = told[-1].pose.pose.orientation
    assert turned.z * turned.z + turned.w * turned.w == pytest.approx(1.0)
    assert graph.callbacks == {}


def test_without_ros_it_says_in_a_line_what_to_do() -> None:
    if "rclpy" in sys.modules or sys.modules.get("rclpy.signals"):
        pytest.skip("there is a ROS 2 here")
    with pytest.raises(ConfigurationError, match="--ros: rclpy"):
        RosShare("AUV00", True)
    done = CliRunner().invoke(app, ["node", "mapping-rendezvous", "AUV00", "--ros", "body"])
    assert done.exit_code == 2
    assert len(done.stderr.splitlines()) == 1
    assert "/opt/ros/jazzy/setup.bash" in done.stderr
    done = CliRunner().invoke(app, ["node", "mapping-rendezvous", "AUV00", "--ros", "both"])
    assert done.exit_code == 2
