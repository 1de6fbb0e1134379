"""Ground truth of missions with a rendezvous: progress, gathering, verdict.

A supervising group gathers after the groups that it supervises. No group waits for a vehicle that is dead, resigned or
out of contact, nor for a role that no free survivor can play. After the deadline the rendezvous of the present members
counts; ``missed_meeting`` names the others.

A failed mission ends once three conditions hold. No vehicle out of contact will return. No remaining vehicle can make
progress, or the vehicles report all remaining work as impossible. All live vehicles are at home or at a rally point.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import ClassVar

from exchange.arithmetic import distance
from missions.figure import RunResults
from missions.meeting.meeting import Meeting
from missions.metric import MeasuredRun
from remoras.activities import ROOM
from remoras.deadlock import PeerWait, deadlocks
from remoras.group_hierarchy import height
from remoras.mission import FleetView, Milestone, VehicleView
from remoras.motion.separation import NEAR_M
from remoras.organisation import Group
from remoras.recorder import CANNOT, FAULTS, TIME, VEHICLE, Column, Recorder, Table, Unread
from remoras.truth import COMPLETE, left, reachable_by_jobs, within_reach
from remoras.work import IS_IMPOSSIBLE, Job

JOBS = Table("jobs", (TIME, VEHICLE, Column("job", "str")))
"""Completed jobs; a job done by two vehicles has two rows."""
DEADLOCK = "deadlock"  # milestone of a vehicle in a cycle of waits that lasted to the end of the run
IN_ANY_CASE = {"SendingInfluenceSignals", "MissionPlanner"}  # activities that do not indicate a destination


class MeetingTruth:
    """Referee of a run: records gathered groups and judges its end; missions add their work.

    >>> from missions.runs.assembly import assemble
    >>> from missions.runs.setup import resolved
    >>> from missions.scenarios import load
    >>> truth: MeetingTruth = assemble(resolved(load("mapping-rendezvous")), 1).truth
    >>> truth.goal_fraction, truth.is_over
    (0.0, False)
    """

    work: ClassVar[str] = "meet"
    """Verb for the vehicles' work in the reason of a failed run."""

    def __init__(self, meeting: Meeting) -> None:
        self.milestones: list[Milestone] = []
        self._rally_points_m = meeting.rally_points_m
        self._radius_m, self._deadline_s = meeting.settings.arrival_radius_m, meeting.settings.meeting_deadline_s
        self._opens_s = meeting.opens_s
        self._there_s: dict[tuple[str, str], float] = {}  # vehicle and group
        self._waits_s: dict[tuple[str, str], float] = {}  # the same, with tolerance for vehicles pushed out a little
        self._has_met: set[tuple[str, str]] = set()
        self._is_awaited = False
        self._is_stranded = False
        self._is_planned = False
        self._consulted = False
        self._meets_after = before = meeting.meets_after
        founded = [group for group in meeting.groups.values() if group.formed_by is None]  # other groups are temporary
        from_below = sorted(founded, key=lambda group: height(group.name, before))
        self._apart = [group for group in from_below if group.rally_point is not None]
        names = {group.name for group in self._apart}
        # groups that still have to meet before each
        self._to_meet_before = {name: names.intersection(self._meets_after[name]) for name in names}
        self._n_meetings, self._n_met, self._last_met_s = len(self._apart), 0, 0.0

    @property
    def goal_fraction(self) -> float:
        """Share of groups with a rendezvous; missions with work report its share."""
        return self._n_met / self._n_meetings if self._n_meetings else 1.0

    def reachable_fraction(self, fleet: FleetView) -> float:
        """Share of the goal achieved or achievable; here all while any vehicle remains."""
        return 1.0 if left(fleet) else self.goal_fraction

    @property
    def open_fraction(self) -> float:
        """Share of unfinished work."""
        return 1.0 - self.goal_fraction

    def out_of_reach(self, fleet: FleetView) -> Sequence[str]:
        """Open work that no remaining vehicle can do; empty here."""
        return ()

    @property
    def is_given_up(self) -> bool:
        """True if vehicles report all open work as impossible; always False without work."""
        return False

    @property
    def is_over(self) -> bool:
        """True once no progress is possible; missions may end earlier."""
        return self._is_stranded

    def watch(self, fleet: FleetView, now_s: float) -> None:
        """Record mission events; called after each tick and round once all is planned."""

    def is_worked_off(self, group: Group) -> bool:
        """Return True if the work of the group permits its rendezvous."""
        return True

    def observe(self, fleet: FleetView, now_s: float) -> bool:
        """Record events; return True once the last group has gathered and the goal is reached."""
        survivors = alive = [vehicle for vehicle in fleet.vehicles if vehicle.is_in_contact]
        self._is_awaited = False
        if len(survivors) < len(fleet.vehicles):
            alive = [vehicle for vehicle in fleet.vehicles if vehicle.is_alive]
            self._is_awaited = any(vehicle.will_return for vehicle in fleet.vehicles)
        is_complete = self._look(fleet, survivors, alive, now_s)
        self._is_stranded = not (is_complete or self._is_awaited) and self._is_hopeless(fleet, alive, now_s)
        return is_complete

    def _is_hopeless(self, fleet: FleetView, alive: Sequence[VehicleView], now_s: float) -> bool:
        """True if all live vehicles are at rest and no remaining vehicle can or will make progress."""
        if not all(map(self._is_at_rest, alive)) or self.goal_fraction >= 1.0:
            return False
        if self._n_meetings and not self._apart and now_s - self._last_met_s >= self._deadline_s:
            return True
        if self.reachable_fraction(fleet) <= self.goal_fraction:
            return True
        return self.is_given_up and not any(map(self._has_work, alive))

    def _has_work(self, vehicle: VehicleView) -> bool:
        return False

    def _is_at_rest(self, vehicle: VehicleView) -> bool:
        if not vehicle.makes_headway:
            return True
        (x_m, y_m), radius_m = vehicle.position_m, self._radius_m
        for at_x_m, at_y_m in (vehicle.data.start_m, *self._rally_points_m.values()):
            dx_m, dy_m = x_m - at_x_m, y_m - at_y_m
            if dx_m * dx_m + dy_m * dy_m <= radius_m * radius_m:
                return True
        return False

    def _look(
        self, fleet: FleetView, survivors: Sequence[VehicleView], alive: Sequence[VehicleView], now_s: float
    ) -> bool:
        if not survivors:
            return False
        self._is_planned = self._is_planned or self._have_planned(survivors)
        if self._is_planned:
            if not self._consulted and next(self._not_consulted(survivors), None) is None:
                self._consulted = True
                self.milestones.append(Milestone(now_s, "consultation_done"))
            self.watch(fleet, now_s)
        for group in list(self._apart) if now_s >= self._opens_s else ():
            if self._to_meet_before[group.name]:
                continue
            self._note_who_is_there(alive, group, now_s)
            if not self._is_planned:
                continue  # a leader alone may meet before the others have planned
            if self._is_together(survivors, group) and self.is_worked_off(group):
                self._note_meeting(group, survivors, (), now_s)
            elif self._waits_s and self._is_overdue(survivors, group, now_s):
                missing = [v.name for v in self._members(survivors, group) if not self._has_come(v, group)]
                self._note_meeting(group, survivors, missing, now_s)
        if not self._is_planned or self._apart or self.goal_fraction < 1.0:
            return False
        self.milestones.append(Milestone(now_s, COMPLETE))
        return True

    def _note_meeting(
        self, group: Group, survivors: Sequence[VehicleView], missing: Sequence[str], now_s: float
    ) -> None:
        self._last_met_s = now_s
        self._apart.remove(group)
        for names in self._to_meet_before.values():
            names.discard(group.name)
        # A rendezvous at which no member is present ends the wait, but does not count.
        self._n_met += any(self._has_come(vehicle, group) for vehicle in self._members(survivors, group))
        self.milestones.append(Milestone(now_s, "gathered", group=group.name))
        self.milestones += [Milestone(now_s, "missed_meeting", name, group.name) for name in missing]

    def close(self, fleet: FleetView, now_s: float) -> str:
        """Add a milestone per deadlocked vehicle; return the reason of failure."""
        reason = "; ".join(self.reasons(fleet, now_s))
        self.milestones.sort(key=lambda milestone: milestone.time_s)
        return reason

    @property
    def share(self) -> str:
        """Share of the goal reached, as text."""
        return f"{100.0 * self.goal_fraction:.0f} % of the goal"

    def reasons(self, fleet: FleetView, now_s: float) -> Iterator[str]:
        """Yield reasons of failure: impossible work, missing, waiting or moving vehicles."""
        is_open = self._apart or (self.goal_fraction < 1.0 and not self.is_over)
        at_work = self._at_work(fleet) if is_open else []
        if self.goal_fraction < 1.0 and self.reachable_fraction(fleet) < 1.0:
            work = " ".join((self.work, ", ".join(self.out_of_reach(fleet)))).strip()
            yield f"no vehicle left that is able to {work}: {100.0 * self.open_fraction:.0f} % open"
        elif at_work and not self.is_over:
            yield f"time is up: {self.share}"
        if self._apart:
            yield from self._who_is_missing(fleet, now_s)
        if self._apart or self.goal_fraction < 1.0:
            yield from (f"{vehicle.name} waits for {vehicle.waits}" for vehicle in fleet.vehicles if vehicle.waits)
            waits = self._waits(fleet)
            for since_s, names in deadlocks(waits, {vehicle.name for vehicle, _ in left(fleet)} - waits.keys()):
                self.milestones += [Milestone(since_s, DEADLOCK, name) for name in names]
                yield f"deadlock since {since_s:.0f} s: {', '.join(names)} wait for each other"
        if at_work:
            yield f"under way: {', '.join(at_work)}"

    def _waits(self, fleet: FleetView) -> dict[str, PeerWait]:
        """Return the waits for peers: help by able ones, at a rally point all late members, room by a near vehicle."""
        waits = {}
        survivors = [vehicle for vehicle in fleet.vehicles if vehicle.is_in_contact]
        for group in self._apart:
            members = self._members(survivors, group)
            late = frozenset(vehicle.name for vehicle in members if not self._has_come(vehicle, group))
            for vehicle in members if late else ():
                since_s = self._waits_s.get((vehicle.name, group.name))
                if since_s is not None and vehicle.name not in late and "Homing" in vehicle.performed:
                    waits[vehicle.name] = PeerWait(since_s, late, len(late))
        waiting = {vehicle.name: (vehicle, vehicle.waits) for vehicle in fleet.vehicles if vehicle.waits}
        for name, (vehicle, wait) in waiting.items():
            if wait.what == ROOM:
                near = frozenset(v.name for v in fleet.vehicles if distance(v.position_m, vehicle.position_m) <= NEAR_M)
                waits.setdefault(name, PeerWait(wait.since_s, near - {name}, 1))
                continue
            # Those that wait for the same are there: more must come, or they wait for each other.
            there = frozenset(peer for peer, (_, its) in waiting.items() if its.what == wait.what) - {name}
            n_more = wait.n_peers - len(there)
            come = PeerWait(wait.since_s, self.helpers(fleet) - there - {name}, n_more)
            waits[name] = come if n_more > 0 else PeerWait(wait.since_s, there, wait.n_peers)
        return waits

    def helpers(self, fleet: FleetView) -> frozenset[str]:
        """Return the remaining vehicles that are able to end a wait for help."""
        return frozenset(vehicle.name for vehicle, _ in left(fleet))

    @staticmethod
    def _at_work(fleet: FleetView) -> list[str]:
        at_work = []
        for vehicle in fleet.vehicles:
            doing = [name for name in vehicle.performed if name not in IN_ANY_CASE]
            if doing and vehicle.is_alive and not vehicle.waits:
                at_work.append(f"{vehicle.name} {' and '.join(doing)}")
        return at_work

    def _who_is_missing(self, fleet: FleetView, now_s: float) -> Iterator[str]:
        survivors = [vehicle for vehicle in fleet.vehicles if vehicle.is_in_contact]
        if not self._consulted:
            lacking = sorted(set(self._not_consulted(survivors)))
            to = f" to {', '.join(lacking)}" if lacking else ""
            yield f"not all assignments{to} had taken effect after {now_s:.0f} s"
            return
        names = ", ".join(group.name + self._what_it_lacks(survivors, group) for group in self._apart)
        yield f"not together after {now_s:.0f} s: {names}"
        if gone := [v.name for v in fleet.vehicles if not v.is_alive]:
            yield f"out of action: {', '.join(gone)}"

    def _what_it_lacks(self, survivors: Sequence[VehicleView], group: Group) -> str:
        if lacking := self._lacking(survivors, group):
            return f" (without {' and '.join(lacking)})"
        members = self._members(survivors, group)
        late = [vehicle.name for vehicle in members if not self._has_come(vehicle, group)]
        return f" (waits for {' and '.join(late)})" if 0 < len(late) < len(members) else ""

    @staticmethod
    def _have_planned(survivors: Sequence[VehicleView]) -> bool:
        return all(v.has_planned(group) for v in survivors for group in v.organisation.groups if v.leads(group))

    @staticmethod
    def _not_consulted(survivors: Sequence[VehicleView]) -> Iterator[str]:
        """Yield the vehicles on which assignments by vehicles in contact have not taken effect."""
        by_name = {vehicle.name: vehicle for vehicle in survivors}
        for vehicle in survivors:
            # An order to a vehicle out of contact cannot take effect, so the consultation ends without it.
            for a in vehicle.issued:
                if a.vehicle in by_name and not by_name[a.vehicle].organisation.plays(a.vehicle, a.group, a.role):
                    yield a.vehicle
            for objective in vehicle.issued_objectives:
                for holder in by_name.keys() & vehicle.organisation.members(objective.group, objective.role):
                    if objective not in by_name[holder].objectives_of(holder):
                        yield holder

    @staticmethod
    def _members(survivors: Sequence[VehicleView], group: Group) -> list[VehicleView]:
        return [vehicle for vehicle in survivors if vehicle.organisation.is_member(vehicle.name, group.name)]

    def _note_who_is_there(self, alive: Sequence[VehicleView], group: Group, now_s: float) -> None:
        (at_x_m, at_y_m), radius_m = self._rally_points_m[group.rally_point or ""], self._radius_m
        for vehicle in alive:
            x_m, y_m = vehicle.position_m
            dx_m, dy_m = x_m - at_x_m, y_m - at_y_m
            is_there = dx_m * dx_m + dy_m * dy_m <= radius_m * radius_m
            if not is_there and not self._waits_s:  # no arrival yet
                continue
            key = vehicle.name, group.name
            if not is_there:
                self._there_s.pop(key, None)
                if dx_m * dx_m + dy_m * dy_m > (radius_m + NEAR_M) * (radius_m + NEAR_M):
                    self._waits_s.pop(key, None)
                continue
            self._there_s.setdefault(key, now_s)
            self._waits_s.setdefault(key, now_s)
            if vehicle.has_met(group.name):
                self._has_met.add(key)

    def _has_come(self, vehicle: VehicleView, group: Group) -> bool:
        key = vehicle.name, group.name
        return key in self._there_s or key in self._has_met

    def _is_together(self, survivors: Sequence[VehicleView], group: Group) -> bool:
        for vehicle in survivors:  # usually the first is still under way
            if not self._has_come(vehicle, group) and vehicle.organisation.is_member(vehicle.name, group.name):
                return False
        members = self._members(survivors, group)
        if any(vehicle.leads(group.name) and vehicle.gives_out(group.name) for vehicle in members):
            return False
        return not self._lacking(survivors, group)

    def _is_overdue(self, survivors: Sequence[VehicleView], group: Group, now_s: float) -> bool:
        for vehicle in survivors:
            since_s = self._waits_s.get((vehicle.name, group.name), math.inf)
            if now_s - since_s >= self._deadline_s and vehicle.leads(group.name) and vehicle.has_met(group.name):
                return True
        return False

    @classmethod
    def _lacking(cls, survivors: Sequence[VehicleView], group: Group) -> list[str]:
        """Initial roles with too few holders although others, not resigned, are free to play them."""
        members = cls._members(survivors, group)
        # A vehicle without any role has resigned, unless no roles are assigned yet.
        at_work = [v for v in survivors if not members or v.organisation.roles_of(v.name)]
        founding = [role for role in group.roles if role.founding]
        names = {role.name for role in founding}
        idle = [v for v in at_work if names.isdisjoint(r.role for r in v.organisation.roles_of(v.name, group.name))]
        lacking = []
        for role in founding:
            if role.head:
                is_held = any(v.leads(group.name) for v in survivors)
                able = at_work
            else:
                n_holders = sum(v.organisation.plays(v.name, group.name, role.name) for v in survivors)
                is_held = n_holders >= role.minimum
                able = idle
            if not is_held and any(v.can_play(group.name, role.name) for v in able):
                lacking.append(role.name)
        return lacking


