"""Metrics of the organisation: divergence of views, conflicts of holders, refused requests.

They are computed from the table ``organisation``, which records every change of each vehicle's view. A vehicle's own
view of its roles is the truth. Absent vehicles do not count meanwhile.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator
from typing import NamedTuple

from missions.fault import absences
from missions.metric import MeasuredRun
from remoras.nesting import Malformed, specification_faults
from remoras.organisation import Organisation, RoleAssignment, RoleKey


class _Event(NamedTuple):
    """Change of a view; with ``role`` None the vehicle enters (``holds``) or leaves the mission."""

    time_s: float
    vehicle: str
    peer: str
    role: RoleKey | None
    holds: bool


def _events(run: MeasuredRun) -> list[_Event]:
    """Return all changes in time order; at equal times, vehicles enter and leave first."""
    changes = [
        _Event(row[0], row[1], row[2], (row[3], row[4]), row[5] == "assigned")
        for row in run.recorder.rows("organisation")
        if row[5] in ("assigned", "left")
    ]
    moves = [_Event(at_s, name, "", None, not away) for at_s, name, away in absences(run.recorder.rows("faults"))]
    return sorted([*moves, *changes], key=lambda event: event.time_s)


class _Views:
    """Views of all vehicles at one moment, and the pairs that differ.

    ``left_out`` roles are not compared; ``rooms`` limits their holders. ``by_groups``: vehicles need to know only the
    roles of their groups.
    """

    def __init__(
        self, names: tuple[str, ...], left_out: frozenset[RoleKey], rooms: dict[RoleKey, int], by_groups: bool
    ) -> None:
        self._names = names
        self._by_groups = by_groups
        self._left_out = left_out
        self._rooms = rooms
        self._inside = set(names)
        self._views: dict[tuple[str, str], set[RoleKey]] = {(v, p): set() for v in names for p in names}
        self._wrong: dict[tuple[str, str], set[RoleKey]] = {(v, p): set() for v in names for p in names}

    def apply(self, event: _Event) -> None:
        viewer, peer, role = event.vehicle, event.peer, event.role
        if role is None:
            (self._inside.add if event.holds else self._inside.discard)(viewer)
            return
        view = self._views[viewer, peer]
        if (role in view) == event.holds:
            return
        (view.add if event.holds else view.discard)(role)
        if role in self._left_out:
            return
        for other in self._names if viewer == peer else (viewer,):
            if other != peer:
                agree = (role in self._views[other, peer]) == (role in self._views[peer, peer])
                (self._wrong[other, peer].discard if agree else self._wrong[other, peer].add)(role)

    @property
    def divergence(self) -> float | None:
        """Share of (viewer, peer) pairs with an error on the peer's roles; None without pairs."""
        n_inside = len(self._inside)
        n_wrong = sum(self._inside.issuperset(pair) and self._errs(pair[0], on) for pair, on in self._wrong.items())
        return n_wrong / (n_inside * (n_inside - 1)) if n_inside > 1 else None

    def _errs(self, viewer: str, wrong: set[RoleKey]) -> bool:
        """True if a wrong role counts as an error: any, or with needs by groups one of own groups."""
        if not self._by_groups or not wrong:
            return bool(wrong)
        own = {group for group, _ in self._views[viewer, viewer]}
        return any(group in own for group, _ in wrong)

    @property
    def true_roles(self) -> Iterator[RoleAssignment]:
        """Roles that the present vehicles play by their own views."""
        for name in self._inside:
            yield from (RoleAssignment(*role, name) for role in self._views[name, name])

    @property
    def is_in_conflict(self) -> bool:
        """True if a role has more holders, by their own views, than allowed."""
        holders = Counter(role for name in self._inside for role in self._views[name, name] if role in self._rooms)
        return any(n > self._rooms[role] for role, n in holders.items())


def _moments(run: MeasuredRun) -> Iterator[tuple[float, _Views]]:
    """Yield duration (s) and views of each constant interval."""
    keeps_jobs = run.setup.strategy.declaration.private_jobs
    groups = run.setup.agreement.groups
    roles = {(group.name, role.name): role for group in groups for role in group.roles}
    views = _Views(
        tuple(run.setup.database),
        frozenset(key for key, role in roles.items() if keeps_jobs and role.job is not None),
        {key: role.maximum for key, role in roles.items() if role.maximum is not None},
        run.setup.subjects is not None,
    )
    before_s = 0.0
    for event in _events(run):
        if event.time_s >= run.end_s:
            break
        if event.time_s > before_s:
            yield event.time_s - before_s, views
            before_s = event.time_s
        views.apply(event)
    yield run.end_s - before_s, views


def _mean_over_time(run: MeasuredRun, value_of: Callable[[_Views], float | None]) -> float | None:
    """Mean of a value of the views over the time in which they have one; None without any."""
    spells = [(spell_s, value) for spell_s, views in _moments(run) if (value := value_of(views)) is not None]
    total_s = math.fsum(spell_s for spell_s, _ in spells)
    return round(math.fsum(spell_s * value for spell_s, value in spells) / total_s, 6) if total_s > 0.0 else None


def view_divergence(run: MeasuredRun) -> float | None:
    """Share of time, over all pairs of vehicles, with an error on the other's roles.

    Roles with a job are ignored if the strategy keeps them private. If needs follow from groups, so are roles of groups
    without the viewer.
    """
    return _mean_over_time(run, lambda views: views.divergence)


def holder_conflict_fraction(run: MeasuredRun) -> float | None:
    """Share of time in which a role has more holders, by their own views, than allowed."""
    return _mean_over_time(run, lambda views: views.is_in_conflict)


def malformed_spells(run: MeasuredRun) -> Iterator[tuple[float, tuple[Malformed, ...]]]:
    """Yield intervals (s) with the violations of the specification by the vehicles' own roles."""
    groups = tuple(run.setup.agreement.organisation.groups.values())
    known: frozenset[RoleAssignment] | None = None
    faults: tuple[Malformed, ...] = ()
    for spell_s, views in _moments(run):
        roles = frozenset(views.true_roles)
        if roles != known:
            known, faults = roles, specification_faults(Organisation.of(groups, roles))
        yield spell_s, faults


def malformed_s(run: MeasuredRun) -> float:
    """Time (s) in which the organisation was not well formed, see ``remoras.nesting``."""
    return round(math.fsum(spell_s for spell_s, faults in malformed_spells(run) if faults), 4)


def missed(run: MeasuredRun) -> dict[str, float]:
    """Return the time (s) of each violation by its key, as ``group.West.role.Hand.minimum``."""
    lasted: dict[str, float] = {}
    for spell_s, faults in malformed_spells(run):
        for fault in faults:
            lasted[fault.key] = lasted.get(fault.key, 0.0) + spell_s
    return {key: round(total_s, 4) for key, total_s in lasted.items()}


def n_refused_acts(run: MeasuredRun) -> int:
    """Number of refused requests to change the organisation, counted per refusing vehicle."""
    return sum(row[5] == "refused" for row in run.recorder.rows("organisation"))
