"""Cost of asking and of changing an organisation of 1000 vehicles, against one of ten, in one process.

A tenth of the vehicles lead groups of ten; all are members of one more group, so that one has 10 or 1000 members. Each
question is put to every vehicle in turn; changes are made to an organisation that has been asked before, and the new
one is asked at once. The last row is of the division of jobs, see ``dividing``.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from benchmarks.dividing import rows as rows_of_dividing
from benchmarks.dividing import vehicle
from benchmarks.measuring import row
from remoras.authority import Act, Request, Rules, may_assign
from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification

SIZES = (10, 1000)
CALLS = 2000
REPEATS = 7
ALL = "All"


def fleet(size: int) -> tuple[Organisation, Rules]:
    """An organisation of that many vehicles, and who may change what in it."""
    roles = (RoleSpecification("Head", 1, 1, head=True), RoleSpecification("Member"), RoleSpecification("Worker"))
    vehicles = tuple(vehicle(node) for node in range(size))
    groups = [Group(ALL, roles), *(Group(f"Group{number:03d}", roles) for number in range(size // 10))]
    assignments = [
        RoleAssignment(ALL, "Head" if node == 0 else "Member", one.name) for node, one in enumerate(vehicles)
    ]
    for node, one in enumerate(vehicles):
        role = "Head" if node % 10 == 0 else "Member"
        assignments.append(RoleAssignment(f"Group{node // 10:03d}", role, one.name))
    return Organisation.of(groups, assignments), Rules(AUVDatabase(vehicles))


def _cost_us(call: Callable[[str], object], names: tuple[str, ...]) -> float:
    """CPU of one call, over vehicles in turn."""
    asked = [names[n % len(names)] for n in range(CALLS)]
    began = time.process_time()
    for name in asked:
        call(name)
    return 1e6 * (time.process_time() - began) / CALLS


def questions(organisation: Organisation, rules: Rules) -> dict[str, Callable[[str], object]]:
    """What is asked, by name; each of a vehicle."""
    head = rules.database.names[0]

    def changed(name: str) -> bool:
        return organisation.assign(name, ALL, "Worker")[0].is_member(name, ALL)

    return {
        "members": lambda name: organisation.members(ALL, "Member"),
        "roles_of": organisation.roles_of,
        "plays": lambda name: organisation.plays(name, ALL, "Member"),
        "is_member": lambda name: organisation.is_member(name, ALL),
        "heads": lambda name: organisation.heads(ALL),
        "may_assign": lambda name: may_assign(Request(head, Act.ASSIGN, ALL, "Worker", name), organisation, rules),
        "assign, then is_member": changed,
    }


def rows() -> list[dict[str, Any]]:
    """Benchmark rows: the best of some repeats, the sizes measured in turn."""
    made = {size: fleet(size) for size in SIZES}
    asked = {size: questions(*made[size]) for size in SIZES}
    costs: dict[tuple[str, int], list[float]] = {}
    for _ in range(REPEATS):
        for size in SIZES:
            for name, call in asked[size].items():
                costs.setdefault((name, size), []).append(_cost_us(call, made[size][1].database.names))
    best = {key: min(values) for key, values in costs.items()}
    small, large = SIZES
    return [
        row(f"{name}, {large} members", best[name, large], "us CPU", f"{small} members", best[name, small])
        for name in asked[small]
    ] + rows_of_dividing()
