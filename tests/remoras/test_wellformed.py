"""Well-formedness: one value for each violated demand of a specification, and none otherwise."""

from dataclasses import replace

import pytest

from remoras.group_hierarchy import Defect, Malformed, specification_faults
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification, Subgroups

FLEET = Group(
    "Fleet",
    (RoleSpecification("Tactician", 1, 2, founding=True),),
    subgroups=(Subgroups(template="Team", minimum=1, maximum=1),),
)
TEAM = Group(
    "Team",
    (
        RoleSpecification("Head", 1, 1, head=True, founding=True, played_by=("Fleet", "Tactician")),
        RoleSpecification("Hand", 2, 3, founding=True, incompatible=frozenset({("Team", "Head")})),
        RoleSpecification("Digger", 1, 1, job="pit"),
    ),
    within="Fleet",
    templates=("Team",),
)
WELL = {
    ("Fleet", "Tactician", "A"), ("Team", "Head", "A"), ("Team", "Hand", "B"), ("Team", "Hand", "C"),
}  # fmt: skip


def organised(*more: tuple[str, str, str], less: tuple[tuple[str, str, str], ...] = ()) -> Organisation:
    held = sorted({*WELL, *more}.difference(less))
    return Organisation.of([FLEET, TEAM], [RoleAssignment(*one) for one in held])


@pytest.mark.parametrize(
    ("organisation", "fault"),
    [
        (organised(less=(("Team", "Hand", "C"),)), Malformed(Defect.TOO_FEW, "Team", "Hand", "B", "2 or more")),
        (
            organised(("Team", "Digger", "B"), ("Team", "Digger", "C")),
            Malformed(Defect.TOO_MANY, "Team", "Digger", "B, C", "1 at the most"),
        ),
        (
            organised(("Fleet", "Tactician", "B"), less=(("Fleet", "Tactician", "A"),)),
            Malformed(Defect.PLAYED_BY, "Team", "Head", "A", "holders of Fleet.Tactician"),
        ),
        (
            organised(("Team", "Hand", "A")),
            Malformed(Defect.INCOMPATIBLE, "Team", "Hand", "A", "holder of none of Team.Head"),
        ),
    ],
)
def test_a_violated_demand_states_holders_and_allowed_values(organisation: Organisation, fault: Malformed) -> None:
    assert specification_faults(organisation) == (fault,)
    assert fault.key == f"group.{fault.group}.role.{fault.role}.{fault.defect.value}"


def test_a_group_has_its_declared_number_of_subgroups() -> None:
    other = replace(TEAM, name="Other")
    (fault,) = specification_faults(
        Organisation.of([FLEET, TEAM, other], [RoleAssignment(*one) for one in sorted(WELL)])
    )[:1]
    assert fault == Malformed(Defect.SUBGROUPS, "Fleet", "", "Team, Other", "1 to 1 of Team")
    assert fault.key == "group.Fleet.subgroup"
