"""How a fleet falls into cells: who shares a schedule, where it is, what passes from one cell to another.

docs/howto/cells.md. A fleet without cells is one cell.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import Any

WHOLE: dict[str, Any] = {"name": ""}
"""The one cell of a fleet without cells."""


class Cells:
    """The cells of a scenario.

    Args:
        scenario: its tables; by_slot: names of all vehicles, by their slots.
    """

    def __init__(self, scenario: dict[str, Any], by_slot: Sequence[str]) -> None:
        self._scenario = scenario
        self.tables: list[dict[str, Any]] = scenario.get("cell") or [WHOLE]
        self.number_of = {
            name: number for number, table in enumerate(self.tables) for name in table.get("vehicles", by_slot)
        }
        self.members = [[name for name in by_slot if self.number_of[name] == at] for at in range(len(self.tables))]
        """Vehicles of each cell, by their places in its frame."""
        pairs: list[list[str]] = [table["vehicles"] for table in scenario.get("gateway", [])]
        self.first_of = {second: first for first, second in pairs}
        """First address of a gateway, by the second, which has no body."""
        self.other_of: dict[str, str] = {**self.first_of, **dict(pairs)}
        """The other address of a gateway, by each."""

    def peers(self, name: str) -> list[str]:
        """Who shares the schedule of a vehicle, itself among them."""
        return self.members[self.number_of[name]]

    def body(self, name: str) -> str:
        """Whose body a vehicle has: its own, but for second addresses."""
        return self.first_of.get(name, name)

    def addresses(self, name: str) -> set[str]:
        """All addresses of a vehicle."""
        return {name, self.other_of.get(name, name)}

    def waters(self, name: str) -> tuple[list[float], list[float]]:
        """Area of operations of a vehicle: west and east, south and north border."""
        table, world = self.tables[self.number_of[name]], self._scenario["world"]
        return table.get("x_m") or world["x_m"], table.get("y_m") or world["y_m"]

    @cached_property
    def _beside(self) -> list[set[int]]:
        """Numbers of the cells that each is joined with."""
        found: list[set[int]] = [set() for _ in self.tables]
        for second, first in self.first_of.items():
            one, other = self.number_of[first], self.number_of[second]
            found[one].add(other)
            found[other].add(one)
        return found

    def passes(self, origin: str, name: str, attribute: str) -> bool:
        """True if gateways pass a fact of one vehicle on to another, in another cell."""
        settings = self._scenario.get("cells", {})
        reached = {self.number_of[origin]}
        for _ in range(int(settings.get("hops", 2))):
            reached |= {beside for number in reached for beside in self._beside[number]}
        return attribute in settings.get("relays", []) and self.number_of[name] in reached

    def turns(self, packets: Iterable[tuple[int, float, str]], turn_s: float, error_s: float) -> tuple[int, list[int]]:
        """How many turns a slot has, and in which of them each cell sends, by when it has sent.

        Args:
            packets: slot, time (s) and sender of each.
            turn_s: length of a turn (s).
            error_s: by how much times may be off (s).

        Returns:
            The least number of turns by which every cell keeps to one; one, and the first for all, if none does.
        """
        sent = [(slot, time_s, self.number_of[sender]) for slot, time_s, sender in packets]
        for n_turns in range(1, len(self.tables) + 1):
            found: dict[int, int] = {}
            for slot, time_s, number in sent:
                turn = round(time_s / turn_s) - slot * n_turns
                is_whole = abs(time_s - (slot * n_turns + turn) * turn_s) <= error_s
                if not is_whole or not 0 <= turn < n_turns or found.setdefault(number, turn) != turn:
                    break
            else:
                return n_turns, [found.get(number, 0) for number in range(len(self.tables))]
        return 1, [0] * len(self.tables)

    def disturbing(self, turns: Sequence[int]) -> list[tuple[str, str]]:
        """Cells that send in one turn though their waters are within interference of each other."""
        settings, communication = self._scenario.get("cells", {}), self._scenario["communication"]
        reach_m = float(settings.get("interference_m") or 2.0 * communication["range_m"])
        found = []
        for one, table in enumerate(self.tables):
            for other in range(one):
                ways = zip(self.waters(self.members[one][0]), self.waters(self.members[other][0]), strict=True)
                across_m = [max(0.0, a[0] - b[1], b[0] - a[1]) for a, b in ways]
                is_near = across_m[0] * across_m[0] + across_m[1] * across_m[1] <= reach_m * reach_m
                if turns[one] == turns[other] and (is_near or other in self._beside[one]):
                    found.append((table["name"], self.tables[other]["name"]))
        return found

    def done_s(self, name: str, milestones: Iterable[dict[str, Any]]) -> float:
        """When all groups of the cell of a vehicle had met, while other cells go on; infinite if they had not."""
        groups = self.tables[self.number_of[name]].get("groups", [])
        met_s = {stone["group"]: float(stone["time_s"]) for stone in milestones if stone["name"] == "gathered"}
        return max((met_s.get(group, math.inf) for group in groups), default=math.inf)

    def areas(self) -> list[set[str]]:
        """Names of the areas of each cell: jobs of the roles of its groups."""
        groups = self._scenario["group"]
        return [
            {
                role["job"]
                for group in groups
                if group["name"] in table.get("groups", [group["name"]])
                for role in group.get("role", [])
                if role.get("job")
            }
            for table in self.tables
        ]
