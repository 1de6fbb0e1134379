"""Methods that give one decomposition per binding, and circles among them."""

from collections.abc import Iterator

import pytest

from remoras.errors import PlanningError
from remoras.htn import Domain, FactsLike, Method, NoPlan, Operator, Task, plan


def drive(facts: FactsLike, goal: str) -> Iterator[list[Task]]:
    for origin in facts.get(("roads to", goal), ()):
        yield [Task("go", (origin,)), Task("drive", (origin, goal))]


ROUTES = Domain.of(
    [
        Operator(
            "drive",
            lambda facts, origin, goal: facts.get(("at", "AUV00")) == origin,
            lambda facts, origin, goal: {("at", "AUV00"): goal},
        )
    ],
    {
        "go": [
            Method("be there", lambda facts, goal: [], lambda facts, goal: facts.get(("at", "AUV00")) == goal, ()),
            Method("by road", drive, uses=("go", "drive")),
        ]
    },
)


def test_a_method_gives_one_decomposition_per_binding_despite_cycles() -> None:
    """From A to D; of the two roads into D the first comes from C, and C is reached only from D: a circle."""
    facts = {("at", "AUV00"): "A", ("roads to", "D"): "CB", ("roads to", "C"): "D", ("roads to", "B"): "A"}
    found = plan(ROUTES, facts, Task("go", ("D",)))
    assert [str(task) for task in found.tasks] == ["drive(A, B)", "drive(B, D)"]


def test_an_unreachable_goal_is_reported_despite_cycles() -> None:
    """B and C lie on a circle that A does not reach; the loop check alone cannot tell, so depth is tried as well."""
    roads = {("roads to", "C"): "B", ("roads to", "B"): "C", ("at", "AUV00"): "A"}
    with pytest.raises(PlanningError, match=r"recursion: go\(C\) > go\(B\) > go\(C\), "):
        plan(ROUTES, roads, Task("go", ("C",)), max_expansions=2000)
    assert isinstance(plan(ROUTES, {("at", "AUV00"): "A"}, Task("go", ("C",))), NoPlan)
