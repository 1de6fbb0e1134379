"""The social layer on a fleet at rest: what is assigned, by whom it may be, and from when it counts.

The vehicles are those of the shipped mapping mission at time 0, before anything has been said: ASV00 is the
MissionAdministrator of the Coordination group, AUV00 its Tactician and Coordinator of the Operational group, AUV01
and AUV02 are Performers.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain, permutations
from random import Random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.activities import Objective
from remoras.fleet import Fleet
from remoras.organisation import Organisation, Outcome, RoleAssignment
from remoras.social.gatherings import Gatherings
from remoras.social.layer import SocialLayer
from remoras.social.leadership import HEAD_TERM, HEADED_BY
from remoras.social.role_holders import holders_after
from remoras.social.view import Instruction
from remoras.vehicle import Vehicle
from worldmodel import Block, merge

SETUP = resolved(load("mapping-rendezvous"))
Said = tuple[str, str, Any]  # subject, attribute, value: by name


@pytest.fixture
def fleet() -> Iterator[Fleet]:
    assembled = assemble(SETUP, seed=1)
    yield assembled
    assembled.close()


def named(fleet: Fleet, name: str) -> Vehicle:
    return next(vehicle for vehicle in fleet.vehicles if vehicle.name == name)


def say(vehicle: Vehicle, *facts: Said, now_s: float = 1.0) -> Block:
    """``vehicle`` makes the facts known and takes note of them itself."""
    change = vehicle.beliefs.model.record([vehicle.beliefs.fact(*fact) for fact in facts], now_s)
    vehicle.social.consider([change])
    return change.block


def moved(vehicle: Vehicle) -> tuple[list[RoleAssignment], list[RoleAssignment]]:
    """Roles that a vehicle itself took in the last round, and that it left."""
    view = vehicle.social.standing.view
    taken, left = ([role for role in roles if role.vehicle == vehicle.name] for roles in (view.assigned, view.left))
    return taken, left


def hear(vehicle: Vehicle, *blocks: Block) -> None:
    for block in blocks:
        vehicle.social.consider(merge(vehicle.beliefs.model, [block]).changes)


LEFT = ("AUV01", "playsRole", "Operational.LeftWinger")
EXPLORE_LEFT = ("Operational.LeftWinger", "objectiveExploring", "left")


# Modules ------------------------------------------------------------------------------------------


def test_the_modules_of_the_paper(fleet: Fleet) -> None:
    """Section IV.A: AUV Database, Optimizer of organizational performances, Groups, Roles; Missions, Mission
    planner, Individual objectives, Collective objectives coordination."""
    social = named(fleet, "AUV00").social
    assert social.database.names == ("ASV00", "AUV00", "AUV01", "AUV02")
    assert social.strategy.name == "remoras"
    assert {group: social.organisation.members(group) for group in social.organisation.groups} == {
        "Coordination": ("ASV00", "AUV00"),
        "Operational": ("AUV00", "AUV01", "AUV02"),
    }
    assert social.organisation.assignments == {
        RoleAssignment("Coordination", "MissionAdministrator", "ASV00"),
        RoleAssignment("Coordination", "Tactician", "AUV00"),
        RoleAssignment("Operational", "Coordinator", "AUV00"),
        RoleAssignment("Operational", "Performer", "AUV01"),
        RoleAssignment("Operational", "Performer", "AUV02"),
    }
    assert social.missions == {"Coordination": ("Supervision",)}
    assert social.plan_missions().facts == []  # its group has no mission yet
    supervision = Objective("Operational", "Coordinator", "GroupSupervision", "Operational")
    assert social.objectives_of("AUV00") == (supervision,)
    assert social.objectives_of("AUV01") == ()


def test_who_leads(fleet: Fleet) -> None:
    led = {
        vehicle.name: [group for group in vehicle.social.organisation.groups if vehicle.social.leads(group)]
        for vehicle in fleet.vehicles
    }
    assert led == {"ASV00": ["Coordination"], "AUV00": ["Operational"], "AUV01": [], "AUV02": []}


# Consultation -------------------------------------------------------------------------------------


def test_an_assignment_counts_from_the_end_of_the_round(fleet: Fleet) -> None:
    issuer, heard = named(fleet, "AUV00"), named(fleet, "AUV01")
    block = say(issuer, LEFT)
    hear(heard, block)
    for vehicle in (issuer, heard):
        assert vehicle.social.standing.is_due
        assert not vehicle.social.organisation.plays("AUV01", "Operational", "LeftWinger")
    result = heard.social.consult()
    assert moved(heard) == ([RoleAssignment("Operational", "LeftWinger", "AUV01")], [])
    assert result.activities_due
    assert heard.social.organisation.plays("AUV01", "Operational", "LeftWinger")
    # who issued it waits for the same moment, and it is not its own role
    issuer.social.consult()
    assert moved(issuer) == ([], [])
    assert issuer.social.organisation.plays("AUV01", "Operational", "LeftWinger")
    # who has not heard it does not know
    assert not named(fleet, "AUV02").social.organisation.plays("AUV01", "Operational", "LeftWinger")


@pytest.mark.parametrize("work", [True, False])
def test_who_says_that_its_sensors_are_dead_is_given_no_area(fleet: Fleet, work: bool) -> None:
    head = named(fleet, "AUV00")
    hear(head, say(named(fleet, "AUV01"), ("AUV01", "sensorsWork", work)))
    say(head, LEFT, ("AUV01", "playsRole", "Operational.Cartographer"), now_s=2.0)
    head.social.consult()
    plays = [head.social.organisation.plays("AUV01", "Operational", role) for role in ("LeftWinger", "Cartographer")]
    assert plays == [work, True]


@pytest.mark.parametrize(("is_available", "has_heard"), [(True, False), (False, True), (False, False)])
def test_a_job_is_taken_back_from_who_takes_none_and_has_not_heard_of_it(
    fleet: Fleet, is_available: bool, has_heard: bool
) -> None:
    """AUV01 may have been deaf when it was given the job; what it has heard of it does first, though it is cut off."""
    head = named(fleet, "AUV00")
    say(head, LEFT)
    head.social.consult()
    hear(head, say(named(fleet, "AUV01"), ("AUV01", "available", is_available), now_s=2.0))
    head.social.consult()
    head.social._picture.peers.unheard = {} if has_heard else {"AUV01": {"Operational.LeftWinger"}}
    stated = head.social.negotiate(3.0, head.functional.motion, {})
    left = head.beliefs.fact("AUV01", "leftRole", "Operational.LeftWinger")
    assert (([left], True) in stated) == (not is_available and not has_heard)


def test_a_round_is_over_once(fleet: Fleet) -> None:
    heard = named(fleet, "AUV01")
    hear(heard, say(named(fleet, "AUV00"), LEFT))
    heard.social.consult()
    assert not heard.social.standing.is_due
    heard.social.consult()
    assert moved(heard) == ([], [])


def test_what_was_heard_twice_counts_once(fleet: Fleet) -> None:
    heard = named(fleet, "AUV01")
    block = say(named(fleet, "AUV00"), LEFT)
    hear(heard, block, block)
    result = heard.social.consult()
    assert [ruling.event for ruling in result.rulings] == ["assigned"]


def test_who_is_no_member_may_still_give_a_group_its_mission(fleet: Fleet) -> None:
    """REMORAS IV.B: an AUV can plan a mission for a group of which it is not a member."""
    heard = named(fleet, "AUV00")
    assert not heard.social.planner.due
    hear(heard, say(named(fleet, "ASV00"), ("Operational", "hasMission", "AreaMapping")))
    assert heard.social.missions == {"Coordination": ("Supervision",), "Operational": ("AreaMapping",)}
    assert heard.social.planner.due


def test_a_mission_is_planned_by_who_leads_the_group(fleet: Fleet) -> None:
    heard = named(fleet, "AUV01")
    hear(heard, say(named(fleet, "ASV00"), ("Operational", "hasMission", "AreaMapping")))
    assert heard.social.missions["Operational"] == ("AreaMapping",)
    assert not heard.social.planner.due


def test_more_holders_than_a_role_allows_are_refused(fleet: Fleet) -> None:
    """Both are assigned in one round: what was said earlier counts, at every vehicle alike."""
    first = say(named(fleet, "AUV00"), LEFT, now_s=1.0)
    second = say(named(fleet, "AUV00"), ("AUV02", "playsRole", "Operational.LeftWinger"), now_s=2.0)
    for name, order in (("AUV01", (first, second)), ("ASV00", (second, first))):
        vehicle = named(fleet, name)
        hear(vehicle, *order)
        result = vehicle.social.consult()
        refused = [one for one in result.rulings if one.event == "refused"]
        assert [(one.asked.assignee, one.outcome) for one in refused] == [("AUV02", Outcome.NO_ROOM)]
        assert vehicle.social.organisation.members("Operational", "LeftWinger") == ("AUV01",)


@settings(max_examples=60)
@given(st.lists(st.tuples(st.sampled_from(["AUV00", "AUV01", "AUV02"]), st.booleans()), max_size=6), st.randoms())
def test_who_holds_a_role_does_not_depend_on_what_was_heard_first(words: list[tuple[str, bool]], draws: Random) -> None:
    """A head gives a role with room for one, and takes it; each block is heard in a round of its own."""
    fleet = assemble(SETUP, seed=1)
    issuer, one, other = named(fleet, "AUV00"), named(fleet, "ASV00"), named(fleet, "AUV02")
    blocks = [
        say(issuer, (name, "playsRole" if gives else "leftRole", LEFT[2]), now_s=1.0 + number)
        for number, (name, gives) in enumerate(words)
    ]
    for vehicle, order in ((one, blocks), (other, draws.sample(blocks, len(blocks)))):
        for block in order:
            hear(vehicle, block)
            vehicle.social.consult()
    holders = one.social.organisation.members("Operational", "LeftWinger")
    assert other.social.organisation.members("Operational", "LeftWinger") == holders
    fleet.close()


def miss(vehicle: Vehicle, *names: str) -> None:
    """Let a vehicle take these alone for absent."""
    vehicle.social.standing._membership.absent = frozenset(names)


AUVS = st.sampled_from(["AUV00", "AUV01", "AUV02"])
ORDERS = st.tuples(AUVS, st.sampled_from(["playsRole", "leftRole"]), AUVS)
CLAIMS = st.tuples(AUVS, st.sampled_from([1, 2, 3]))
OWN = st.tuples(AUVS, st.sampled_from(["available", "sensorsWork"]), st.booleans())


@settings(max_examples=100)
@given(st.lists(ORDERS | CLAIMS | OWN, max_size=8), st.sets(AUVS, max_size=2), st.randoms())
def test_nor_does_it_where_several_lead_one_after_another(
    words: list[tuple[Any, ...]], absent: set[str], draws: Random
) -> None:
    """Vehicles claim to lead the group, give and take a role, with authority or without, and say if they take jobs."""
    speaking, heads, holders = assemble(SETUP, seed=1), [], []
    blocks = []
    for number, (speaker, *word) in enumerate(words):
        match word:
            case [attribute, bool(value)]:
                facts = [(speaker, attribute, value)]
            case [attribute, str(assignee)]:
                facts = [(assignee, attribute, LEFT[2])]
            case [term]:
                facts = [("Operational", HEADED_BY, speaker), ("Operational", HEAD_TERM, term)]
        blocks.append(say(named(speaking, speaker), *facts, now_s=1.0 + number))
    speaking.close()
    for order in (blocks, draws.sample(blocks, len(blocks))):
        fleet = assemble(SETUP, seed=1)
        listening = named(fleet, "ASV00")
        miss(listening, *absent)
        for block in order:
            hear(listening, block)
            listening.social.consult()
        heads.append(listening.social.organisation.heads("Operational"))
        holders.append(listening.social.organisation.members("Operational", "LeftWinger"))
        fleet.close()
    assert heads[0] == heads[1]
    assert holders[0] == holders[1]


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
    assert not other.social.standing.claims(), "it leads another group"
    (again,) = head.social.standing.claims()
    assert (again[0][2], again[1][2]) == (head.beliefs.uid("ASV00"), 2)
    said = head.beliefs.model.record(again, 3.0)
    head.social.consider([said])
    for listening in (other, away):
        hear(listening, said.block)
    for vehicle in (head, other, away):
        vehicle.social.consult()
        assert vehicle.social.organisation.heads("Coordination") == ("ASV00",)
        if vehicle is not away:
            assert not vehicle.social.standing.claims()
    words = away.social.standing.claims()  # it assents to ASV00, and was there when AUV01 took its own place
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
    (assent,) = other.social.standing.claims()
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
    assert holders_after(words, 1) == (set(holders), waiting)


def test_who_waited_for_room_gets_it_when_the_holder_leaves(fleet: Fleet) -> None:
    issuer, heard = named(fleet, "AUV00"), named(fleet, "ASV00")
    for number, fact in enumerate(
        (
            LEFT,
            ("AUV02", *LEFT[1:]),
            ("AUV01", "leftRole", LEFT[2]),
            ("AUV00", *LEFT[1:]),
            ("AUV00", "leftRole", LEFT[2]),
        )
    ):
        hear(heard, say(issuer, fact, now_s=1.0 + number))
        heard.social.consult()
        holder = ("AUV01", "AUV01", "AUV02", "AUV00", "AUV02")[number]
        assert heard.social.organisation.members("Operational", "LeftWinger") == (holder,)


def test_a_refusal_that_stays_one_is_told_once(fleet: Fleet) -> None:
    """Who speaks is outside of the group; it may come in, so its word is asked again whenever roles change."""
    heard, head = named(fleet, "ASV00"), named(fleet, "AUV00")
    refused = []
    for number, (issuer, fact) in enumerate(
        ((named(fleet, "AUV01"), ("AUV02", "playsRole", "Coordination.Tactician")), (head, LEFT))
    ):
        hear(heard, say(issuer, fact, now_s=1.0 + number))
        refused.append([one.outcome for one in heard.social.consult().rulings if one.event == "refused"])
    assert heard.social.organisation.members("Operational", "LeftWinger") == ("AUV01",)
    assert refused == [[Outcome.OUTSIDE], []]


def test_in_one_round_the_order_of_hearing_does_not_matter(fleet: Fleet) -> None:
    issuer = named(fleet, "AUV00")
    blocks = (
        say(issuer, LEFT, EXPLORE_LEFT, now_s=1.0),
        say(issuer, ("AUV01", "leftRole", "Operational.LeftWinger"), now_s=2.0),
        say(issuer, ("AUV02", "playsRole", "Operational.LeftWinger"), now_s=3.0),
    )
    outcomes = set()
    for order in permutations(blocks):
        again = assemble(SETUP, seed=1)
        vehicle = named(again, "AUV02")
        hear(vehicle, *order)
        vehicle.social.consult()
        outcomes.add((vehicle.social.organisation.assignments, vehicle.social.objectives_of("AUV02")))
        again.close()
    assert len(outcomes) == 1
    ((assignments, objectives),) = outcomes
    assert RoleAssignment("Operational", "LeftWinger", "AUV02") in assignments
    assert RoleAssignment("Operational", "LeftWinger", "AUV01") not in assignments
    assert objectives == (Objective("Operational", "LeftWinger", "Exploring", "left"),)


def test_leaving_a_role_ends_its_objectives(fleet: Fleet) -> None:
    issuer, heard = named(fleet, "AUV00"), named(fleet, "AUV01")
    hear(heard, say(issuer, LEFT, EXPLORE_LEFT))
    heard.social.consult()
    assert [one.name for one in heard.social.objectives_of("AUV01")] == ["Exploring"]
    hear(heard, say(issuer, ("AUV01", "leftRole", "Operational.LeftWinger"), now_s=9.0))
    heard.social.consult()
    assert moved(heard) == ([], [RoleAssignment("Operational", "LeftWinger", "AUV01")])
    assert heard.social.objectives_of("AUV01") == ()


# Planning -----------------------------------------------------------------------------------------


def planned(fleet: Fleet) -> tuple[SocialLayer, list[Said]]:
    """AUV00 has been given its group's mission and has planned it: its social layer, and what it says."""
    coordinator = named(fleet, "AUV00")
    hear(coordinator, say(named(fleet, "ASV00"), ("Operational", "hasMission", "AreaMapping")))
    beliefs = coordinator.beliefs
    deliberation = coordinator.social.plan_missions()
    assert deliberation.impossible == []
    said = [
        (beliefs.name(subject), beliefs.model.tbox.attributes[attribute].name, beliefs.name(value))
        for subject, attribute, value in deliberation.facts
    ]
    return coordinator.social, said


