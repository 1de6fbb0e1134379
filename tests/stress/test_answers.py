"""What says how long it holds does so; what does not is named, with method, vehicle and time."""

from collections.abc import Sequence
from dataclasses import replace

import pytest
from small_sea import small_plan

from missions.mapping.behaviours import ZigzagExploring
from remoras.behaviours import CAPTURE_M, Homing, Reference
from remoras.executive.decision import Choice
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.strategies.dispatch import Dispatcher
from remoras.strategy import Move, Situation
from stress.campaign import judge
from stress.drawing import schedule_of

ANSWERS = ("stress.invariants.answers:AnswersHold",)


@pytest.mark.parametrize("seed", range(1, 5))
def test_references_hold_as_long_as_they_say(seed: int) -> None:
    outcome = judge(schedule_of(small_plan(), seed), ANSWERS)
    assert outcome.broken is None, outcome.broken
    assert "answers" in outcome.judged


@pytest.mark.parametrize("behaviour", [ZigzagExploring, Homing])
def test_a_reference_that_changes_before_is_named(
    behaviour: type[ZigzagExploring] | type[Homing], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It says that it holds all the way, and slows down 10 m before."""
    asked = behaviour.reference

    def boasting(self: ZigzagExploring | Homing, motion: Motion, picture: Picture) -> Reference | None:
        reference = asked(self, motion, picture)  # type: ignore[arg-type]
        if reference is None or reference.holds_m > 100.0:
            return reference
        to_go_m = abs(reference.target_m[0] - motion.x_m) + abs(reference.target_m[1] - motion.y_m)
        return reference._replace(speed_mps=reference.speed_mps * (0.9 if to_go_m < 10.0 else 1.0), holds_m=CAPTURE_M)

    monkeypatch.setattr(behaviour, "reference", boasting)
    outcome = judge(schedule_of(small_plan(), 1).with_faults(()), ANSWERS)
    assert outcome.broken is not None
    assert outcome.broken.invariant == "answers"
    assert f"{behaviour.__name__}.reference of " in outcome.broken.text


def test_a_decision_that_should_have_changed_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first that is found stands for good, whatever moves the vehicle."""
    searched = Choice.searched

    def stubborn(self: Choice, motivations: Sequence[float]) -> tuple[int, ...]:
        found: tuple[int, ...] = self.__dict__.setdefault("found", searched(self, motivations))
        return found

    monkeypatch.setattr(Choice, "best", stubborn)
    outcome = judge(schedule_of(small_plan(), 1).with_faults(()), ANSWERS)
    assert outcome.broken is not None
    assert outcome.broken.invariant == "answers"
    assert "the decision of " in outcome.broken.text


def test_a_move_that_stands_too_long_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """A head says that it has nothing to state until there is news: what is left of jobs is none."""
    asked = Dispatcher.negotiate

    def boasting(self: Dispatcher, situation: Situation) -> Move:
        return replace(asked(self, situation), until_news=True, holding=bool(situation.round % 7))

    monkeypatch.setattr(Dispatcher, "negotiate", boasting)
    outcome = judge(schedule_of(small_plan(), 1).with_faults(()), ANSWERS)
    assert outcome.broken is not None
    assert outcome.broken.invariant == "answers"
    assert "negotiate of " in outcome.broken.text
