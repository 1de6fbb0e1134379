"""A wrong plan is caught, and the verdict says why."""

import re
from dataclasses import replace

import pytest
from plan_checker import check_plan

from remoras.htn import Domain, Method, Node, Operator, Plan, Task, plan

FACTS = {"at": "base"}
TASK = Task("survey", ("reef",))
DOMAIN = Domain.of(
    [
        Operator(
            "sail",
            lambda facts, origin, target: facts.get("at") == origin,
            lambda facts, origin, target: {"at": target},
        ),
        Operator(
            "map", lambda facts, place: facts.get("at") == place, lambda facts, place: {("mapped", place): True}
        ),
    ],
    {
        "survey": [Method("there and back", lambda facts, place: [
            Task("go", (place,)), Task("map", (place,)), Task("go", ("base",))])],
        "go": [
            Method("be there", lambda facts, place: [], lambda facts, place: facts.get("at") == place),
            Method("sail", lambda facts, place: iter([[Task("sail", ("harbour", place))],
                                                      [Task("sail", (facts.get("at"), place))]])),
        ],
    },
)  # fmt: skip
FOUND = plan(DOMAIN, FACTS, TASK)
NODES = FOUND.nodes
SURVEY, GO, OUT, MAP, _, HOME = range(6)


def changed(place: int, **parts: object) -> Plan:
    """The plan with one node changed."""
    nodes = list(NODES)
    nodes[place] = nodes[place]._replace(**parts)
    return replace(FOUND, nodes=tuple(nodes))


def verdict(found: object) -> str:
    return str(check_plan(DOMAIN, FACTS, TASK, found))


def test_the_plan_itself_is_valid() -> None:
    assert [str(node.task) for node in NODES[:6]] == [
        "survey(reef)", "go(reef)", "sail(base, reef)", "map(reef)", "go(base)", "sail(reef, base)",
    ]  # fmt: skip
    assert verdict(FOUND) == "valid"


@pytest.mark.parametrize(
    ("place", "parts", "reason"),
    [
        (OUT, {"task": Task("sail", ("reef", "base"))}, r"node 2: sail\(reef, base\) is not possible where it stands"),
        (OUT, {"task": Task("fly")}, r"node 2: fly\(\) is no elementary task of the domain"),
        (OUT, {"task": Task("sail", ("base", "reef", ))}, "valid"),
        (HOME, {"task": Task("map", ("reef",))}, r"method 'sail' does not turn go\(base\) into map\(reef\)"),
        (GO, {"method": "swim"}, r"node 1: go\(reef\) has no method 'swim', it has: 'be there', 'sail'"),
        (GO, {"method": "be there"}, r"node 1: method 'be there' of go\(reef\) is not possible where it stands"),
        (SURVEY, {"task": Task("survey", ("wreck",))}, r"for survey\(wreck\), .*asked for was survey\(reef\)"),
        (MAP, {"parent": OUT}, r"map\(reef\) stands below the elementary task sail\(base, reef\)"),
        (HOME, {"parent": GO}, r"node 5: sail\(reef, base\) does not follow the task above it, node 1"),
        (MAP, {"parent": GO}, r"method 'sail' does not turn go\(reef\) into sail\(base, reef\), map\(reef\)"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_plan_is_said(place: int, parts: dict[str, object], reason: str) -> None:
    assert re.search(reason, verdict(changed(place, **parts)))


def test_a_step_left_out_breaks_the_tree_and_what_comes_after() -> None:
    nodes = [node._replace(parent=node.parent - (node.parent > OUT)) for node in NODES[:OUT] + NODES[OUT + 1 :]]
    found = check_plan(DOMAIN, FACTS, TASK, replace(FOUND, nodes=tuple(nodes)))
    assert "method 'sail' does not turn go(reef) into nothing" in str(found)
    assert "map(reef) is not possible where it stands" in str(found)
    assert not found.is_valid


def test_a_plan_for_other_facts_is_caught() -> None:
    found = check_plan(DOMAIN, {"at": "reef"}, TASK, FOUND)
    assert "sail(base, reef) is not possible where it stands" in str(found)


def test_a_step_too_many_is_no_subtask_of_anything() -> None:
    more = replace(FOUND, nodes=(*NODES, Node(Task("map", ("base",)), None, -1)))
    assert "the plan is for" in verdict(more)