def test_the_mission_becomes_roles_and_objectives(fleet: Fleet) -> None:
    social, said = planned(fleet)
    assert {fact for fact in said if fact[1] == "playsRole"} == {
        ("AUV00", "playsRole", "Operational.Cartographer"),
        ("AUV01", "playsRole", "Operational.Cartographer"),
        ("AUV02", "playsRole", "Operational.Cartographer"),
        ("AUV00", "playsRole", "Operational.Midfield"),
        ("AUV01", "playsRole", "Operational.LeftWinger"),
        ("AUV02", "playsRole", "Operational.RightWinger"),
    }
    assert {fact[::2] for fact in said if fact[1] == "objectiveExploring"} == {
        ("Operational.LeftWinger", "left"),
        ("Operational.Midfield", "middle"),
        ("Operational.RightWinger", "right"),
    }
    assert not social.planner.due
    assert social.planner.has_planned("Operational")
    assert all(social.organisation.is_member(one.vehicle, one.group) for one in social.planner.orders.issued)


def test_what_was_planned_is_not_said_again(fleet: Fleet) -> None:
    social, said = planned(fleet)
    coordinator = named(fleet, "AUV00")
    say(coordinator, *said)
    social.consult()
    say(coordinator, ("middle", "areaDone", "AUV00"), now_s=500.0)
    assert social.planner.due  # the plan rests on it
    deliberation = social.plan_missions()
    assert deliberation.facts == []


