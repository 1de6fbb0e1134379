"""A vehicle's own body, clock and modem: it is where its body is, and not sure of the time it says nothing."""

import importlib
import math
import os
import pty
import re
import select
import sys
import threading
import time
import tty
from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest
from typer.testing import CliRunner

from exchange.drivers import AT_ONCE, Driver, Ether, Paced
from exchange.drivers.nanomodem import Nanomodem
from missions.errors import ConfigurationError
from missions.nodes import Disciplined, Fix, Frontseat, LoneVehicle, NodePlan, Reading, VehicleNode, alone
from missions.nodes.frontseat import CRYSTAL, PATIENCE_S
from missions.nodes.logs import Began, LineKind, NodeLog, gone_on, play, read_log
from missions.scenarios import load
from remoras.cli import app
from remoras.testing import channels
from remoras.work import Point

HOW_TO = Path(__file__).parents[3] / "docs" / "howto" / "node.md"
SHIP, BOAT = "ASV00", "AUV00"


class Hull:
    """A body that goes straight to where it is told, for a second each time it is asked where it is."""

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
    """A simulated vehicle and one with a body of its own, without a pace."""

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
        """How near to its track since then the ship takes it to be."""
        log = read_log(self.path)
        track = [Fix.of(entry.data) for entry in log.of(LineKind.FIX) if entry.time_s >= from_s]
        heard_m = self.own[0].solo.vehicle.beliefs.get(("position", BOAT))
        return min(math.dist(heard_m, fix[:2]) for fix in track)

    def go(self, until_s: float) -> None:
        while (node := min(self.ship, self.boat, key=lambda one: one.next_s)).next_s < until_s:
            node.step()


def test_the_vehicle_is_where_its_body_is_and_others_hear_of_it(tmp_path: Path) -> None:
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


def test_a_body_that_says_nothing_is_told_to_stop(tmp_path: Path) -> None:
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


def test_nonsense_of_a_body_is_passed_over_and_its_battery_counts(tmp_path: Path) -> None:
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


def test_the_log_of_a_body_repeats_and_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
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
def test_what_moves_a_simulated_body_is_refused(setting: str) -> None:
    alone(plan_of(BOAT, False, setting))
    with pytest.raises(ConfigurationError, match=r"--frontseat.*drift in no current and know where they are"):
        alone(plan_of(BOAT, True, setting))


# Clock ---------------------------------------------------------------------------------------------


class Told:
    """A clock that says what a test tells it to say."""

    def __init__(self) -> None:
        self.next: Reading | None = None

    def reading(self) -> Reading | None:
        return self.next


def test_readings_count_as_far_as_they_are_surer() -> None:
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


def test_who_is_not_sure_of_the_time_withholds_its_packets() -> None:
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


# The file of the how-to ------------------------------------------------------------------------------


def file_of_the_how_to() -> str:
    (text,) = re.findall(
        r"^```python\n(# boat\.py\n.*?)^```$", HOW_TO.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
    )
    return str(text)


def serial_pair() -> tuple[int, str, int]:
    """A pseudo terminal: the end of the stand-in, the name of the other one, and that, kept open."""
    near, far = pty.openpty()
    for file in (near, far):
        tty.setraw(file)
    return near, os.ttyname(far), far


class Water:
    """Modems that hear each other, with the time that a packet is on the air; two at once destroy each other.

    The first speaks AT commands, the others the protocol of the Nanomodem.
    """

    def __init__(self, n: int, air_s: float) -> None:
        self.ends = [serial_pair() for _ in range(n)]
        self.n_collisions = self.n_carried = 0
        self._air_s, self._given = air_s, [b""] * n
        self._on_air: list[tuple[float, int, bytes]] = []  # until when, of whom

    @property
    def ports(self) -> list[str]:
        return [port for _, port, _ in self.ends]

    def go_on(self) -> None:
        """Take what hosts say, and give what is off the air."""
        now_s = time.monotonic()
        for place, (near, _, _) in enumerate(self.ends):
            while select.select([near], [], [], 0.0)[0]:
                self._given[place] += os.read(near, 4096)
            taken = self._taken(place)
            if taken is not None:
                if self._on_air:
                    self.n_collisions += 1
                    self._on_air.clear()
                    continue
                self._on_air.append((now_s + self._air_s, place, taken))
        for until_s, place, data in [one for one in self._on_air if one[0] <= now_s]:
            self._on_air.remove((until_s, place, data))
            self.n_carried += 1
            for other, (near, _, _) in enumerate(self.ends):
                if other != place:
                    line = (
                        b"RECV,%b\n" % data.hex().encode() if other == 0 else b"#B%03d%02d%b" % (place, len(data), data)
                    )
                    os.write(near, line)

    def _taken(self, place: int) -> bytes | None:
        asked = re.compile(rb"AT\*SEND,([0-9a-f]+)\n" if place == 0 else rb"\$B([0-9]{2})", re.DOTALL)
        head = asked.search(self._given[place])
        if head is None:
            return None
        if place == 0:
            self._given[0] = self._given[0][head.end() :]
            return bytes.fromhex(head[1].decode())
        data = self._given[place][head.end() : head.end() + int(head[1])]
        if len(data) < int(head[1]):
            return None
        self._given[place] = self._given[place][head.end() + int(head[1]) :]
        return data