class JobTruth(MeetingTruth):
    """Referee of jobs: the goal is all jobs; a group gathers only after those of its roles are done.

    >>> from missions.runs.assembly import assemble
    >>> from missions.runs.setup import resolved
    >>> from missions.scenarios import load
    >>> truth: JobTruth = assemble(resolved(load("recovery-field")), 1).truth
    >>> truth.work, truth.open_fraction
    ('do', 1.0)
    """

    work = "do"
    ends_with_meeting = False
    """True if no vehicle leaves again once all groups have met."""

    def __init__(self, meeting: Meeting, objective: str, recorder: Recorder) -> None:
        super().__init__(meeting)
        self._objective = objective
        self._groups = tuple(meeting.groups.values())
        self._jobs: Mapping[str, Job] = meeting.jobs
        self._rows, self._faults = recorder.rows(JOBS.name), recorder.rows(FAULTS.name)
        self._noted: set[tuple[str, str]] = set()
        self._done: set[str] = set()
        self._says_impossible, self._items = meeting.says_impossible, recorder.items
        self._new_items = Unread(recorder.items)
        self._impossible: dict[str, float] = {}  # reported since, by job

    def watch(self, fleet: FleetView, now_s: float) -> None:
        if self._says_impossible:
            self._note_impossible(now_s)
        for vehicle in fleet.vehicles:
            for objective in vehicle.finished:
                if objective.name == self._objective:
                    self.note(vehicle.name, objective.argument, now_s)

    def _note_impossible(self, now_s: float) -> None:
        for _, origin, _, _, job, attribute, value, *_ in self._new_items:
            if attribute != IS_IMPOSSIBLE:
                continue
            if value != "true":
                self._impossible.pop(job, None)
            elif job not in self._impossible:
                self._impossible[job] = now_s
                self.milestones.append(Milestone(now_s, "impossible", origin))

    @property
    def is_given_up(self) -> bool:
        return bool(self._impossible) and self._jobs.keys() <= self._impossible.keys() | set(self.jobs_done)

    def _has_work(self, vehicle: VehicleView) -> bool:
        open_ = self._jobs.keys() - set(self.jobs_done)
        own = vehicle.objectives_of(vehicle.name)
        return any(o.name == self._objective and o.argument in open_ and o not in vehicle.finished for o in own)

    def note(self, vehicle: str, job: str, now_s: float) -> None:
        """Record a job done by a vehicle, once; also for jobs that are no objectives."""
        if (vehicle, job) not in self._noted:
            self._noted.add((vehicle, job))
            self._done.add(job)
            self._rows.append((now_s, vehicle, job))
            self.milestones.append(Milestone(now_s, "job_done", vehicle))

    @property
    def goal_fraction(self) -> float:
        jobs = {role.job for group in self._groups for role in group.roles if role.job is not None} | self._jobs.keys()
        return len(jobs.intersection(self.jobs_done)) / len(jobs) if jobs else super().goal_fraction

    @property
    def is_over(self) -> bool:
        have_met = self._n_meetings > 0 and not self._apart and not self._is_awaited
        return super().is_over or (have_met and (self.ends_with_meeting or self._done.issuperset(self._jobs)))

    @property
    def jobs_as_they_are(self) -> Mapping[str, Job]:
        """All jobs by name; missions override it if true demands differ from planned ones."""
        return self._jobs

    @property
    def jobs_done(self) -> Collection[str]:
        """Jobs done, as vehicles report; missions with a ground truth of jobs override it."""
        return self._done

    def reachable_fraction(self, fleet: FleetView) -> float:
        return reachable_by_jobs(self.goal_fraction, self.jobs_as_they_are, self._groups, fleet, self.jobs_done)

    def out_of_reach(self, fleet: FleetView) -> Sequence[str]:
        within = within_reach(self.jobs_as_they_are, self._groups, fleet, self.jobs_done)
        return [name for name in self._jobs if name not in within]

    def is_worked_off(self, group: Group) -> bool:
        return not self._undone(group)

    def reasons(self, fleet: FleetView, now_s: float) -> Iterator[str]:
        reasons = list(super().reasons(fleet, now_s))
        yield from reasons
        undone = [job for group in self._groups for job in self._undone(group)]
        if undone and (reasons or self.goal_fraction < 1.0):  # all may have met after a false report
            yield f"jobs not done: {', '.join(undone)}"
            given_up = {
                job: detail
                for _, _, kind, detail in self._faults
                for job in undone
                if kind == CANNOT and (detail.startswith(f"{job}:") or f"({job})" in detail)
            }
            yield from (f"given up: {detail}" for detail in given_up.values())
        for job, at_s in self._impossible.items():
            if job not in self.jobs_done:
                yield f"{job} declared impossible at {at_s:.0f} s"
        claimed = ", ".join(sorted(self._done.difference(self.jobs_done)))
        if claimed and self.goal_fraction < 1.0:
            yield f"reported as done, but not done: {claimed}"

    def _undone(self, group: Group) -> list[str]:
        return [role.job for role in group.roles if role.job is not None and role.job not in self._done]


# Results ----------------------------------------------------------------------------------------


def done_s(run: MeasuredRun) -> dict[str, float]:
    """Time (s) of the first completion of each job."""
    # Reversed, so that the first of several completions is kept.
    return {job: time_s for time_s, _, job in reversed(run.recorder.rows(JOBS.name))}


def first_s(results: RunResults) -> dict[str, float]:
    """Return ``done_s`` from the tables of a results folder."""
    return {row["job"]: row["time_s"] for row in reversed(results.rows(JOBS.name))}


def mean_of_all_s(times_s: Collection[float], n_all: int, run: MeasuredRun) -> float:
    """Mean time (s) over ``n_all``; undone items count with the mission's duration."""
    return (math.fsum(times_s) + (n_all - len(times_s)) * run.scenario.scenario.duration_s) / n_all


def n_stated(run: MeasuredRun, attribute: str) -> int:
    """Number of statements about an attribute."""
    return sum(row[5] == attribute for row in run.recorder.rows("items"))
