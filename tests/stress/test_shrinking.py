"""Shrinking: what is left takes every fault that it has, whatever became shorter on the way."""

from small_sea import small_plan

from stress.drawing import schedule_of
from stress.schedule import Schedule, StressFault
from stress.shrinking import shrunk
from stress.trial import Broken, Outcome

LONG = StressFault(kind="loss", vehicle="AUV00", at_s=20.0, until_s=200.0, share=0.4)
BESIDE = StressFault(kind="echo", vehicle="AUV01", at_s=30.0, until_s=50.0)
NEEDLESS = StressFault(kind="twice", vehicle="AUV02", at_s=40.0, until_s=60.0)


def judged(schedule: Schedule) -> Outcome:
    """Broken by a loss that is short, or by a long one beside another fault."""
    lost = [one for one in schedule.fault if one.kind == "loss"]
    is_short = any((one.until_s or 0.0) - one.at_s < 100.0 for one in lost)
    is_broken = is_short or bool(lost and BESIDE in schedule.fault)
    broken = Broken("rest", 300.0, "") if is_broken else None
    return Outcome(schedule, broken, ("rest",), {}, {}, False, 300.0, "", 0.0)


def test_no_fault_is_left_that_can_be_left_out_once_another_is_shorter() -> None:
    outcome = judged(schedule_of(small_plan(), 1).with_faults((LONG, BESIDE, NEEDLESS)))
    small = shrunk(outcome, judged)
    assert [one.kind for one in small.schedule.fault] == ["loss"]
