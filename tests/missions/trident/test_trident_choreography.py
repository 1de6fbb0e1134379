"""Choreography of messages, refused tables, figures."""

from pathlib import Path
from typing import Any

import pytest
import tomli_w
from intervening import module, run, tables
from matplotlib.figure import Figure as Sheet
from plain_style import PlainStyle
from recorded import metric
from small_mission import Raw, checked, named

from missions.errors import ConfigurationError, ConfigurationFault
from missions.runs.results import MemoryResults
from missions.scenarios import load
from missions.trident import TridentMission
from missions.trident.scenario import ChoreographyTable
from missions.trident.truth import (
    CHOREOGRAPHY,
    Monitor,
    draw_choreography,
    draw_services,
    draw_site,
    statuses,
    uses,
)
from remoras.recorder import Recorder

PATTERN = {
    "state": [{"name": "asked", "within_s": 100.0}, {"name": "chosen"}, {"name": "over", "final": True}],
    "message": [
        {"state": "asked", "says": "chosen", "by": "ASV00", "to": "chosen"},
        {"state": "chosen", "says": "verdict", "value": "target", "to": "over"},
        {"state": "chosen", "says": "verdict", "value": "decoy", "to": "asked"},
    ],
}


class Fleet:
    """Fleet that sends facts in packets, observed by a monitor."""

    def __init__(self, pattern: dict[str, Any] = PATTERN) -> None:
        self.recorder = Recorder([CHOREOGRAPHY])
        self.monitor = Monitor(ChoreographyTable.model_validate(pattern), self.recorder)
        self._n = 0

    def record(self, vehicle: str, attribute: str, value: str, at_s: float) -> str:
        self._n += 1
        uid = f"{vehicle}-{self._n}"
        self.recorder.items.append((uid, vehicle, at_s, at_s, "recovery", attribute, value, "told", ""))
        return uid

    def send(self, vehicle: str, uid: str, at_s: float) -> None:
        row = 0, at_s, vehicle, 100, 1, 0, [], ["all"], at_s + 1.0, [], [uid], [], [], [], [], []
        self.recorder.packets.append(row)
        self.monitor.look(at_s + 1.0)

    def say(self, vehicle: str, attribute: str, value: str, at_s: float) -> None:
        self.send(vehicle, self.record(vehicle, attribute, value, at_s), at_s)

    @property
    def rows(self) -> list[tuple[Any, ...]]:
        return self.recorder.rows(CHOREOGRAPHY.name)


def test_sent_messages_change_the_state() -> None:
    fleet = Fleet()
    fleet.say("IAUV00", "verdict", "target", 5.0)  # not allowed: named, and changes nothing
    assert [row[-1] for row in fleet.rows] == ["not allowed in state asked; allowed: chosen by ASV00"]
    uid = fleet.record("ASV00", "chosen", "Candidate-1", 8.0)
    fleet.monitor.look(9.0)
    assert len(fleet.rows) == 1  # recorded, and not said until it is sent
    fleet.send("ASV00", uid, 10.0)
    fleet.say("IAUV00", "verdict", "target", 50.0)
    assert fleet.rows[1:] == [
        (10.0, "ASV00", "asked", "chosen", "recovery", "Candidate-1", "chosen", ""),
        (50.0, "IAUV00", "chosen", "verdict", "recovery", "target", "over", ""),
    ]
    assert fleet.monitor.state == "over"


def test_repeated_or_relayed_messages_change_no_state() -> None:
    fleet = Fleet()
    uid = fleet.record("ASV00", "chosen", "Candidate-1", 10.0)
    fleet.send("IAUV00", uid, 12.0)  # passed on before its origin has said it: not said by it
    for at_s in (20.0, 30.0, 40.0):
        fleet.send("ASV00", uid, at_s)
    assert [row[0] for row in fleet.rows] == [20.0]


def test_overdue_message_is_recorded_once() -> None:
    fleet = Fleet()
    for at_s in (50.0, 100.0, 101.0, 500.0):
        fleet.monitor.look(at_s)
    late = "overdue: nothing said in state asked for 100 s; expected: chosen by ASV00"
    assert fleet.rows == [(100.0, "", "asked", "", "", "", "asked", late)]
    fleet.say("ASV00", "chosen", "Candidate-1", 600.0)
    assert fleet.monitor.state == "chosen"


