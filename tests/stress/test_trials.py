"""Trials: every kind of fault has an effect, and the active protections decide which invariants must hold."""

from collections.abc import Sequence
from typing import Any

import pytest
from stress.schedules import DAMAGE, KINDS, LINKS, SMALL, Schedule, StressFault
from stress.trial import judge

SPELL = {"at_s": 20.0, "until_s": 200.0}


def with_faults(*faults: StressFault, **about: Any) -> Schedule:
    """The small mission under these faults, healed at 250 s."""
    return Schedule(**{"seed": 1, "heal_s": 250.0, "bound_s": 1500.0, "fault": faults, **about})


def fault(kind: str, vehicle: str = "AUV01", **keys: Any) -> StressFault:
    return StressFault(kind=kind, vehicle=vehicle, **{**SPELL, **keys})


def sudden(kind: str, vehicle: str, at_s: float, **keys: Any) -> StressFault:
    return StressFault(kind, at_s, vehicle, **keys)


def linked(kinds: Sequence[str]) -> list[StressFault]:
    return [fault(kind, "AUV00", share=0.3) for kind in kinds]


CASES: dict[str, list[StressFault]] = {
    "links": [*linked(sorted({*LINKS} - DAMAGE - {"partition"})), fault("partition", "AUV02", peer="AUV01")],
    "damage": linked(sorted(DAMAGE.intersection(LINKS))),
    "vehicles": [
        fault("lost", "ASV00"), fault("mute", "AUV00", until_s=40.0), fault("deaf", "AUV00", at_s=50.0, until_s=90.0),
        fault("restarts", memory="kept"), fault("slow", "AUV02", factor=0.5), fault("drains", "AUV02", drain_w=50.0),
        sudden("joins", "AUV02", 30.0), fault("clock", by_s=2.0, at_s=100.0),
    ],
    "sensors": [
        fault("sensor", "AUV00", at_s=100.0), fault("random"), fault("frozen", "AUV02"),
        fault("misplaced", "ASV00", share=0.5),
    ],
    "minds": [
        sudden("forged-role", "AUV02", 50.0), fault("sulks", "AUV02", until_s=400.0),
        sudden("forged-objective", "AUV02", 60.0), sudden("forged-done", "AUV02", 70.0),
        sudden("forged-lead", "AUV01", 80.0, term=64), sudden("forged-lead", "AUV02", 90.0, term=255),
    ],
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_every_fault_kind_has_an_effect_and_violates_nothing(case: str) -> None:
    outcome = judge(with_faults(*CASES[case]))
    assert outcome.broken is None, outcome.broken
    assert outcome.happened == {one.kind for one in CASES[case]}


def test_the_cases_cover_every_fault_kind() -> None:
    assert {one.kind for case in CASES.values() for one in case} == set(KINDS)


def promised(*settings: str) -> set[str]:
    brief = fault("bits", at_s=5.0, until_s=20.0)
    return set(judge(with_faults(brief, settings=(*SMALL, *settings), bound_s=30.0, must_finish=False)).judged)


def test_a_checksum_keeps_invariants_under_damaged_packets() -> None:
    without, checked = promised(), promised("communication.crc_bits=32")
    assert "exceptions" in without
    assert checked - without == {
        "beliefs", "recorded", "remembered", "sound-packets", "agreement", "rest", "authority",
        "cardinality",
    }  # fmt: skip
