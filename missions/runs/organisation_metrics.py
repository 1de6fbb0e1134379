"""Metrics of the organisation; a vehicle's own view of its roles is the truth, absent vehicles do not count."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator
from itertools import permutations
from typing import NamedTuple

from missions.fault import absences
from missions.metric import MeasuredRun
from remoras.group_hierarchy import specification_faults
from remoras.organisation import Organisation, RoleAssignment, RoleKey


class _Event(NamedTuple):
    """Change of a view; with ``role`` None the vehicle enters (``holds``) or leaves the mission."""

    time_s: float
    vehicle: str
    peer: str
    role: RoleKey | None
    holds: bool


def _events(run: MeasuredRun) -> list[_Event]:
    changes = [
        _Event(row[0], row[1], row[2], (row[3], row[4]), row[5] == "assigned")
        for row in run.recorder.rows("organisation")
        if row[5] in ("assigned", "left")
    ]
    moves = [_Event(at_s, name, "", None, not away) for at_s, name, away in absences(run.recorder.rows("faults"))]
    # A stable sort: of equal times, the moves come first.
    return sorted([*moves, *changes], key=lambda event: event.time_s)


class _Views:
    """Views at one moment: ``left_out`` roles are not compared; with ``by_groups`` only those of own groups count."""

    def __init__(
        self, names: Iterable[str], left_out: frozenset[RoleKey], rooms: dict[RoleKey, int], by_groups: bool
    ) -> None:
        self._by_groups = by_groups
        self._left_out = left_out
        self._rooms = rooms
        self._inside = set(names)
        self._views: defaultdict[tuple[str, str], set[RoleKey]] = defaultdict(set)

    def apply(self, event: _Event) -> None:
        if event.role is None:
            (self._inside.add if event.holds else self._inside.discard)(event.vehicle)
        else:
            view = self._views[event.vehicle, event.peer]
            (view.add if event.holds else view.discard)(event.role)

    @property
    def divergence(self) -> float | None:
        pairs = list(permutations(self._inside, 2))
        return sum(self._errs(*pair) for pair in pairs) / len(pairs) if pairs else None

    def _errs(self, viewer: str, peer: str) -> bool:
        """True if a viewer is wrong on a role of a peer: any, or with needs by groups one of its own groups."""
        wrong = (self._views[viewer, peer] ^ self._views[peer, peer]) - self._left_out
        own = {group for group, _ in self._views[viewer, viewer]}
        return any(not self._by_groups or group in own for group, _ in wrong)

    @property
    def true_roles(self) -> Iterator[RoleAssignment]:
        for name in self._inside:
            yield from (RoleAssignment(*role, name) for role in self._views[name, name])

    @property
    def is_in_conflict(self) -> bool:
        holders = Counter(role for name in self._inside for role in self._views[name, name] if role in self._rooms)
        return any(n > self._rooms[role] for role, n in holders.items())


def _moments(run: MeasuredRun) -> Iterator[tuple[float, _Views]]:
    """Yield each interval (s) without changes, with the views in it."""
    keeps_jobs = run.setup.strategy.declaration.private_jobs
    groups = run.setup.agreement.groups
    roles = {(group.name, role.name): role for group in groups for role in group.roles}
    views = _Views(
        run.setup.database,
        frozenset(key for key, role in roles.items() if keeps_jobs and role.job is not None),
        {key: role.maximum for key, role in roles.items() if role.maximum is not None},
        run.setup.subjects is not None,
    )
    before_s = 0.0
    for event in _events(run):
        if event.time_s >= run.ended_s:
            break
        if event.time_s > before_s:
            yield event.time_s - before_s, views
            before_s = event.time_s
        views.apply(event)
    yield run.ended_s - before_s, views


def _mean_over_time(run: MeasuredRun, value_of: Callable[[_Views], float | None]) -> float | None:
    spells = [(spell_s, value) for spell_s, views in _moments(run) if (value := value_of(views)) is not None]
    total_s = math.fsum(spell_s for spell_s, _ in spells)
    return round(math.fsum(spell_s * value for spell_s, value in spells) / total_s, 6) if total_s > 0.0 else None


def view_divergence(run: MeasuredRun) -> float | None:
    """Share of time, over all pairs of vehicles, with an error on the other's roles.

    Not compared are private roles with a job and, if needs follow from groups, roles of groups without the viewer.
    """
    return _mean_over_time(run, lambda views: views.divergence)


def holder_conflict_fraction(run: MeasuredRun) -> float | None:
    """Share of time in which a role has more holders, by their own views, than allowed."""
    return _mean_over_time(run, lambda views: views.is_in_conflict)


def malformed_s(run: MeasuredRun) -> float:
    """Time (s) in which the vehicles' own roles violated the specification, see ``remoras.group_hierarchy``."""
    groups = tuple(run.setup.agreement.organisation.groups.values())
    known: dict[frozenset[RoleAssignment], bool] = {}
    spells_s = []
    for spell_s, views in _moments(run):
        roles = frozenset(views.true_roles)
        # Few sets of roles recur over many intervals, and each check visits the whole specification.
        if roles not in known:
            known[roles] = bool(specification_faults(Organisation.of(groups, roles)))
        if known[roles]:
            spells_s.append(spell_s)
    return round(math.fsum(spells_s), 4)


def n_refused_acts(run: MeasuredRun) -> int:
    """Number of refused requests to change the organisation, counted per refusing vehicle."""
    return sum(row[5] == "refused" for row in run.recorder.rows("organisation"))
