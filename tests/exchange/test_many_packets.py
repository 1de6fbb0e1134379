"""A sample of what `tests.tools.many_packets` throws: every form of packets, random and mangled."""

import pytest

from tests.tools.many_packets import Task, Toll, kept_bytes, reason_of, thrown
from tests.tools.mission_packets import FORMS

QUICK = {form.name: form for form in FORMS}["restarts, crc 32"]


def test_bad_packets_of_missions_harm_nothing() -> None:
    tolls = [thrown(Task(QUICK, ways, 700, 7)) for ways in ("random", "mangled")]
    for toll in tolls:
        assert toll.is_well, toll
        assert toll.thrown[QUICK.name] == 700
    assert tolls[1].again[QUICK.name] > 0
    assert sum(tolls[1].reasons.values()) == tolls[1].refused[QUICK.name] > 600
    assert tolls[1] == thrown(Task(QUICK, "mangled", 700, 7))


def test_what_must_not_happen_is_told() -> None:
    for name in ("taken", "false_beliefs", "unknown"):
        toll = Toll()
        getattr(toll, name)["plain"] = 1
        assert toll.is_well
        getattr(toll, name)["key"] = 1
        assert not toll.is_well
    toll = Toll()
    toll.raised["plain: ZeroDivisionError"] = 1
    assert not toll.is_well


def test_refusals_are_counted_without_names_and_numbers() -> None:
    assert reason_of("instance 2047 is not one of 22") == "instance N is not one of N"
    assert reason_of("position is (3.0, 4.0), out of its range") == "a value is out of its range"
    assert reason_of("note: b'\\xff' is no text: it has a NUL") == "a text is none"
    assert reason_of("mappedCell: 700 of 101") == "a value is none of its attribute"


@pytest.mark.slow
def test_every_form_holds_and_keeps_nothing() -> None:
    for number, form in enumerate(FORMS):
        toll = thrown(Task(form, "mangled", 300, number))
        assert toll.is_well, toll
        assert toll.refused[form.name] > 200
    first, last = kept_bytes(QUICK, seed=3, n=300)
    assert last - first < 2000
