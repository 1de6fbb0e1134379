"""Frontseat: real body, clock and ROS graph of a vehicle."""

import math
import sys
import time
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from diving import step_until
from memory_drivers import AT_ONCE, Ether
from typer.testing import CliRunner

from exchange.drivers import Paced
from missions.errors import ConfigurationError
from missions.nodes import Disciplined, Fix, NodePlan, Reading, VehicleNode, alone
from missions.nodes.frontseat import CRYSTAL, PATIENCE_S
from missions.nodes.logs import Began, LineKind, NodeLog, gone_on, play, read_log
from missions.nodes.ros import RosShare
from missions.scenarios import load
from remoras.cli import app
from remoras.work import Point

SHIP, BOAT = "ASV00", "AUV00"


class Hull:
    """Body that moves straight to its goal, one second per request for its position."""

    def __init__(self, x_m: float, y_m: float) -> None:
        self.at_m: Point = (x_m, y_m)
        self.goals: list[tuple[Point, float]] = []
        self.is_silent = self.is_closed = False
        self.battery = math.nan

    def guide(self, target_m: Point, speed_mps: float) -> None:
        self.goals.append((target_m, speed_mps))

    def fix(self) -> Fix | None:
        if self.is_silent:
            return None
        if self.goals:
            (x_m, y_m), speed_mps = self.goals[-1]
            far_m = math.dist(self.at_m, (x_m, y_m))
            share = min(1.0, speed_mps / far_m) if far_m > 0.0 else 0.0
            self.at_m = self.at_m[0] + share * (x_m - self.at_m[0]), self.at_m[1] + share * (y_m - self.at_m[1])
        return Fix(*self.at_m, 0.0, 1.0, 12.0, self.battery)

    def close(self) -> None:
        self.is_closed = True


def plan_of(vehicle: str, is_steered: bool = False, *settings: str) -> NodePlan:
    scenario = load("mapping-rendezvous", [("--set", setting) for setting in settings])
    return replace(NodePlan.of(scenario, vehicle, 3, 160.0, 80.0), is_steered=is_steered)


class Pair:
    """Simulated vehicle and one with a real body, without a pace."""

    def __init__(self, folder: Path, hull: Hull) -> None:
        self.hull = hull
        plans = plan_of(SHIP), plan_of(BOAT, is_steered=True)
        self.own = [alone(plan) for plan in plans]
        ether = Ether(self.own[0].setup.modem.packet_s)
        self.path = folder / f"{BOAT}.jsonl"
        log = NodeLog(folder, plans[1], Began(1e6, 1.0))
        self.ship = VehicleNode(self.own[0], ether.driver(), AT_ONCE)
        self.boat = VehicleNode(self.own[1], ether.driver(), AT_ONCE, log, body=hull)

    def nearest_m(self, from_s: float) -> float:
        """Smallest distance between the body's track since a time and the position known to the ship."""
        log = read_log(self.path)
        track = [Fix.of(entry.data) for entry in log.of(LineKind.FIX) if entry.time_s >= from_s]
        heard_m = self.own[0].solo.vehicle.beliefs.get(("position", BOAT))
        return min(math.dist(heard_m, fix[:2]) for fix in track)

    def go(self, until_s: float) -> None:
        step_until(until_s, self.ship, self.boat)


def test_vehicle_takes_its_position_from_its_body_and_reports_it(tmp_path: Path) -> None:
    pair = Pair(tmp_path, Hull(3.0, -40.0))
    pair.go(120.0)
    layer = pair.own[1].solo.vehicle.functional
    assert math.dist(layer.motion.position_m, pair.hull.at_m) <= 2.0  # of the last tick, or the one before
    assert layer.depth_m == 12.0
    assert pair.nearest_m(0.0) < 1.0
    assert len({goal for goal, _ in pair.hull.goals}) > 1  # it was guided to more than one place
    pair.hull.at_m = (150.0, 90.0)  # the sea has moved it, and the ship hears of it
    pair.go(155.0)
    assert pair.nearest_m(122.0) < 1.0
    pair.go(240.0)
    assert len({node.run().state_hash for node in (pair.ship, pair.boat)}) == 1
    assert pair.hull.goals[-1][1] == 0.0  # the mission is over
    assert pair.hull.is_closed


def test_silent_body_gets_speed_0(tmp_path: Path) -> None:
    hull = Hull(3.0, -40.0)
    pair = Pair(tmp_path, hull)
    pair.go(100.0)
    assert hull.goals[-1][1] > 0.0
    hull.is_silent = True
    n = len(hull.goals)
    pair.go(100.0 + PATIENCE_S + 5.0)
    speeds = [speed_mps for _, speed_mps in hull.goals[n:]]
    assert speeds[0] > 0.0
    assert speeds[-1] == 0.0
    hull.is_silent = False
    pair.go(130.0)
    assert hull.goals[-1][1] > 0.0


