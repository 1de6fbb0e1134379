"""Tables that a vehicle writes in every run; summary, replay and ``known`` follow from them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from exchange.manager.manager import ExchangeManager
from exchange.packets import Met, Reception, Transmission
from remoras.activities import Objective, WeighedSet
from remoras.authority import Act, Request, Ruling
from remoras.htn import Execution, Task
from remoras.organisation import Organisation, Outcome, RoleAssignment
from remoras.recorder import TIME, VEHICLE, Column, Recorder, Row, Table
from remoras.work import Computed

if TYPE_CHECKING:
    from exchange.packets import Fragment, ItemUid
    from exchange.policy.candidates import Expiry
    from exchange.policy.queue import Queue
    from remoras.beliefs import Beliefs
    from worldmodel import Block


LINK_FRAMES = 8
"""TDMA frames between rows of a link."""
EVENTS = {Met.BACK: "heard again", Met.NEW_LIFE: "begins anew"}
SLOT_CONFLICT = "slot conflict"


DELIVERIES = Table("deliveries", (
    TIME, VEHICLE, Column("item", "str"), Column("event", "str"), Column("reason", "str"),
    Column("latency_s", "float", "s"),
))  # fmt: skip
"""Fate of items and statuses that a vehicle had to send.

``acknowledged`` (all interested nodes hold it), ``expired`` (no longer sent; reason: time to live, overflow,
superseded, not needed, sent once), or ``postponed`` (waits outside of the full queue). The latency counts from the
observation.
"""
UNSAID = Table("unsaid", (
    Column("slot", "int"), TIME, VEHICLE, Column("reason", "str"), Column("candidates", "int"),
))  # fmt: skip
"""Queued items and statuses not sent in a slot, by reason (``candidates.Unsaid``)."""


class RadioLog:
    """Rows of one vehicle about packets, items and peers; ``recorder`` may be replaced."""

    def __init__(self, names: Sequence[str], beliefs: Beliefs, manager: ExchangeManager, recorder: Recorder) -> None:
        self._names, self._beliefs, self.recorder = names, beliefs, recorder
        self._me = names[beliefs.model.owner]
        nodes = {name: node for node, name in enumerate(names) if name != self._me}
        self.links = Computed(nodes, lambda name: manager.links(nodes[name]), anew=True)

    def fault(self, now_s: float, kind: str, detail: str) -> None:
        """Write a fault that the vehicle noticed."""
        self.recorder.faults.append((now_s, self._me, kind, detail))

    def facts(self, block: Block | Fragment, name: str, kind: str, now_s: float) -> None:
        """Write the facts of a block or item that the vehicle recorded."""
        append, as_text = self.recorder.items.append, self._beliefs.as_text
        for fact in block.facts:
            uncertainty = "" if fact.uncertainty is None else repr(fact.uncertainty)
            append((name, self._me, block.time_s, now_s, *as_text(fact), kind, uncertainty))

    def item(self, now_s: float, uid: ItemUid, event: str) -> None:
        """Write an event of an item."""
        self.recorder.knowledge.append((now_s, self._me, str(uid), self._names[uid.origin], event))

    def sent(self, sent: Transmission, now_s: float) -> None:
        """Write events of peers noticed in a slot; every ``LINK_FRAMES`` frames the link states."""
        for node, event in sent.noticed:
            self.recorder.peers.append((now_s, self._me, self._names[node], event))
        if sent.slot // len(self._names) % LINK_FRAMES == LINK_FRAMES - 1:
            for name, links in self.links.items():
                for direction, link in links._asdict().items():
                    if link.n:
                        self.recorder.links.append((now_s, self._me, name, direction, link.p_loss, link.n))

    def unsent(self, queue: Queue, slot: int, now_s: float) -> None:
        """Write items not sent in an own slot, and expired ones."""
        self.expired(queue.take_expired(), now_s)
        rows = self.recorder.rows(UNSAID.name)
        rows.extend([(slot, now_s, self._me, reason.value, count) for reason, count in queue.unsaid.items()])

    def expired(self, expired: Iterable[Expiry], now_s: float) -> None:
        """Write items that the vehicle no longer sends."""
        rows = self.recorder.rows(DELIVERIES.name)
        for expiry in expired:
            event = "postponed" if expiry.comes_back else "expired"
            rows.append((now_s, self._me, str(expiry.uid), event, expiry.reason.value, expiry.latency_s))

    def met(self, reception: Reception, now_s: float) -> None:
        """Write events of the sender that a packet reveals."""
        rows = self.recorder.peers
        if reception.met in EVENTS:
            rows.append((now_s, self._me, self._names[reception.sender], EVENTS[reception.met]))
        if reception.conflict is not None:
            rows.append((now_s, self._me, self._names[reception.conflict], SLOT_CONFLICT))
            self.fault(now_s, SLOT_CONFLICT, f"another speaks as {self._names[reception.conflict]}")

    def acknowledged(self, uids: Iterable[ItemUid], now_s: float) -> None:
        """Write items that all interested nodes hold, as the vehicle knows."""
        rows = self.recorder.rows(DELIVERIES.name)
        for uid in uids:
            self.item(now_s, uid, "acknowledged")
            block = self._beliefs.model.arrived((uid.origin, uid.epoch, uid.sequence))
            latency_s = None if block is None else now_s - block.time_s
            rows.append((now_s, self._me, str(uid), "acknowledged", "", latency_s))


RoleKey = tuple[str, str]


class RunLog:
    """Rows of one vehicle; views and decisions are written when they change."""

    def __init__(self, me: str, names: Iterable[str], recorder: Recorder) -> None:
        self._me = me
        self._node = {name: node for node, name in enumerate(names)}
        self._recorder = recorder
        self._driving: frozenset[RoleKey] = frozenset()
        self._plans: dict[tuple[str, str, str, str], tuple[int, list[Row]]] = {}
        self._weighed: list[tuple[Objective | None, tuple[str, ...], bool]] = []

    def fault(self, now_s: float, kind: str, *details: str) -> None:
        """Write a fault for each detail."""
        self._recorder.faults.extend((now_s, self._me, kind, detail) for detail in details)

    def peers(self, now_s: float, events: Iterable[tuple[str, str]]) -> None:
        """Write (event, peer): absent or present."""
        self._recorder.membership.extend((now_s, self._me, peer, event) for event, peer in events)

    def roles(self, now_s: float, roles: Iterable[RoleAssignment], event: str) -> None:
        """Write roles that the vehicle itself took or left."""
        self._recorder.roles.extend((now_s, self._me, role.group, role.role, event) for role in roles)

    def founded(self, organisation: Organisation, objectives: Iterable[Objective], began_s: float) -> None:
        """Write the agreement before the mission, without issuer, at the vehicle's start."""
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
        """Write outcomes of requests in order, own roles included; refusals also as faults."""
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
        """Write changed tasks of the plans that the vehicle executes."""
        for group, execution in of_groups.items():
            self._plan(now_s, (group, "", "", ""), execution)
        for aim, execution in own.items():
            self._plan(now_s, (aim.group, aim.role, aim.name, aim.argument), execution)

    def _plan(self, now_s: float, owner: tuple[str, str, str, str], execution: Execution) -> None:
        version, before = self._plans.get(owner, (None, []))
        if version == execution.version:
            return
        rows: list[Row] = []
        for node, (branch, status) in enumerate(zip(execution.branches, execution.statuses(), strict=True)):
            expected = (None, None) if branch.expected is None else branch.expected
            rows.append((node, branch.parent, _named(branch.task), branch.method or "", status.value, *expected))
        self._recorder.plans.extend(
            (now_s, self._me, *owner, *row) for index, row in enumerate(rows) if row not in before[index : index + 1]
        )
        self._plans[owner] = execution.version, rows

    def decided(self, now_s: float, driving: frozenset[RoleKey], candidates: Sequence[WeighedSet]) -> None:
        """Write a decision if candidates or chosen sets have changed; ``driving`` are active roles."""
        names = [tuple(activity.name for activity in candidate.of.effective) for candidate in candidates]
        weighed = [
            (candidate.of.objective, activities, candidate.chosen)
            for candidate, activities in zip(candidates, names, strict=True)
        ]
        if weighed == self._weighed:
            return
        before, self._weighed = self._weighed, weighed
        for candidate, activities in zip(candidates, names, strict=True):
            aim = candidate.of.objective
            objective = ("", "", "", "") if aim is None else (aim.group, aim.role, aim.name, aim.argument)
            motives = (candidate.stimulus, candidate.own, candidate.external, candidate.source, candidate.slot)
            choice = (candidate.chosen, candidate.best_mean)
            self._recorder.decisions.append((now_s, self._me, *objective, list(activities), *motives, *choice))
        if {entry for entry in weighed if entry[-1]} != {entry for entry in before if entry[-1]}:
            self._drives(now_s, driving, candidates)

    def _drives(self, now_s: float, driving: frozenset[RoleKey], candidates: Sequence[WeighedSet]) -> None:
        inactive, active = self._driving - driving, driving - self._driving
        self._driving = driving
        for roles, event in ((inactive, "inactive"), (active, "active")):
            self._recorder.roles.extend((now_s, self._me, *role, event) for role in sorted(roles))
        for candidate in candidates:
            if candidate.chosen:
                role = candidate.of.objective.role if candidate.of.objective is not None else ""
                self._recorder.activities.extend(
                    (now_s, self._me, activity.type.name.lower(), activity.name, role, candidate.motivation)
                    for activity in candidate.of.effective
                )


def _named(task: Task) -> str:
    texts = [argument for argument in task.args if isinstance(argument, str)]
    return f"{task.name}({', '.join(texts)})" if texts else task.name
