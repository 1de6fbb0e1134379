"""What counts from the end of a round, and how it came to be: every change with whoever asked for it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

from remoras.activities import Objective
from remoras.authority import NOBODY, Act, Request, Ruling
from remoras.beliefs import Key
from remoras.organisation import Group, Organisation, Outcome, RoleAssignment
from worldmodel import Observation
from worldmodel.facts import BlockKey

Place = tuple[BlockKey, int]
"""Where a statement is: the key of its block, and its position there."""
UNCHANGED = frozenset({Outcome.ROLE_ALREADY_HANDLED, Outcome.ROLE_NOT_HANDLED})
"""Outcomes of what is so already: neither a change nor a refusal."""


@dataclass(slots=True)
class Agreed:
    """What counts from the end of a round.

    Attributes:
        organisation: with all that was agreed.
        absent: vehicles that make room for others; unavailable: those that take no jobs now.
        assigned, left: roles that vehicles took and left, in the order in which they did.
        formed, dissolved: names of groups, in the order in which they were.
        objectives: given to roles; missions: groups that were given one, and which.
        rulings: what became of every request, changes and refusals, in order.
        unlawful: statements that their issuers had no right to make.
    """

    organisation: Organisation
    absent: frozenset[str] = NOBODY
    unavailable: frozenset[str] = NOBODY
    assigned: list[RoleAssignment] = field(default_factory=list)
    left: list[RoleAssignment] = field(default_factory=list)
    formed: list[str] = field(default_factory=list)
    dissolved: list[str] = field(default_factory=list)
    objectives: list[Objective] = field(default_factory=list)
    missions: list[tuple[str, str]] = field(default_factory=list)
    rulings: list[Ruling] = field(default_factory=list)
    unlawful: set[Place] = field(default_factory=set)

    def of(self, vehicle: str) -> tuple[list[RoleAssignment], list[RoleAssignment]]:
        """Roles that one vehicle took, and those that it left."""
        taken = [assignment for assignment in self.assigned if assignment.vehicle == vehicle]
        return taken, [assignment for assignment in self.left if assignment.vehicle == vehicle]

    @property
    def renewed(self) -> tuple[str, ...]:
        """Groups that were formed or dissolved: what was agreed in them before is over."""
        return tuple(dict.fromkeys([*self.formed, *self.dissolved]))

    @property
    def keys(self) -> set[Key]:
        """Facts that have changed with missions and formations."""
        has = {("hasMission", group) for group, _ in self.missions}
        has |= {("given", f"{group}.{mission}") for group, mission in self.missions}
        return has | {("formed", group) for group in self.renewed}

    def objectives_after(
        self, before: Mapping[tuple[str, str, str], Objective], founding: Collection[Objective]
    ) -> dict[tuple[str, str, str], Objective]:
        """The objectives of roles by group, role and name.

        Args:
            before: the same, as it was.
            founding: those agreed before the mission, which stay.
        """
        kept = {key: one for key, one in before.items() if one.group not in self.renewed or one in founding}
        return kept | {(objective.group, objective.role, objective.name): objective for objective in self.objectives}

    def assign(self, asked: Request, yielding: frozenset[str] = NOBODY) -> Outcome:
        """Let a vehicle play a role; where there is no room, in the place of holders that all are absent or yield."""
        one = RoleAssignment(asked.group, asked.role, asked.assignee)
        organisation, outcome = self.organisation.assign(one.vehicle, one.group, one.role)
        holders = self.organisation.members(one.group, one.role)
        if outcome is Outcome.NO_ROOM and (self.absent | yielding).issuperset(holders):
            for name in holders:
                self.leave(Request(asked.issuer, Act.RELEASE, one.group, one.role, name))
            organisation, outcome = self.organisation.assign(one.vehicle, one.group, one.role)
        if outcome is Outcome.SUCCESS:
            self.organisation = organisation
            self.assigned.append(one)
            self.note(asked, outcome)
        return outcome

    def leave(self, asked: Request) -> Outcome:
        """Let a vehicle play a role no longer."""
        one = RoleAssignment(asked.group, asked.role, asked.assignee)
        self.organisation, outcome = self.organisation.leave_role(one.vehicle, one.group, one.role)
        if outcome is Outcome.SUCCESS:
            self.left.append(one)
        self.note(asked, outcome)
        return outcome

    def form(self, asked: Request, group: Group) -> None:
        """Let a group be formed under its first head."""
        self.organisation, outcome = self.organisation.form(group)
        self.formed.append(group.name)
        self.note(asked, outcome)
        self.assign(replace(asked, act=Act.ASSIGN))

    def dissolve(self, asked: Request) -> None:
        """Let all members leave a group, and the group be no more."""
        for name in self.organisation.members(asked.group):
            for role in self.organisation.roles_of(name, asked.group):
                self.leave(Request(asked.issuer, Act.RELEASE, role.group, role.role, role.vehicle))
        self.organisation, outcome = self.organisation.dissolve(asked.group)
        self.dissolved.append(asked.group)
        self.note(asked, outcome)

    def give(self, asked: Request) -> None:
        """Let a role have an objective, or a group a mission."""
        if asked.act is Act.MISSION:
            self.missions.append((asked.group, asked.argument))
        else:
            self.objectives.append(Objective(asked.group, asked.role, asked.objective, asked.argument))
        self.note(asked, Outcome.SUCCESS)

    def refuse(self, asked: Request, outcome: Outcome, said: Observation) -> None:
        """Let a statement that its issuer had no right to make count for nothing."""
        self.unlawful.add((said.block.key, said.position))
        self.note(asked, outcome)

    def note(self, asked: Request, outcome: Outcome) -> None:
        """Keep what became of a request, unless it is so already."""
        if outcome not in UNCHANGED:
            self.rulings.append(Ruling(asked, outcome))
