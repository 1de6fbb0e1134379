"""The social layer on a fleet at rest: what is assigned, by whom it may be, and from when it counts.

The vehicles are those of the shipped mapping mission at time 0, before anything has been said: ASV00 is the
MissionAdministrator of the Coordination group, AUV00 its Tactician and Coordinator of the Operational group, AUV01
and AUV02 are Performers.
"""

from itertools import chain, permutations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from resting import fleet_at_rest, miss, named, say, stated

from remoras.fleet.fleet import Fleet
from remoras.fleet.vehicle import Vehicle
from remoras.organisation.leadership import HEAD_TERM, HEADED_BY
from remoras.social.conclusions import Gatherings
from remoras.social.consultation import holders_after
from remoras.social.view import Instruction
from worldmodel import Block, merge


def hear(vehicle: Vehicle, *blocks: Block) -> None:
    for block in blocks:
        vehicle.social.consider(merge(vehicle.beliefs.model, [block]).changes)


LEFT = ("AUV01", "playsRole", "Operational.LeftWinger")
# Consultation -------------------------------------------------------------------------------------


AUVS = st.sampled_from(["AUV00", "AUV01", "AUV02"])
ORDERS = st.tuples(AUVS, st.sampled_from(["playsRole", "leftRole"]), AUVS)
CLAIMS = st.tuples(AUVS, st.sampled_from([1, 2, 3]))
OWN = st.tuples(AUVS, st.sampled_from(["available", "sensorsWork"]), st.booleans())


@settings(max_examples=40)
@given(st.lists(ORDERS | CLAIMS | OWN, max_size=8), st.sets(AUVS, max_size=2), st.randoms())
def test_nor_does_it_where_several_lead_one_after_another(words, absent, draws) -> None:
    """Vehicles claim to lead the group, give and take a role, with authority or without, and say if they take jobs."""
    found, blocks = [], []
    with fleet_at_rest() as speaking:
        for number, (speaker, *word) in enumerate(words):
            match word:
                case [attribute, bool(value)]:
                    facts = [(speaker, attribute, value)]
                case [attribute, str(assignee)]:
                    facts = [(assignee, attribute, LEFT[2])]
                case [term]:
                    facts = [("Operational", HEADED_BY, speaker), ("Operational", HEAD_TERM, term)]
            blocks.append(stated(named(speaking, speaker), *facts, now_s=1.0 + number))
    for order in (blocks, draws.sample(blocks, len(blocks))):
        with fleet_at_rest() as fleet:
            listening = named(fleet, "ASV00")
            miss(listening, *absent)
            for block in order:
                hear(listening, block)
                listening.social.consult()
            view = listening.social.organisation
            found.append((view.heads("Operational"), view.members("Operational", "LeftWinger")))
    assert found[0] == found[1]


def test_a_head_claims_again_against_who_was_out_of_reach(fleet: Fleet) -> None:
    """AUV00 did not hear that AUV01 has its place, and claims the group above; all but itself refuse that."""
    away, head, other = named(fleet, "AUV00"), named(fleet, "ASV00"), named(fleet, "AUV01")
    taken = say(other, ("Operational", HEADED_BY, "AUV01"), ("Operational", HEAD_TERM, 1), now_s=1.0)
    claimed = say(away, ("Coordination", HEADED_BY, "AUV00"), ("Coordination", HEAD_TERM, 1), now_s=2.0)
    miss(away, "ASV00")
    for vehicle in (head, other):
        miss(vehicle, "AUV00")
    away.social.consult()
    for listening, blocks in ((head, (taken, claimed)), (other, (claimed,)), (away, (taken,))):
        hear(listening, *blocks)
        listening.social.consult()
    assert head.social.organisation.heads("Coordination") == ("ASV00",)
    assert away.social.organisation.heads("Coordination") == ("AUV00",)
    assert not other.social.claims(), "it leads another group"
    (again,) = head.social.claims()
    assert (again[0][2], again[1][2]) == (head.beliefs.uid("ASV00"), 2)
    said = head.beliefs.model.record(again, 3.0)
    head.social.consider([said])
    for listening in (other, away):
        hear(listening, said.block)
    for vehicle in (head, other, away):
        vehicle.social.consult()
        assert vehicle.social.organisation.heads("Coordination") == ("ASV00",)
        if vehicle is not away:
            assert not vehicle.social.claims()
    words = away.social.claims()  # it assents to ASV00, and was there when AUV01 took its own place
    assert [one[:3:2] for one in chain(*words)] == [
        (away.beliefs.uid("Coordination"), away.beliefs.uid("ASV00")), (away.beliefs.uid("Coordination"), 2),
        (away.beliefs.uid("Operational"), away.beliefs.uid("AUV00")), (away.beliefs.uid("Operational"), 2),
    ]  # fmt: skip
    for word in words:
        change = away.beliefs.model.record(word, 4.0)
        away.social.consider([change])
        for listening in (head, other):
            hear(listening, change.block)
    for vehicle in (head, other, away):
        miss(vehicle)
        vehicle.social.consult()
        assert vehicle.social.organisation.heads("Coordination") == ("ASV00",)
        assert vehicle.social.organisation.heads("Operational") == ("AUV00",)
    (assent,) = other.social.claims()
    assert assent[0][:3:2] == (other.beliefs.uid("Operational"), other.beliefs.uid("AUV00"))


WORDS = {
    "the first of two": (["AUV01", "AUV02"], ["AUV01"], ["AUV02"]),
    "given away": (["AUV01", "-AUV01", "AUV02"], ["AUV02"], []),
    "moved past who waits": (["AUV01", "AUV02", "-AUV01", "AUV00"], ["AUV00"], ["AUV02"]),
    "the first after another": (["AUV01", "-AUV01", "AUV00", "AUV02"], ["AUV00"], ["AUV02"]),
    "the newest that waits": (["AUV01", "AUV02", "AUV00", "-AUV01"], ["AUV00"], ["AUV02"]),
    "left by all": (["AUV01", "AUV02", "-AUV01", "-AUV02"], [], []),
}


@pytest.mark.parametrize("name", WORDS)
def test_an_assignment_finds_room_or_waits(name: str) -> None:
    said, holders, waiting = WORDS[name]
    words = [
        Instruction((float(number), 0, 0, number, 0), word[0] != "-", word.removeprefix("-"))
        for number, word in enumerate(said)
    ]
    for order in permutations(words):
        assert holders_after(order, 1) == (set(holders), waiting)


# Meeting ------------------------------------------------------------------------------------------


def test_a_meeting_that_was_concluded_alone_counts_only_while_the_vehicle_is_cut_off(fleet: Fleet) -> None:
    beliefs, key = named(fleet, "AUV00").beliefs, ("gatheredAt", "Operational")
    gatherings = Gatherings(beliefs, ["Operational", "Coordination"], {})
    for group in ("Operational", "Coordination"):
        say(named(fleet, "AUV00"), (group, "gatheredAt", f"{group.lower()} rally"), now_s=10.0)
    gatherings.note_alone([key, ("areaDone", "left")], 10.0)
    assert gatherings.believed(cut_off=True) == {"Operational", "Coordination"}
    assert gatherings.believed(cut_off=False) == {"Coordination"}
    assert gatherings.concluded_alone == {key}
