"""Trials: every kind changes something, plug-ins that break their promise are named, runs repeat, promises follow."""

from collections.abc import Sequence
from typing import Any

import pytest
from small_sea import small_plan

from stress.campaign import judge
from stress.drawing import schedule_of
from stress.kinds import KINDS
from stress.schedule import Schedule, StressFault
from stress.trial import Outcome

SPELL = {"at_s": 20.0, "until_s": 200.0}
HURT = ("bits", "cut", "forged")
LINKS = [name for name, kind in KINDS.items() if kind.family == "links" and name not in (*HURT, "partition")]


def with_faults(*faults: StressFault, **about: Any) -> Schedule:
    """The small mission under these faults, healed at 250 s."""
    schedule = schedule_of(small_plan(), 1).with_faults(faults)
    settings = {"heal_s": 250.0, "bound_s": 1500.0, **about}
    return schedule.model_copy(update={"stress": schedule.stress.model_copy(update=settings)})


def fault(kind: str, vehicle: str = "AUV01", **keys: Any) -> StressFault:
    return StressFault(kind=kind, vehicle=vehicle, **{**SPELL, **keys})


def linked(kinds: Sequence[str]) -> list[StressFault]:
    return [fault(kind, "AUV00", share=0.3) for kind in kinds]


CASES: dict[str, list[StressFault]] = {
    "links": [*linked(LINKS), fault("partition", "AUV02", peer="AUV01")],
    "damage": linked(HURT),
    "vehicles": [
        fault("lost", "ASV00"), fault("mute", "AUV00", until_s=40.0), fault("deaf", "AUV00", at_s=50.0, until_s=90.0),
        fault("restarts", memory="kept"), fault("slow", "AUV02", factor=0.5), fault("drains", "AUV02", drain_w=50.0),
        StressFault(kind="joins", vehicle="AUV02", at_s=30.0), fault("clock", by_s=2.0, at_s=100.0),
    ],
    "sensors": [
        fault("sensor", "AUV00", at_s=100.0), fault("random"), fault("frozen", "AUV02"),
        fault("misplaced", "ASV00", share=0.5),
    ],
    "minds": [
        StressFault(kind="forged-role", vehicle="AUV02", at_s=50.0), fault("sulks", "AUV02", until_s=400.0),
        StressFault(kind="forged-objective", vehicle="AUV02", at_s=60.0),
        StressFault(kind="forged-done", vehicle="AUV02", at_s=70.0),
        StressFault(kind="forged-lead", vehicle="AUV01", at_s=80.0, term=64),
        StressFault(kind="forged-lead", vehicle="AUV02", at_s=90.0, term=255),
    ],
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_every_kind_changes_something_and_nothing_breaks(case: str) -> None:
    outcome = judge(with_faults(*CASES[case]))
    assert outcome.broken is None, outcome.broken
    assert set(outcome.happened) == {one.kind for one in CASES[case]}


def test_all_kinds_are_among_the_cases() -> None:
    tried = {one.kind for case in CASES.values() for one in case}
    assert set(KINDS) - tried == {"raises", "malformed", "biased"}


@pytest.mark.parametrize("kind", ["raises", "malformed"])
def test_a_strategy_that_breaks_its_promise_ends_the_run_with_its_name(kind: str) -> None:
    outcome = judge(with_faults(StressFault(kind=kind, vehicle="AUV00", at_s=30.0)))
    assert outcome.broken is None
    assert outcome.happened == {kind: 1}
    assert outcome.end_s < 60.0


@pytest.mark.slow
def test_the_same_schedule_gives_the_same_tables_and_another_seed_others() -> None:
    faults = linked(["loss"])
    one, same, other = (judge(with_faults(*faults, seed=seed)) for seed in (1, 1, 2))
    assert one.digest == same.digest != other.digest


def promised(*faults: StressFault, settings: tuple[str, ...] = ()) -> set[str]:
    schedule = with_faults(*faults, bound_s=30.0, heal_s=25.0, must_finish=False)
    own = (*schedule.stress.settings, *settings)
    about = schedule.stress.model_copy(update={"settings": own})
    return set(judge(schedule.model_copy(update={"stress": about})).judged)


def test_a_checksum_makes_promises_hold_under_damage() -> None:
    brief = fault("bits", at_s=5.0, until_s=20.0)
    without, checked = promised(brief), promised(brief, settings=("communication.crc_bits=32",))
    assert "beliefs" not in without
    assert "exceptions" in without
    assert checked - without == {
        "beliefs", "recorded", "whole-blocks", "remembered", "sound-packets", "agreement", "rest", "authority",
        "cardinality",
    }  # fmt: skip


def test_who_is_not_asked_to_finish_is_not_said_to_have_held_that() -> None:
    lenient, strict = (judge(with_faults(must_finish=asked)) for asked in (False, True))
    assert ("finishes" in lenient.judged, "finishes" in lenient.not_promised) == (False, True)
    assert ("finishes" in strict.judged, "finishes" in strict.not_promised) == (True, False)


def test_who_would_not_finish_without_faults_either_is_not_asked() -> None:
    def finishing(bound_s: float) -> Outcome:
        return judge(with_faults(fault("mute", until_s=60.0), bound_s=bound_s, heal_s=60.0))

    hopeless, usual = finishing(100.0), finishing(1500.0)
    assert hopeless.broken is None
    assert "finishes" not in hopeless.judged
    assert "finishes" in usual.judged
    assert usual.completed
