"""Organisational strategies: who founds the groups, who gets which area."""

import math
import os
import subprocess
import sys
from itertools import permutations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from samples import auv, database

from remoras.database import AUVDatabase, VehicleData
from remoras.organisation import Group, Organisation, RoleSpecification
from remoras.strategies import Evidence, Strategy, strategies
from remoras.strategies.remoras import STRATEGY, assignment, survey_time_s

# Assignment ---------------------------------------------------------------------------------------

costs = st.integers(0, 12) | st.none()


@st.composite
def cost_matrices(draw: st.DrawFn) -> list[list[int | None]]:
    n_columns = draw(st.integers(1, 4))
    return draw(st.lists(st.lists(costs, min_size=n_columns, max_size=n_columns), min_size=1, max_size=4))


def quality(matrix: list[list[int | None]], pairs: dict[int, int]) -> tuple[int, int, int]:
    """Less is better: rows left without, the dearest pair, the sum."""
    paid = [matrix[r][c] for r, c in pairs.items()]
    assert None not in paid
    return len(matrix) - len(pairs), max(paid, default=0), sum(paid)  # type: ignore[type-var, arg-type]


def all_assignments(matrix: list[list[int | None]]) -> list[dict[int, int]]:
    n_rows, n_columns = len(matrix), len(matrix[0])
    columns = [*range(n_columns), *[None] * n_rows]  # None: the row gets nothing
    return [
        {r: c for r, c in enumerate(chosen) if c is not None}
        for chosen in set(permutations(columns, n_rows))
        if all(c is None or matrix[r][c] is not None for r, c in enumerate(chosen))
    ]


@given(cost_matrices())
def test_as_many_as_possible_then_the_dearest_then_the_sum(matrix: list[list[int | None]]) -> None:
    pairs = assignment(matrix)
    assert len(set(pairs.values())) == len(pairs)
    assert list(pairs) == sorted(pairs)
    assert quality(matrix, pairs) == min(quality(matrix, other) for other in all_assignments(matrix))


def test_the_last_one_finishes_as_early_as_possible() -> None:
    """The least sum would be 0 + 9 = 9; with it the last one is finished at 9, otherwise at 6."""
    assert assignment([[0, 5], [6, 9]]) == {0: 1, 1: 0}


def test_of_equal_dearest_pairs_the_least_work_in_all() -> None:
    """The third row takes 9 in any case; of the other two 1 + 1 is less than 8 + 8."""
    assert assignment([[8, 1, None], [1, 8, None], [None, None, 9]]) == {0: 1, 1: 0, 2: 2}


def test_nobody_is_able() -> None:
    assert assignment([]) == {}
    assert assignment([[None, None]]) == {}