def test_run_without_faults_follows_the_choreography() -> None:
    finished = run()
    states = [row[6] for row in finished.recorder.rows(CHOREOGRAPHY.name)]
    assert states == ["half surveyed", "surveyed", "chosen", "identified", "recovered"]
    assert metric(finished, "n_violations") == 0


BY_ROLE = {**PATTERN, "message": [{**PATTERN["message"][0], "by": "Recoverer"}, *PATTERN["message"][1:]]}


def test_sender_must_play_the_role_when_the_fact_is_recorded() -> None:
    """A vehicle that left the role since may still send the fact; one that took it later may not have sent it."""
    fleet = Fleet(BY_ROLE)
    fleet.recorder.roles += [(5.0, "IAUV00", "Trident", "Recoverer", "assigned")]
    early, late = (fleet.record(name, "chosen", "Candidate-1", 10.0) for name in ("IAUV01", "IAUV00"))
    fleet.recorder.roles += [(10.0, "IAUV00", "Trident", "Recoverer", "left")]
    fleet.recorder.roles += [(12.0, "IAUV01", "Trident", "Recoverer", "assigned")]
    fleet.send("IAUV01", early, 20.0)
    fleet.send("IAUV00", late, 30.0)
    assert [(row[1], row[6], bool(row[7])) for row in fleet.rows] == [
        ("IAUV01", "asked", True),
        ("IAUV00", "chosen", False),
    ]
    fleet.say("ASV00", "verdict", "decoy", 40.0)
    fleet.say("IAUV01", "chosen", "Candidate-2", 50.0)
    assert fleet.monitor.state == "chosen"


def faults(raw: Raw) -> list[ConfigurationFault]:
    return checked(TridentMission, raw)


def put(raw: Raw, path: str, value: Any) -> None:
    """Set a key, or delete it by None; tables of a list are selected by name or number."""
    at: Any = raw
    *way, key = path.split("/")
    for part in way:
        at = at[part] if isinstance(at, dict) else at[int(part)] if part.isdecimal() else named(at, part)
    if value is None:
        del at[key]
    else:
        at[key] = value


OUTSIDE = "outside the world, x -50.0 to 450.0, y -50.0 to 350.0"
HOLD = "allowed: IAUV00 clamp, IAUV00 hover"


@pytest.mark.parametrize(("path", "value", "key", "given", "allowed"), [
    ("block/east/x_m", [150.0, 300.0], "block.east", "", "overlaps block west; allowed: blocks side by side"),
    ("block/east/name", "recovery", "block.recovery.name", '"recovery"', "used 2 times; each block needs a name"),
    ("activity/hold/service", "IAUV00 arm", "activity.hold.service", '"IAUV00 arm"', HOLD),
    ("vehicle/ASV00/sensor/console/self_test", False, "vehicle.ASV00.sensor.console.self_test", "false", ""),
    ("choreography/message/0/state", "surveing", "choreography.message.1.state", '"surveing"', ""),
    ("vehicle/IAUV00/sensor/clamp/capability", "Clmping", "vehicle.IAUV00.sensor.clamp.capability", '"Clmping"',
     "Clamping"),
    ("block/east/x_m", [220.0, 500.0], "block.east.x_m, y_m", "[500.0, 280.0]", OUTSIDE),
    ("block/west/y_m", [-50.0, 300.0], "block.west", "", "more than 1024 tiles; allowed: a greater mission.tile_m"),
])  # fmt: skip
def test_invalid_key_is_refused_with_allowed_values(path: str, value: Any, key: str, given: str, allowed: str) -> None:
    raw = tables()
    raw["mission"]["tile_m"] = 5.0
    put(raw, path, value)
    found = faults(raw)[0]
    assert (found.key, found.given) == (key, given)
    assert allowed in found.allowed