class Boat:
    """The control computer and the GPS receiver of a vehicle that goes where it is told."""

    def __init__(self, speed: float, at_m: Point) -> None:
        self.body, self.gps = serial_pair(), serial_pair()
        self.track_m: list[Point] = [at_m]
        self._goal, self._speed, self._rest = (at_m, 0.0), speed, b""
        self._last_s, self._last_second = time.monotonic(), 0

    def go_on(self) -> None:
        while select.select([self.body[0]], [], [], 0.0)[0]:
            *lines, self._rest = (self._rest + os.read(self.body[0], 4096)).split(b"\n")
            for line in lines:
                what, *numbers = line.decode().split(",")
                assert what == "GO"
                x_m, y_m, speed_mps = map(float, numbers)
                self._goal = ((x_m, y_m), speed_mps)
        now_s, utc_s = time.monotonic(), time.time()
        if now_s - self._last_s >= 0.02:
            way_m = self._goal[1] * (now_s - self._last_s) * self._speed
            (x_m, y_m), (to_x, to_y) = self.track_m[-1], self._goal[0]
            far_m = math.dist((x_m, y_m), (to_x, to_y))
            share = min(1.0, way_m / far_m) if far_m > 0.0 else 0.0
            self.track_m.append((x_m + share * (to_x - x_m), y_m + share * (to_y - y_m)))
            self._last_s = now_s
            words = (*self.track_m[-1], math.atan2(to_y - y_m, to_x - x_m), self._goal[1], 20.0, 0.9)
            os.write(self.body[0], ("NAV," + ",".join(map(repr, words)) + "\n").encode())
        if int(utc_s) != self._last_second:
            self._last_second = int(utc_s)
            stamp = datetime.fromtimestamp(self._last_second, UTC).strftime("%H%M%S.00,%d,%m,%Y")
            os.write(self.gps[0], f"PPS\n$GPZDA,{stamp},00,00\n".encode())


class Stand:
    """Boat and water in a thread."""

    def __init__(self, *parts: Water | Boat) -> None:
        self._parts, self._ends = parts, threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        while not self._ends.is_set():
            for part in self._parts:
                part.go_on()
            time.sleep(0.002)

    def close(self) -> None:
        self._ends.set()
        self._thread.join()
        for part in self._parts:
            for near, _, far in part.ends if isinstance(part, Water) else (part.body, part.gps):
                os.close(near)
                os.close(far)


