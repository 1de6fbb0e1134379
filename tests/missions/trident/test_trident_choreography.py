"""The choreography: unsound patterns are found when they are loaded, violations by what is said."""

from typing import Any

import pytest
from intervening import metric, run, said, tables

from missions.trident import TridentMission
from missions.trident.choreography import CHOREOGRAPHY, Monitor, unsound
from missions.trident.scenario import ChoreographyTable
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
    """Says facts in packets, and a monitor looks."""

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


def test_states_move_with_what_is_said() -> None:
    fleet = Fleet()
    fleet.say("ASV00", "chosen", "Candidate-1", 10.0)
    fleet.say("IAUV00", "verdict", "target", 50.0)
    assert fleet.rows == [
        (10.0, "ASV00", "asked", "chosen", "recovery", "Candidate-1", "chosen", ""),
        (50.0, "IAUV00", "chosen", "verdict", "recovery", "target", "over", ""),
    ]
    assert fleet.monitor.state == "over"


def test_a_message_that_the_state_does_not_allow_is_named_and_changes_nothing() -> None:
    fleet = Fleet()
    fleet.say("IAUV00", "verdict", "target", 10.0)
    fleet.say("IAUV00", "chosen", "Candidate-1", 20.0)
    assert [row[-1] for row in fleet.rows] == ["not allowed in state asked; allowed: chosen by ASV00"] * 2
    assert fleet.monitor.state == "asked"


def test_what_is_recorded_and_not_sent_is_not_said() -> None:
    fleet = Fleet()
    uid = fleet.record("ASV00", "chosen", "Candidate-1", 10.0)
    fleet.monitor.look(60.0)
    assert fleet.rows == []
    fleet.send("ASV00", uid, 70.0)
    assert fleet.rows[0][0] == 70.0


def test_what_is_sent_again_or_passed_on_is_nothing_new() -> None:
    fleet = Fleet()
    uid = fleet.record("ASV00", "chosen", "Candidate-1", 10.0)
    fleet.send("IAUV00", uid, 12.0)  # passed on before its origin has said it: not said by it
    for at_s in (20.0, 30.0, 40.0):
        fleet.send("ASV00", uid, at_s)
    assert [row[0] for row in fleet.rows] == [20.0]


def test_who_is_late_is_named_once() -> None:
    fleet = Fleet()
    for at_s in (50.0, 100.0, 101.0, 500.0):
        fleet.monitor.look(at_s)
    late = "overdue: nothing said in state asked for 100 s; expected: chosen by ASV00"
    assert fleet.rows == [(100.0, "", "asked", "", "", "", "asked", late)]
    fleet.say("ASV00", "chosen", "Candidate-1", 600.0)
    assert fleet.monitor.state == "chosen"


def test_a_pattern_has_no_dead_end_and_no_state_out_of_reach() -> None:
    states = [one["name"] for one in PATTERN["state"]]  # type: ignore[index]
    arrows = [(one["state"], one["to"]) for one in PATTERN["message"]]  # type: ignore[index]
    assert list(unsound(states, ["over"], arrows)) == []
    assert [state for state, _ in unsound([*states, "lost"], ["over"], arrows)] == ["lost", "lost"]
    circle = [("asked", "chosen"), ("chosen", "asked")]
    assert [state for state, _ in unsound(["asked", "chosen"], [], circle)] == ["asked", "chosen"]


def test_a_run_without_faults_keeps_to_the_pattern() -> None:
    finished = run()
    states = [row[6] for row in finished.recorder.rows(CHOREOGRAPHY.name)]
    assert states == ["half surveyed", "surveyed", "chosen", "identified", "recovered"]
    assert metric(finished, "n_violations") == 0


@pytest.mark.parametrize("failing", ["ASV00 console"])
def test_a_run_that_does_what_the_pattern_forbids_is_found_out(failing: str) -> None:
    """The AUV chooses by itself, since the console has failed; a pattern by which it may not says so."""
    told = [f'{{state="{one}",says="surveyedBy",to="{to}"}}' for one, to in (("a", "b"), ("b", "c"))]
    told.append('{state="c",says="chosen",by="ASV00",to="d"}')
    states = ",".join(f'{{name="{one}"}}' for one in "abc") + ',{name="d",final=true}'
    pattern = (f"choreography.state=[{states}]", f"choreography.message=[{','.join(told)}]")
    finished = run(*pattern, failing=(failing,))
    (_, chooser, _, chosen) = said(finished, "chosen")[0]
    assert chooser == "IAUV00"
    violations = [row for row in finished.recorder.rows(CHOREOGRAPHY.name) if row[-1]]
    assert violations[0][1:6] == ("IAUV00", "c", "chosen", "recovery", chosen)
    assert violations[0][-1] == "not allowed in state c; allowed: chosen by ASV00"


BY_ROLE = {**PATTERN, "message": [{**PATTERN["message"][0], "by": "Recoverer"}, *PATTERN["message"][1:]]}


def test_a_message_is_of_who_plays_the_role_when_it_finds_it_out() -> None:
    """Who leaves the role before it is heard may say so still; who took it later may not have said it before."""
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


@pytest.mark.parametrize(("by", "n"), [("Recoverer", 0), ("IAUV00", 2)])
def test_a_lawful_takeover_breaks_no_pattern_of_roles(by: str, n: int) -> None:
    """The same run, read by a pattern that names the vehicle, has violations: the target is identified by another."""
    told = [f'{{state="{one}",says="surveyedBy",to="{to}"}}' for one, to in (("a", "b"), ("b", "c"))]
    told += ['{state="c",says="chosen",to="d"}', f'{{state="d",says="verdict",value="target",by="{by}",to="e"}}']
    told += [f'{{state="e",says="recoveredBy",by="{by}",to="f"}}']
    states = ",".join(f'{{name="{one}"}}' for one in "abcde") + ',{name="f",final=true}'
    pattern = (f"choreography.state=[{states}]", f"choreography.message=[{','.join(told)}]")
    finished = run("fleet.size=3", *pattern, failing=("IAUV00 arm", "IAUV00 gripper"), at_s=100.0, seed=3)
    assert finished.completed, finished.reason
    assert metric(finished, "n_violations") == n


def test_a_speaker_that_is_neither_vehicle_nor_role_is_refused() -> None:
    raw = tables()
    raw["choreography"]["message"][3]["by"] = "Captain"
    (fault,) = TridentMission.check(raw)
    assert (fault.key, fault.given) == ("choreography.message.4.by", '"Captain"')
    assert "IAUV00" in fault.allowed
    assert "Recoverer" in fault.allowed
