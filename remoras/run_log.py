"""The run log of a vehicle: what it writes into the tables of a run about itself and its view of the others.

Every run has it, written to a folder or not: figures of the summary come from its rows (roles, organisation, faults),
and so do replays, ``known`` and the invariants of stress.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from remoras.activities import Objective, WeighedSet
from remoras.authority import Act, Request, Ruling
from remoras.htn import Execution, Task
from remoras.organisation import Organisation, Outcome, RoleAssignment
from remoras.recorder import Recorder
from remoras.rows import Row

RoleKey = tuple[str, str]


class RunLog:
    """Rows of one vehicle. Views and decisions are written when they change.

    Args:
        me: name of the vehicle.
        names: of all vehicles, in the order of the nodes.
        recorder: takes the rows.
    """

    def __init__(self, me: str, names: Iterable[str], recorder: Recorder) -> None:
        self._me = me
        self._node = {name: node for node, name in enumerate(names)}
        self._recorder = recorder
        self._driving: frozenset[RoleKey] = frozenset()
        self._plans: dict[tuple[str, str, str, str], tuple[int, list[Row]]] = {}
        self._weighed: list[tuple[Objective | None, tuple[str, ...], bool]] = []

    def fault(self, now_s: float, kind: str, *details: str) -> None:
        """Something went wrong, once for each of the details."""
        self._recorder.faults.extend((now_s, self._me, kind, detail) for detail in details)

    def peers(self, now_s: float, events: Iterable[tuple[str, str]]) -> None:
        """Peers have become absent or present: the event, and the name of each."""
        self._recorder.membership.extend((now_s, self._me, peer, event) for event, peer in events)

    def roles(self, now_s: float, roles: Iterable[RoleAssignment], event: str) -> None:
        """The vehicle itself has taken or left roles."""
        self._recorder.roles.extend((now_s, self._me, role.group, role.role, event) for role in roles)

    def founded(self, organisation: Organisation, objectives: Iterable[Objective], began_s: float) -> None:
        """What was agreed before the mission, by nobody in particular; it counts for the vehicle since it began."""
        roles = sorted(
            organisation.assignments,
            key=lambda assignment: (assignment.group, assignment.role, self._node[assignment.vehicle]),
        )
        asked = [Request("", Act.ASSIGN, role.group, role.role, role.vehicle) for role in roles]
        asked += [
            Request(
                "",
                Act.OBJECTIVE,
                objective.group,
                objective.role,
                objective=objective.name,
                argument=objective.argument,
            )
            for objective in objectives
        ]
        self.rulings(began_s, [Ruling(request, Outcome.SUCCESS) for request in asked])

    def rulings(self, now_s: float, rulings: Iterable[Ruling]) -> None:
        """What became of requests to change the organisation, in the view of the vehicle; refusals are faults too.

        Roles that it takes and leaves itself are written in their order: it may take one anew.
        """
        for ruling in rulings:
            asked, event = ruling.asked, ruling.event
            if event == "refused":
                self.fault(now_s, "refused assignment", f"{asked.issuer}: {asked}: {ruling.outcome.value}")
            elif event in ("assigned", "left") and asked.assignee == self._me:
                self.roles(now_s, [RoleAssignment(asked.group, asked.role, self._me)], event)
            self._recorder.organisation.append(
                (now_s, self._me, asked.assignee, asked.group, asked.role, event, asked.issuer, asked.act.value,
                 asked.objective, asked.argument, ruling.outcome.value)
            )  # fmt: skip

    def plans(self, now_s: float, of_groups: Mapping[str, Execution], own: Mapping[Objective, Execution]) -> None:
        """How far the plans are that the vehicle carries out.

        Args:
            of_groups: of the missions of groups, by name; own: of its objectives.
        """
        for group, execution in of_groups.items():
            self._plan(now_s, (group, "", "", ""), execution)
        for aim, execution in own.items():
            self._plan(now_s, (aim.group, aim.role, aim.name, aim.argument), execution)

    def _plan(self, now_s: float, about: tuple[str, str, str, str], execution: Execution) -> None:
        version, before = self._plans.get(about, (None, []))
        if version == execution.version:
            return
        rows: list[Row] = []
        for node, (branch, status) in enumerate(zip(execution.branches, execution.statuses(), strict=True)):
            expected = (None, None) if branch.expected is None else branch.expected
            rows.append((node, branch.parent, _named(branch.task), branch.method or "", status.value, *expected))
        self._recorder.plans.extend(
            (now_s, self._me, *about, *row) for at, row in enumerate(rows) if row not in before[at : at + 1]
        )
        self._plans[about] = execution.version, rows

    def drives(self, now_s: float, driving: frozenset[RoleKey], candidates: Sequence[WeighedSet]) -> None:
        """The vehicle has chosen anew.

        Args:
            driving: roles that drive it from now on.
            candidates: what it could choose from.
        """
        before, self._driving = self._driving, driving
        for roles, event in ((before - driving, "inactive"), (driving - before, "active")):
            self._recorder.roles.extend((now_s, self._me, *role, event) for role in sorted(roles))
        for candidate in candidates:
            if candidate.chosen:
                role = candidate.of.objective.role if candidate.of.objective is not None else ""
                self._recorder.activities.extend(
                    (now_s, self._me, activity.type.name.lower(), activity.name, role, candidate.motivation)
                    for activity in candidate.of.effective
                )

    def weighs(self, now_s: float, candidates: Sequence[WeighedSet]) -> None:
        """The vehicle has weighed what it could do; written if other sets stand to choice, or others are chosen."""
        names = [tuple(activity.name for activity in candidate.of.effective) for candidate in candidates]
        weighed = [
            (candidate.of.objective, of, candidate.chosen) for candidate, of in zip(candidates, names, strict=True)
        ]
        if weighed == self._weighed:
            return
        self._weighed = weighed
        for candidate, of in zip(candidates, names, strict=True):
            aim = candidate.of.objective
            about = ("", "", "", "") if aim is None else (aim.group, aim.role, aim.name, aim.argument)
            motives = (candidate.stimulus, candidate.own, candidate.external, candidate.source, candidate.slot)
            choice = (candidate.chosen, candidate.best_mean)
            self._recorder.decisions.append((now_s, self._me, *about, list(of), *motives, *choice))


def _named(task: Task) -> str:
    """A task with those of its arguments that are texts."""
    texts = [argument for argument in task.args if isinstance(argument, str)]
    return f"{task.name}({', '.join(texts)})" if texts else task.name