@pytest.fixture
def own_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Folder of the file of the how-to, from which it can be imported."""
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    sys.modules.pop("boat", None)


def own_parts(folder: Path, ports: Sequence[str]) -> Frontseat:
    """What the file of the how-to makes, at other ports."""
    text = file_of_the_how_to()
    for given, port in zip(("/dev/ttyS1", "/dev/ttyS2", "/dev/ttyUSB0"), ports, strict=True):
        assert text.count(given) == 1
        text = text.replace(given, port)
    (folder / "boat.py").write_text(text, encoding="utf-8")
    importlib.invalidate_caches()
    made = importlib.import_module("boat").boat()
    assert isinstance(made, Frontseat)
    return made


def test_the_file_of_the_how_to_has_at_most_80_lines() -> None:
    assert len(file_of_the_how_to().splitlines()) <= 80


def test_its_modem_keeps_to_the_seam(own_file: Path) -> None:
    water = Water(2, 0.005)
    stand = Stand(water)
    pulse = serial_pair()
    made = own_parts(own_file, [pulse[1], pulse[1], water.ports[0]])
    assert made.modem is not None

    def pair() -> tuple[Driver, Driver, Paced]:
        assert made.modem is not None
        pace = Paced(time.monotonic())
        return made.modem(pace), Nanomodem(Path(water.ports[1]), pace), pace

    channels.check_driver(pair, least_bytes=2)
    stand.close()
    os.close(pulse[0])
    os.close(pulse[2])


@pytest.mark.slow
def test_one_real_vehicle_and_three_simulated_ones_are_a_fleet(own_file: Path) -> None:
    speed, until_s = 20.0, 140.0
    scenario = load("mapping-rendezvous", [("--set", "communication.modem=nanomodem-v3")])
    names = [BOAT, *(name for name in scenario.names_by_slot if name != BOAT)][:4]
    plans = [NodePlan.of(scenario, name, 1, until_s, 100.0) for name in names]
    plans[0] = replace(plans[0], is_steered=True)
    own: list[LoneVehicle] = [alone(plan) for plan in plans]
    start_m = own[0].setup.database[BOAT].start_m
    water = Water(4, own[0].setup.modem.packet_s(20) / speed)
    boat = Boat(speed, (start_m[0] + 7.0, start_m[1]))
    stand = Stand(water, boat)
    seat = own_parts(own_file, [boat.body[1], boat.gps[1], water.ports[0]])
    assert seat.clock is not None
    assert seat.modem is not None
    time.sleep(1.1)  # for a pulse
    begins_s = time.time() + 0.5
    paces = [Paced(time.monotonic() + begins_s - time.time(), speed) for _ in names]
    paces[0] = Disciplined(seat.clock, begins_s, Paced(0.0, speed))
    modems = [
        seat.modem(paces[0]),
        *(Nanomodem(Path(port), pace) for port, pace in zip(water.ports[1:], paces[1:], strict=True)),
    ]
    log = NodeLog(own_file / "dive", plans[0])
    nodes = [VehicleNode(own[0], modems[0], paces[0], log, body=seat.body)]
    nodes += [VehicleNode(one, driver, pace) for one, driver, pace in zip(own[1:], modems[1:], paces[1:], strict=True)]
    threads = [threading.Thread(target=node.run) for node in nodes]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    stand.close()
    outcomes = [node.outcome() for node in nodes]
    late_s = [one.late_s for one in outcomes]
    assert outcomes[0].packets_withheld == 0
    assert water.n_collisions == 0
    assert min(outcome.packets_heard for outcome in outcomes) > 20
    assert len({outcome.state_hash for outcome in outcomes}) == 1
    way_m = sum(math.dist(a, b) for a, b in zip(boat.track_m, boat.track_m[1:], strict=False))
    assert way_m > 50.0
    heard_m = own[1].solo.vehicle.beliefs.get(("position", BOAT))
    assert min(math.dist(heard_m, at_m) for at_m in boat.track_m) < 5.0
    assert math.dist(own[0].solo.vehicle.functional.motion.position_m, boat.track_m[-1]) < 10.0
    assert play(read_log(log.path)).difference == ""
    refused = [one.packets_refused for one in outcomes]
    print(f"\n{way_m:.0f} m, {water.n_carried} packets carried, refused {refused}, late {late_s} s")


# The command ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "options", "expected"),
    [
        ("", ["--frontseat", "seat.py:seat"], "has no attribute 'seat'"),
        ("def seat(): return 3", ["--frontseat", "seat.py:seat"], "returns int; allowed is a missions.nodes.Frontseat"),
        ("def seat(): raise OSError('no port')", ["--frontseat", "seat.py:seat"], "OSError: no port"),
        ("", ["--frontseat", "none.py:seat"], "no such file"),
        (
            "from missions.nodes import Frontseat\ndef seat(): return Frontseat(modem=print)",
            ["--frontseat", "seat.py:seat", "--start-utc", "2026-05-01T09:00:00", "--peers", "ASV00=127.0.0.1:1"],
            "its modem takes the place of others; leave out --serial, --unet, --bind and --peers",
        ),
        (
            "from missions.nodes import Frontseat\ndef seat(): return Frontseat(modem=print)",
            ["--frontseat", "seat.py:seat"],
            "--start-utc is missing",
        ),
    ],
)
def test_a_frontseat_that_cannot_be_is_a_line(
    text: str, options: list[str], expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    name = f"seat_{abs(hash((text, *options)))}"
    (tmp_path / f"{name}.py").write_text(text)
    given = [option.replace("seat.py", f"{name}.py") for option in options]
    result = CliRunner().invoke(app, ["node", "mapping-rendezvous", BOAT, *given])
    assert result.exit_code == 2, result.output
    assert expected in result.stderr.replace("\n", " ")