def test_invalid_position_is_ignored_and_battery_level_is_used(tmp_path: Path) -> None:
    hull = Hull(3.0, -40.0)
    pair = Pair(tmp_path, hull)
    pair.go(50.0)
    hull.at_m = (math.nan, 0.0)
    pair.go(55.0)
    assert math.isfinite(pair.own[1].solo.vehicle.functional.motion.x_m)
    hull.at_m, hull.battery = (3.0, -40.0), 0.25
    pair.go(60.0)
    assert pair.own[1].solo.vehicle.functional.picture.body.battery == pytest.approx(0.25, abs=0.01)
    hull.battery = 0.0
    pair.go(65.0)
    assert not pair.own[1].solo.vehicle.is_alive
    assert hull.goals[-1][1] == 0.0


def test_log_with_fixes_is_reproduced_and_resumed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pair = Pair(tmp_path, Hull(3.0, -40.0))
    pair.go(90.0)
    log = read_log(pair.path)
    assert len(log.of(LineKind.FIX)) > 80
    assert play(log).difference == ""
    # the fixes are what it rests on: one that is another makes it say something else
    entries = [
        entry._replace(data=Fix(400.0, 400.0, 0.0, 0.0, 5.0).data) if entry.kind is LineKind.FIX else entry
        for entry in log.entries
    ]
    assert play(replace(log, entries=tuple(entries))).difference
    monkeypatch.setattr("missions.nodes.logs.time.time", lambda: 1e6 + 120.0)
    with pytest.raises(ConfigurationError, match="of another scenario"):
        gone_on(pair.path, plan_of(BOAT))
    own, going_on, _ = gone_on(pair.path, plan_of(BOAT, is_steered=True))
    going_on.close()
    assert own.steered is not None
    assert own.solo.vehicle.beliefs.model.state_hash() == pair.own[1].solo.vehicle.beliefs.model.state_hash()


@pytest.mark.parametrize("setting", ["navigation.drift=0.01", "current.east_mps=0.1"])
def test_current_and_navigation_errors_are_refused_with_a_frontseat(setting: str) -> None:
    alone(plan_of(BOAT, False, setting))
    with pytest.raises(ConfigurationError, match=r"--frontseat.*without current and navigation errors"):
        alone(plan_of(BOAT, True, setting))


# Clock ---------------------------------------------------------------------------------------------


class Told:
    """Clock that shows the readings set by a test."""

    def __init__(self) -> None:
        self.next: Reading | None = None

    def reading(self) -> Reading | None:
        return self.next


def test_clock_readings_count_only_if_more_certain() -> None:
    clock = Told()
    pace = Disciplined(clock, 1000.0, Paced(0.0, 2.0))
    assert pace.uncertainty_s == math.inf
    here_s = time.monotonic()
    clock.next = Reading(1030.0, here_s, 0.5)
    assert pace.now_s == pytest.approx(60.0, abs=0.5)
    assert pace.uncertainty_s == pytest.approx(1.0, abs=0.1)
    clock.next = Reading(1040.0, here_s, 0.9)  # not as sure: passed over
    assert pace.now_s == pytest.approx(60.0, abs=0.5)
    clock.next = Reading(1030.2, here_s, 0.001)
    assert pace.now_s == pytest.approx(60.4, abs=0.2)
    clock.next = Reading(1030.1, here_s - 1000.0, 0.001)  # its age counts with it once it has been taken
    assert pace.now_s == pytest.approx(2060.2, abs=0.2)
    assert pace.uncertainty_s == pytest.approx(2.0 * (0.001 + CRYSTAL * 1000.0), rel=0.05)


def test_node_with_uncertain_time_withholds_its_packets() -> None:
    class Unsure(Paced):
        uncertain_s = 0.0

        @property
        def now_s(self) -> float:
            return math.inf

        @property
        def uncertainty_s(self) -> float:
            return self.uncertain_s

    plan = NodePlan.of(load("mapping-rendezvous"), BOAT, 3, 120.0, 0.0)
    outcomes = []
    for uncertain_s in (0.0, load("mapping-rendezvous").communication.clock_tolerance_s + 0.1):
        pace = Unsure(0.0)
        pace.uncertain_s = uncertain_s
        own = alone(plan)
        ether = Ether(own.setup.modem.packet_s)
        hearer = ether.driver()
        outcome = VehicleNode(own, ether.driver(), pace).run()
        outcomes.append((outcome.packets_sent, outcome.packets_withheld, len(hearer.receive(math.inf))))
    (sent, withheld, _), (_, all_withheld, heard) = outcomes
    assert sent > 5
    assert (withheld, all_withheld, heard) == (0, sent, 0)


# The command ------------------------------------------------------------------------------------------


SEAT = "from missions.nodes import Frontseat\ndef seat(): return Frontseat"