@pytest.mark.parametrize(("names", "key", "given"), [
    (("arm", "gripper"), "activity.handle.requires", '"Manipulation"'),
    (("camera", "forward sonar"), "activity.find.requires", '"TargetReacquisition"'),
])  # fmt: skip
def test_service_without_provider_is_refused(names: tuple[str, ...], key: str, given: str) -> None:
    """Reacquisition is inferred, but not for a camera at the surface: imaging there reacquires nothing."""
    raw = tables()
    for name in names:
        one = module(raw, f"IAUV00 {name}")
        named(raw["vehicle"], "IAUV00")["sensor"].remove(one)
        if name in ("camera", "forward sonar"):
            named(raw["vehicle"], "ASV00")["sensor"].append(one)
    (fault,) = faults(raw)
    assert (fault.key, fault.given) == (key, given)
    assert fault.allowed.startswith("a service that no vehicle offers; allowed: ")


def test_choreography_names_dead_ends_and_unreachable_states() -> None:
    raw = tables()
    raw["choreography"]["message"] = [one for one in raw["choreography"]["message"] if one["state"] != "rejected"]
    beyond = "cannot be reached: no message leads to it from surveying, the first state"
    beyond_it = [("choreography.state.surveying again", "", beyond), ("choreography.state.exhausted", "", beyond)]
    assert [(fault.key, fault.given, fault.allowed) for fault in faults(raw)] == [
        (
            "choreography.state.rejected",
            "",
            "is a dead end: no message leads from it to a final state, which are exhausted, recovered",
        ),
        *beyond_it,
    ]
    raw = tables()
    raw["choreography"]["message"] = [one for one in raw["choreography"]["message"] if one["to"] != "rejected"]
    assert [fault.key for fault in faults(raw)] == ["choreography.state.rejected", *(key for key, _, _ in beyond_it)]


def test_beacon_must_be_fixed_or_carried_by_a_vehicle(tmp_path: Path) -> None:
    raw = tables()
    raw["beacon"][0]["position_m"] = [0.0, 0.0]
    del raw["beacon"][1]["position_m"]
    raw["beacon"].append({"name": "ghost", "vehicle": "ASV07", "range_m": 10.0})
    raw["beacon"].append({"name": "deaf", "vehicle": "ASV00", "sensor": "usb", "range_m": 10.0})
    file = tmp_path / "own.toml"
    file.write_text(tomli_w.dumps(raw), encoding="utf-8")
    with pytest.raises(ConfigurationError) as raised:
        load(str(file))
    found = {one.key: one.allowed for one in raised.value.faults}
    assert found["beacon.positioning"] == "has both position_m and vehicle; allowed: one of them"
    assert found["beacon.transponder"] == "has neither position_m nor vehicle; allowed: one of them"
    assert found["beacon.ghost.vehicle"].startswith("allowed: ASV00, IAUV00")
    assert found["beacon.deaf.sensor"].startswith("allowed: multibeam, usbl, console")


STYLE = PlainStyle(ASV00="#0000ff", IAUV00="#ff0000")


@pytest.fixture(scope="module")
def results() -> MemoryResults:
    return MemoryResults(run(failing=("IAUV00 arm",)))


def test_service_figure_shows_availability_and_users(results: MemoryResults) -> None:
    said = statuses(results)
    assert len(said) == 13
    assert [status for _, status in said["IAUV00 arm"]] == ["available", "failed"]
    found = {(vehicle, service) for vehicle, service, _, _ in uses(results, said)}
    assert ("IAUV00", "IAUV00 gripper") in found
    assert ("IAUV00", "IAUV00 arm") not in found
    assert all(from_s <= to_s for _, _, from_s, to_s in uses(results, said))
    axes = Sheet().subplots()
    assert draw_services(axes, results, STYLE).startswith("Grey: the service reports")
    assert [label.get_text() for label in axes.get_yticklabels()] == list(said)


def test_the_choreography_has_a_step_for_each_message(results: MemoryResults) -> None:
    axes = Sheet().subplots()
    assert draw_choreography(axes, results, STYLE).endswith("Violations of the pattern: 0.")
    n_marks = sum(len(line.get_xydata()) for line in axes.lines if line.get_marker() == "o")
    assert n_marks == results.table("choreography").num_rows == 5


def test_the_map_has_every_tile_once(results: MemoryResults) -> None:
    axes = Sheet().subplots()
    draw_site(axes, results, STYLE)
    rows = results.table("charted").to_pylist()
    assert len(axes.patches) == len({(row["column"], row["row"]) for row in rows}) == 128
