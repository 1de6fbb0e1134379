"""The social layer on a fleet at rest: assignments, authority, and times of effect.

The vehicles are those of the shipped mapping mission at time 0, before anything has been said: ASV00 is the
MissionAdministrator of the Coordination group, AUV00 its Tactician and Coordinator of the Operational group, AUV01
and AUV02 are Performers.
"""

from itertools import permutations

import pytest
from resting import named, say

from remoras.fleet.fleet import Fleet
from remoras.social.conclusions import Gatherings
from remoras.social.consultation import holders_after
from remoras.social.view import Instruction

# Consultation -------------------------------------------------------------------------------------


WORDS = {
    "the first of two": (["AUV01", "AUV02"], ["AUV01"], ["AUV02"]),
    "given away": (["AUV01", "-AUV01", "AUV02"], ["AUV02"], []),
    "moved past who waits": (["AUV01", "AUV02", "-AUV01", "AUV00"], ["AUV00"], ["AUV02"]),
    "the first after another": (["AUV01", "-AUV01", "AUV00", "AUV02"], ["AUV00"], ["AUV02"]),
    "the newest that waits": (["AUV01", "AUV02", "AUV00", "-AUV01"], ["AUV00"], ["AUV02"]),
    "left by all": (["AUV01", "AUV02", "-AUV01", "-AUV02"], [], []),
}


@pytest.mark.parametrize("name", WORDS)
def test_an_assignment_takes_a_vacancy_or_is_deferred(name: str) -> None:
    said, holders, waiting = WORDS[name]
    words = [
        Instruction((float(number), 0, 0, number, 0), word[0] != "-", word.removeprefix("-"))
        for number, word in enumerate(said)
    ]
    for order in permutations(words):
        assert holders_after(order, 1) == (set(holders), waiting)


# Meeting ------------------------------------------------------------------------------------------


def test_a_rendezvous_concluded_in_isolation_is_valid_only_while_isolated(fleet: Fleet) -> None:
    beliefs, key = named(fleet, "AUV00").beliefs, ("gatheredAt", "Operational")
    gatherings = Gatherings(beliefs, ["Operational", "Coordination"], {})
    for group in ("Operational", "Coordination"):
        say(named(fleet, "AUV00"), (group, "gatheredAt", f"{group.lower()} rally"), now_s=10.0)
    gatherings.note_alone([key, ("areaDone", "left")], 10.0)
    assert gatherings.believed(cut_off=True) == {"Operational", "Coordination"}
    assert gatherings.believed(cut_off=False) == {"Coordination"}
    assert gatherings.concluded_alone == {key}