def test_planning_is_due_again_when_a_fact_changes_that_the_plan_rests_on(fleet: Fleet) -> None:
    social, _ = planned(fleet)
    coordinator = named(fleet, "AUV00")
    for fact, due in [(("AUV01", "playsRole", "Operational.Performer"), False), (("left", "areaDone", "AUV01"), True)]:
        say(coordinator, fact, now_s=100.0)
        assert bool(social.planner.due) is due


def test_activities_are_chosen_anew_when_a_fact_changes_that_they_rest_on(fleet: Fleet) -> None:
    vehicle = named(fleet, "AUV01")
    hear(vehicle, say(named(fleet, "AUV00"), LEFT, EXPLORE_LEFT))
    vehicle.social.consult()
    vehicle.social.activity_sets((0.0, 0.0))
    done = {name: vehicle.beliefs.model.record([vehicle.beliefs.fact(name, "areaDone", "AUV01")], 9.0) for name in
            ("right", "left")}  # fmt: skip
    assert not vehicle.social.consider([done["right"]]).activities_due
    assert vehicle.social.consider([done["left"]]).activities_due
    assert "ZigzagExploring" not in {one.name for one in vehicle.social.activity_sets((0.0, 0.0))}


def test_activities_under_way_are_kept(fleet: Fleet) -> None:
    """A survey planned from the start goes on as planned, wherever the vehicle is when it is asked again."""
    vehicle = named(fleet, "AUV01")
    hear(vehicle, say(named(fleet, "AUV00"), LEFT, EXPLORE_LEFT))
    vehicle.social.consult()
    first = vehicle.social.activity_sets((0.0, 0.0))
    assert vehicle.social.activity_sets((700.0, 700.0)) == first