def test_ties_fall_the_same_way_in_every_process() -> None:
    """No order of a set and no hash decides: the same answer under different hash seeds."""
    program = (
        "from remoras.strategies.remoras import assignment\n"
        "print([assignment([[1] * n] * m) for n in range(1, 5) for m in range(1, 5)])"
    )
    answers = {
        subprocess.run(
            [sys.executable, "-c", program],
            env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": os.pathsep.join(sys.path)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("0", "1", "2")
    }
    assert len(answers) == 1


# Costs --------------------------------------------------------------------------------------------

SQUARE = ((100.0, 100.0), (100.0, 350.0), (350.0, 350.0), (350.0, 100.0))


def test_the_time_that_a_survey_takes() -> None:
    """159.1 m to (112.5, 112.5) at 2 m/s, then 2475 m at 1.25 m/s: 79.55 + 1980 s."""
    expected_s = 112.5 * math.sqrt(2.0) / 2.0 + 2475.0 / 1.25
    assert survey_time_s(auv(), SQUARE, (0.0, 0.0)) == pytest.approx(expected_s)


def test_without_a_sensor_no_survey_ends() -> None:
    assert survey_time_s(auv(swath_m=0.0), SQUARE, (0.0, 0.0)) == math.inf


# Founding -----------------------------------------------------------------------------------------

GROUPS = (
    Group("Coordination", (RoleSpecification("Tactician", 1, 1, founding=True),)),
    Group(
        "Operational",
        (
            RoleSpecification("Coordinator", 1, 1, head=True, founding=True, played_by=("Coordination", "Tactician")),
            RoleSpecification("Performer", 1, founding=True),
            RoleSpecification("Cartographer", 1),
            RoleSpecification("LeftWinger", 1, 1, area="left"),
            RoleSpecification("RightWinger", 1, 1, area="right"),
        ),
    ),
)
LEADER = ("Tactician", "Coordinator", "Cartographer", "LeftWinger", "RightWinger")
WORKER = ("Performer", "Cartographer", "LeftWinger", "RightWinger")


def test_founding_roles_go_to_those_with_the_most_energy() -> None:
    fleet = database(
        auv("AUV00", playable_roles=LEADER, energy_j=1.0e6),
        auv("AUV01", playable_roles=LEADER, energy_j=2.0e6),
        auv("AUV02", playable_roles=WORKER),
        auv("AUV03", playable_roles=WORKER),
    )
    formed = STRATEGY.form(fleet, GROUPS)
    assert formed.members("Coordination", "Tactician") == ("AUV01",)
    assert formed.members("Operational", "Coordinator") == ("AUV01",)  # played by the Tactician
    assert formed.members("Operational", "Performer") == ("AUV02", "AUV03")  # as many as are able
    assert formed.members("Operational", "Cartographer") == ()  # allocated during the mission


def test_of_equals_the_lower_node_founds() -> None:
    fleet = database(*(auv(name, playable_roles=LEADER) for name in ("AUV02", "AUV00", "AUV01")))
    assert STRATEGY.form(fleet, GROUPS).members("Coordination") == ("AUV00",)


def test_a_head_has_the_social_layer() -> None:
    """REMORAS IV.B: at least one vehicle per group must have it, and it is the one that leads."""
    fleet = database(auv("AUV00", playable_roles=LEADER, social_layer=False), auv("AUV01", playable_roles=WORKER))
    formed = STRATEGY.form(fleet, GROUPS)
    assert formed.members("Coordination", "Tactician") == ("AUV00",)
    assert formed.heads("Operational") == ()


# Allocating ---------------------------------------------------------------------------------------

CORNERS = {
    "left": ((100.0, 0.0), (100.0, 100.0), (200.0, 100.0), (200.0, 0.0)),
    "right": ((-200.0, 0.0), (-200.0, 100.0), (-100.0, 100.0), (-100.0, 0.0)),
}


def allocated(
    fleet: AUVDatabase, positions: dict[str, tuple[float, float]] | None = None, done: frozenset[str] = frozenset()
) -> tuple[Organisation, set[tuple[str, str]]]:
    """The founded organisation, and (role, vehicle) that the head allocates in it."""
    formed = STRATEGY.form(fleet, GROUPS)
    found = STRATEGY.adapt(GROUPS[1], formed, Evidence(fleet, positions or {}, CORNERS, done))
    return formed, {(one.role, one.vehicle) for one in found}


def two_workers(**changes: object) -> AUVDatabase:
    return database(
        auv("AUV00", playable_roles=("Tactician", "Coordinator")),
        auv("AUV01", playable_roles=WORKER, **changes),
        auv("AUV02", playable_roles=WORKER),
    )


def test_areas_go_to_who_is_near_and_other_roles_to_all_who_are_able() -> None:
    _, found = allocated(two_workers(), {"AUV01": (-300.0, 50.0), "AUV02": (300.0, 50.0)})
    assert found == {
        ("Cartographer", "AUV01"),
        ("Cartographer", "AUV02"),
        ("RightWinger", "AUV01"),
        ("LeftWinger", "AUV02"),
    }


def test_who_has_no_sensor_explores_nothing() -> None:
    """Both areas are then left to the other one: a member takes another area when all have one."""
    _, found = allocated(two_workers(swath_m=0.0))
    assert {role for role, name in found if name == "AUV02"} == {"Cartographer", "LeftWinger", "RightWinger"}
    assert {role for role, name in found if name == "AUV01"} == {"Cartographer"}


def test_an_area_that_is_finished_is_not_allocated() -> None:
    _, found = allocated(two_workers(), done=frozenset({"left"}))
    assert {role for role, _ in found} == {"Cartographer", "RightWinger"}


def test_what_is_held_is_not_allocated_again() -> None:
    fleet = two_workers()
    organisation, found = allocated(fleet)
    for role, name in sorted(found):
        organisation, _ = organisation.assign(name, "Operational", role)
    assert STRATEGY.adapt(GROUPS[1], organisation, Evidence(fleet, {}, CORNERS, frozenset())) == ()


def test_the_area_of_a_vehicle_that_is_lost_goes_to_another() -> None:
    fleet = two_workers()
    organisation, found = allocated(fleet)
    for role, name in sorted(found):
        organisation, _ = organisation.assign(name, "Operational", role)
    orphaned = [a.role for a in organisation.roles_of("AUV01", "Operational") if a.role.endswith("Winger")]
    again = STRATEGY.adapt(GROUPS[1], organisation.remove("AUV01"), Evidence(fleet, {}, CORNERS, frozenset()))
    assert [(one.role, one.vehicle) for one in again] == [(role, "AUV02") for role in orphaned]


names = [f"AUV{number:02d}" for number in range(6)]


@st.composite
def fleets(draw: st.DrawFn) -> AUVDatabase:
    vehicles: list[VehicleData] = []
    for name in names[: draw(st.integers(1, 6))]:
        playable = draw(st.lists(st.sampled_from(sorted({*LEADER, *WORKER})), unique=True))
        vehicles.append(
            auv(
                name,
                playable_roles=tuple(playable),
                social_layer=draw(st.booleans()),
                swath_m=draw(st.sampled_from([0.0, 20.0, 25.0])),
                energy_j=draw(st.sampled_from([1.0e6, 2.0e6])),
            )
        )
    return database(*vehicles)


positions_drawn = st.dictionaries(st.sampled_from(names), st.tuples(st.floats(-300.0, 300.0), st.floats(-300.0, 300.0)))


@pytest.mark.parametrize("strategy", strategies().values(), ids=strategies())
@given(fleet=fleets(), positions=positions_drawn, done=st.frozensets(st.sampled_from(["left", "right"])))
def test_every_shipped_strategy_stays_within_the_group(
    strategy: Strategy, fleet: AUVDatabase, positions: dict[str, tuple[float, float]], done: frozenset[str]
) -> None:
    """Whatever it is given: members only, who are able, each area once, nothing that is done, no contradiction."""
    formed = strategy.form(fleet, GROUPS)
    assert strategy.form(fleet, GROUPS) == formed
    for one in formed.assignments:
        assert fleet[one.vehicle].can_play(one.role)
    for group in GROUPS:
        evidence = Evidence(fleet, positions, CORNERS, done)
        found = strategy.adapt(group, formed, evidence)
        assert strategy.adapt(group, formed, evidence) == found
        areas = []
        for one in found:
            specification = group.role(one.role)
            assert one.group == group.name
            assert specification is not None
            assert formed.is_member(one.vehicle, group.name)
            assert not formed.plays(one.vehicle, one.group, one.role)
            assert fleet[one.vehicle].can_play(one.role)
            if specification.area is not None:
                areas.append(specification.area)
                assert specification.area not in done
                assert fleet[one.vehicle].swath_m > 0.0
        assert len(areas) == len(set(areas))


def test_shipped_strategies_are_found_by_name() -> None:
    found = strategies()
    assert found["remoras"] is STRATEGY
    assert all(name == strategy.name for name, strategy in found.items())
