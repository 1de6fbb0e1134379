"""Needs by groups and roles, on four vehicles in two teams under a leader; numbers are bit masks of nodes."""

from typing import ClassVar

import pytest

from missions.mapping import MappingMission
from missions.runs.setup import Setup, resolved
from missions.scenarios import load
from remoras.organisation import Organisation
from remoras.organisation.needs import GroupNeeds
from worldmodel import PropertyValue, Value

SETUP: Setup = resolved(load("mapping-three-teams"))
NODES = SETUP.nodes
UIDS = {instance.name: instance.uid for instance in SETUP.instances}
HEAD, NORTH, EAST = ("ASV00",), ("AUV00", "AUV01"), ("AUV02", "AUV03")
TACTICIANS = ("AUV00", "AUV02", "AUV04")


def word(*names: str) -> int:
    return sum(1 << NODES[name] for name in set(names))


def needs(held: tuple[str, ...] = ()) -> GroupNeeds:
    settings = [("--set", f'group.{name}.information="held by head"') for name in held]
    setup = resolved(load("mapping-three-teams", settings))
    assert setup.subjects is not None
    return GroupNeeds(setup.tbox, setup.urgency, setup.subjects, setup.agreement.organisation)


def who(asked: GroupNeeds, subject: str, attribute: str, value: Value | str = 0.0) -> int:
    """Nodes that need the fact."""
    told = UIDS[value] if isinstance(value, str) else value
    fact = PropertyValue(UIDS[subject], SETUP.tbox.attribute_named(attribute).uid, told)
    return asked.wanted(fact, 0).peers


def moved(*changes: tuple[str, str, str, bool]) -> Organisation:
    """What was agreed, after (vehicle, group, role, takes it) each."""
    organisation = SETUP.agreement.organisation
    for vehicle, group, role, takes in changes:
        change = organisation.assign if takes else organisation.leave_role
        organisation, _ = change(vehicle, group, role)
    return organisation


@pytest.mark.parametrize(
    ("subject", "attribute", "value", "expected"),
    [
        ("north west", "mappedCell", 3.0, word(*NORTH)),
        ("north west", "areaDone", "AUV00", word(*NORTH, *HEAD)),
        ("North.NorthWest", "objectiveExploring", "north west", word(*NORTH)),
        ("AUV01", "playsRole", "North.NorthWest", word(*NORTH, *HEAD)),
        ("AUV03", "playsRole", "North.NorthWest", word(*NORTH, *HEAD, "AUV03")),
        ("North", "gatheredAt", "north rally", word(*NORTH, *HEAD)),
        ("Coordination", "gatheredAt", "coordination rally", word(*HEAD, *TACTICIANS)),
        ("North", "headedBy", "AUV01", word(*NORTH, *HEAD, *TACTICIANS)),
        ("AUV01", "position", (0.0, 0.0), word(*NORTH)),
        ("AUV00", "position", (0.0, 0.0), word(*NORTH, *HEAD, *TACTICIANS)),
    ],
)
def test_a_fact_is_needed_by_the_groups_it_concerns(subject, attribute, value, expected) -> None:
    assert who(needs(), subject, attribute, value) == expected


def test_joining_a_group_adds_its_needs_and_leaving_keeps_role_news() -> None:
    asked = needs()
    assert asked.renew(moved(("AUV03", "North", "NorthPerformer", True)))
    assert who(asked, "north west", "mappedCell", 3.0) == word(*NORTH, "AUV03")
    assert asked.renew(moved(("AUV01", "North", "NorthPerformer", False)))
    assert who(asked, "north west", "mappedCell", 3.0) == word("AUV00")
    assert who(asked, "AUV00", "leftRole", "North.NorthWest") == word("AUV00", "AUV01", "AUV03", *HEAD)


def test_a_leader_and_the_holders_of_a_job_need_its_facts() -> None:
    asked = needs(("North",))
    assert who(asked, "north west", "mappedCell", 3.0) == word("AUV00")
    assert who(asked, "north west", "areaDone", "AUV01") == word(*NORTH, *HEAD)
    assert who(asked, "east south", "mappedCell", 3.0) == word(*EAST)
    asked.renew(moved(("AUV01", "North", "NorthWest", True)))
    assert who(asked, "north west", "mappedCell", 3.0) == word(*NORTH)
    assert who(asked, "north east", "mappedCell", 3.0) == word("AUV00")


class Sharing(MappingMission):
    """Tells another team of one area besides."""

    told: ClassVar[tuple[str, ...]] = ("North", "East")

    def groups_of(self, subject: str) -> tuple[str, ...] | None:
        return self.told if subject == "north west" else None


def shared(told: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> GroupNeeds:
    monkeypatch.setattr(Sharing, "told", told)
    setup = resolved(load("mapping-three-teams", [("--set", f"scenario.mission={__name__}:Sharing")]))
    assert setup.subjects is not None
    return GroupNeeds(setup.tbox, setup.urgency, setup.subjects, setup.agreement.organisation)


def test_a_mission_may_name_the_groups_of_an_instance(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = shared(("North", "East"), monkeypatch)
    assert who(asked, "north west", "mappedCell", 3.0) == word(*NORTH, *EAST)
    assert who(asked, "north east", "mappedCell", 3.0) == word(*NORTH)