@pytest.mark.parametrize("is_turned", [False, True])
def test_who_has_fallen_silent_is_listed_in_an_order_that_is_always_the_same(fleet: Fleet, is_turned: bool) -> None:
    """Plans name them; an organisation has its roles in a set, whose order is that of a process."""
    social, _ = planned(fleet)
    standing, frame_s = social.standing, SETUP.schedule.frame_s
    roles = sorted(social.organisation.assignments, reverse=is_turned)
    turned: Any = Organisation(social.organisation.groups, tuple(roles))  # type: ignore[arg-type]
    standing.view = replace(standing.view, organisation=turned)
    standing._take_over(standing.view)
    for frame in range(1, 100):
        social._picture.peers.heard_s["ASV00"] = frame * frame_s
        social.look_around(frame * frame_s)
    assert social.planner.lost["Operational.Performer"] == ("AUV01", "AUV02")


# Late news ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_the_later_word_counts_in_whatever_round_it_is_heard(fleet: Fleet, order: tuple[int, int]) -> None:
    """AUV00 lets AUV01 explore the left area, then the middle one; AUV01 hears of it in two rounds."""
    issuer, holder = named(fleet, "AUV00"), named(fleet, "AUV01")
    said = [
        say(issuer, LEFT, EXPLORE_LEFT, now_s=2.0),
        say(issuer, ("Operational.LeftWinger", "objectiveExploring", "middle"), now_s=3.0),
    ]
    for index in order:
        hear(holder, said[index])
        holder.social.consult()
    explored = [o.argument for o in holder.social.objectives_of("AUV01") if o.name == "Exploring"]
    assert explored == [holder.beliefs.get(("objectiveExploring", "Operational.LeftWinger"))] == ["middle"]