@pytest.mark.parametrize(("text", "options", "expected"), [
    ("", (), "has no seat"),
    ("def seat(): return 3", (), "it returned 3; expected: a missions.nodes.Frontseat"),
    ("def seat(): raise OSError('no port')", (), "OSError: no port"),
    (f"{SEAT}(modem=print)", (), "--start-utc is missing"),
    (f"{SEAT}(modem=print)", ("--start-utc", "2026-05-01T09:00:00", "--peers", "ASV00=127.0.0.1:1"),
     "its modem replaces other links; leave out --serial, --unet, --bind and --peers"),
])  # fmt: skip
def test_faulty_frontseat_is_refused_in_one_line(
    text: str, options: tuple[str, ...], expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    name = f"seat_{abs(hash((text, *options)))}.py"
    (tmp_path / name).write_text(text)
    result = CliRunner().invoke(app, ["node", "mapping-rendezvous", BOAT, "--frontseat", f"{name}:seat", *options])
    assert result.exit_code == 2, result.output
    assert expected in result.stderr.replace("\n", " ")


class Message:
    """A message of a type: its fields, and no others, each of the kind that it has."""

    def __init__(self, types: Any, name: str) -> None:
        object.__setattr__(self, "_types", types)
        for field in fields(types.types[name]):
            if field.name.startswith("__"):
                continue
            kind = field.type if isinstance(field.type, str) else getattr(field.type, "__name__", "")
            value: Any = 0.0 if "float" in kind.lower() else "" if "str" in kind.lower() else 0
            value = [0.0] * 36 if "ndarray" in kind else value
            of = next((one for one in types.types if one.replace("/", "__") == kind.strip("'\"").split(".")[-1]), None)
            if of is not None:
                value = Message(types, of)
            object.__setattr__(self, field.name, value)

    def __setattr__(self, name: str, value: Any) -> None:
        before = getattr(self, name)  # AttributeError, as rclpy has it, for a field that is not there
        assert isinstance(value, type(before)), (name, value)  # and so are its assertions
        object.__setattr__(self, name, value)


class Graph(ModuleType):
    """Substitute of the ROS graph: published messages, and messages waiting for a subscriber."""

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

    def init(self, *, args: list[str], signal_handler_options: str) -> None:
        assert signal_handler_options == "NO"
        self.is_up = True

    def create_node(self, node_name: str, *, namespace: str, use_global_arguments: bool) -> Any:
        self.namespace = namespace
        return self

    def create_subscription(self, msg_type: Any, topic: str, callback: Any, qos_profile: int) -> None:
        self.callbacks[topic] = callback

    def create_publisher(self, msg_type: Any, topic: str, qos_profile: int) -> Any:
        return SimpleNamespace(publish=self.published.setdefault(topic, []).append)

    def spin_once(self, node: Any, *, timeout_sec: float) -> None:
        assert (node, timeout_sec) == (self, 0.0)
        if self.waiting:
            self.callbacks["odometry"](self.waiting.pop(0))

    def get_clock(self) -> Any:
        stamp = self.message("builtin_interfaces/msg/Time")
        return SimpleNamespace(now=lambda: SimpleNamespace(to_msg=lambda: stamp))

    def destroy_node(self) -> None:
        assert self.is_up

    def try_shutdown(self) -> None:
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


def test_ros_body_gives_fixes_and_gets_goals_until_the_node_leaves(graph: Graph) -> None:
    share = RosShare("AUV00", True)
    assert graph.namespace == "auv00"
    assert share.fix() is None
    graph.waiting = [odometry(graph, 1.0, 2.0), odometry(graph, 3.0, -40.0, heading_rad=2.5, depth_m=12.0)]
    graph.waiting[1].pose.covariance[0], graph.waiting[1].pose.covariance[7] = 3.0, 5.0
    assert share.fix() == pytest.approx((3.0, -40.0, 2.5, 1.0, 12.0, math.nan, 2.0), nan_ok=True)
    assert share.fix() is None
    share.guide((1.0, 2.0), 0.5)
    (goal,), (speed,) = graph.published["goal_pose"], graph.published["goal_speed"]
    assert (goal.header.frame_id, goal.pose.position.x, goal.pose.position.y, speed.data) == ("map", 1.0, 2.0, 0.5)
    share.close()
    share.guide((1.0, 1.0), 1.0)
    assert len(graph.published["goal_pose"]) == 1
    assert share.fix() is None


def test_simulated_vehicle_publishes_odometry(graph: Graph) -> None:
    command = ["node", "mapping-rendezvous", "AUV00", "--ros", "tell"]
    command += ["--until", "30", "--settle", "0", "--speed", "60"]
    done = CliRunner().invoke(app, [*command, "--json"])
    assert done.exit_code == 0, done.output
    told = graph.published["odometry"]
    assert 25 <= len(told) <= 120
    assert told[-1].child_frame_id == "auv00"
    assert told[-1].pose.pose.position.z == -load("mapping-rendezvous").vehicle[1].depth_m
    turned = told[-1].pose.pose.orientation
    assert turned.z * turned.z + turned.w * turned.w == pytest.approx(1.0)
    assert graph.callbacks == {}


def test_missing_ros_is_refused_in_one_line_with_the_remedy() -> None:
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
