"""Messages and their effect at the receivers, as in AGR, over a broadcast radio."""

import pytest
from resting import fleet_at_rest, hear, named, say

from remoras.fleet.fleet import Fleet
from remoras.organisation import Outcome

LEFT = ("AUV01", "playsRole", "Operational.LeftWinger")


def hear_a_call(fleet: Fleet, sender: str, frame: int = 0) -> set[str]:
    """The sender calls for help under all its roles, in its slot of a frame; whose calls AUV01 heeds then."""
    vehicle = named(fleet, sender)
    opens_s = fleet.schedule.start_s(frame * fleet.schedule.n_nodes + vehicle.data.node)
    roles = [(role.group, role.role) for role in vehicle.social.organisation.roles_of(sender)]
    sent = vehicle.radio.speak([(role, -100) for role in roles], opens_s)
    hearer = named(fleet, "AUV01")
    hearer.hear(sent.data, opens_s + 1.0)
    return set(hearer.executive.calls(opens_s + 1.0))


def test_only_signals_from_a_shared_group_are_accepted() -> None:
    """ASV00 and AUV01 share no group; AUV00 shares one with each."""
    with fleet_at_rest() as fleet:
        assert hear_a_call(fleet, "ASV00") == set()
        assert hear_a_call(fleet, "AUV00") == {"AUV00"}


def test_a_non_member_reaches_the_leader_only() -> None:
    """What it may do is give the group its mission: the head plans it, members do nothing about it."""
    with fleet_at_rest() as fleet:
        block = say(named(fleet, "ASV00"), ("Operational", "hasMission", "AreaMapping"))
        head, member = named(fleet, "AUV00"), named(fleet, "AUV01")
        for vehicle in (head, member):
            (ruling,) = hear(vehicle, block)
            assert ruling.outcome is Outcome.SUCCESS
        assert head.social.planner.due
        assert not member.social.planner.due


def test_a_vehicle_signals_under_the_roles_that_it_holds() -> None:
    with fleet_at_rest() as fleet:
        for vehicle in fleet.vehicles:
            held = {(one.group, one.role) for one in vehicle.social.organisation.roles_of(vehicle.name)}
            assert {role for role, _ in vehicle.executive.signals()} == held


def test_a_released_role_does_not_reach_its_former_holder() -> None:
    with fleet_at_rest() as fleet:
        performer = named(fleet, "AUV01")
        assert hear_a_call(fleet, "AUV00") == {"AUV00"}
        hear(performer, say(performer, ("AUV01", "leftRole", "Operational.Performer")))
        performer._adopt()
        assert performer.executive.satisfaction == {}
        assert hear_a_call(fleet, "AUV00", frame=1) == set()


@pytest.mark.parametrize(
    ("fact", "heard_by"),
    [
        (LEFT, {"AUV01"}),  # an AUV
        (
            ("Operational.Performer", "objectiveRendezVous", "operational rally"),
            {"AUV01", "AUV02"},
        ),  # holders of a role
    ],
)
def test_targets_are_a_vehicle_or_a_role_of_a_group(fact: tuple[str, str, str], heard_by: set[str]) -> None:
    with fleet_at_rest() as fleet:
        head = named(fleet, "AUV00")
        change = head.beliefs.model.record([head.beliefs.fact(*fact)], 1.0)
        assert set(head.social.addressed(change)) == heard_by