def test_a_role_that_was_left_is_not_taken_up_by_old_news(fleet: Fleet) -> None:
    issuer, holder = named(fleet, "AUV00"), named(fleet, "AUV01")
    plays = say(issuer, LEFT, now_s=2.0)
    leaves = say(issuer, ("AUV01", "leftRole", "Operational.LeftWinger"), now_s=3.0)
    for block in (leaves, plays):
        hear(holder, block)
        holder.social.consult()
    assert not holder.social.organisation.plays("AUV01", "Operational", "LeftWinger")


def test_planning_again_before_the_round_ends_says_nothing_twice(fleet: Fleet) -> None:
    head = named(fleet, "AUV00")
    say(head, ("Operational", "hasMission", "AreaMapping"))
    assert len(head.social.plan_missions().facts) == 16
    say(head, ("left", "areaDone", "AUV01"))  # the plan rests on it
    assert head.social.planner.due
    again = head.social.plan_missions().facts
    assert again == []


# Meeting ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_who_supervises_others_meets_after_them(fleet: Fleet, order: tuple[int, ...]) -> None:
    """An early meeting of the Coordination group counts until the Operational group has met, in any order."""
    administrator, coordinator = named(fleet, "ASV00"), named(fleet, "AUV00")
    early = say(administrator, ("Coordination", "gatheredAt", "coordination rally"), now_s=10.0)
    assert administrator.functional.picture.groups.gathered == {"Coordination"}
    between = say(coordinator, ("Operational", "gatheredAt", "operational rally"), now_s=20.0)
    hear(administrator, between)
    assert administrator.functional.picture.groups.gathered == {"Operational"}
    late = say(administrator, ("Coordination", "gatheredAt", "coordination rally"), now_s=30.0)
    performer = named(fleet, "AUV01")
    hear(performer, *([early, between, late][n] for n in order))
    assert performer.functional.picture.groups.gathered == {"Coordination", "Operational"}


def test_what_is_left_is_the_same_with_positions_and_without(fleet: Fleet) -> None:
    """What is kept for questions without positions is not kept beyond a fact that one with positions has seen first."""
    heard = named(fleet, "AUV01")
    assert "left" not in heard.social._work()["Operational"].done
    hear(heard, say(named(fleet, "AUV02"), ("left", "areaDone", "AUV02")))
    for positions_m in ({}, None):
        assert "left" in heard.social._work(positions_m)["Operational"].done


def test_a_head_that_waits_for_work_to_be_done_has_still_to_give_it_out(fleet: Fleet) -> None:
    """So it does not count its wait for the others as overdue, in whatever round it is asked."""
    _, said = planned(fleet)
    coordinator = named(fleet, "AUV00")
    say(coordinator, *said)
    for now_s in (10.0, 20.0, 30.0):
        coordinator.consult(now_s)
        assert coordinator.social.gives_out("Operational")


def test_a_meeting_that_was_concluded_alone_counts_only_while_the_vehicle_is_cut_off(fleet: Fleet) -> None:
    beliefs, key = named(fleet, "AUV00").beliefs, ("gatheredAt", "Operational")
    gatherings = Gatherings(beliefs, ["Operational", "Coordination"], {})
    for group in ("Operational", "Coordination"):
        say(named(fleet, "AUV00"), (group, "gatheredAt", f"{group.lower()} rally"), now_s=10.0)
    gatherings.note_alone([key, ("areaDone", "left")], 10.0)
    assert gatherings.believed(cut_off=True) == {"Operational", "Coordination"}
    assert gatherings.believed(cut_off=False) == {"Coordination"}
    assert gatherings.concluded_alone == {key}
