"""Truth of missions that end with a meeting: watches a run from outside and notes its milestones.

A group that was given its mission from the start supervises the others: it counts as gathered only when they have.
"""

from __future__ import annotations

import math

from missions.meeting.meeting import Meeting
from remoras.mission import FleetView, Milestone
from remoras.organisation import Group
from remoras.recorder import TIME, VEHICLE, Column, Recorder, Table

JOBS = Table("jobs", (TIME, VEHICLE, Column("job", "str")))
"""When a vehicle had done a job; a job that two vehicles do has two rows."""


class MeetingTruth:
    """Watches the run: when consultation ends and which group is together; a mission adds what it does at work.

    Args:
        meeting: of the mission.
    """

    def __init__(self, meeting: Meeting) -> None:
        self.milestones: list[Milestone] = []
        self._rally_points_m = meeting.rally_points_m
        self._radius_m = meeting.arrival_radius_m
        self._consulted = False
        together_first = sorted(meeting.groups.values(), key=lambda group: group.mission is not None)
        self._apart = [group for group in together_first if group.rally_point is not None]
        self._n_meetings = len(self._apart)

    @property
    def goal_fraction(self) -> float:
        """Share of the groups that have met; a mission with work of its own says what share of that is done."""
        return 1.0 if not self._n_meetings else 1.0 - len(self._apart) / self._n_meetings

    def watch(self, fleet: FleetView, now_s: float) -> None:
        """Note what the mission wants to know; called after each tick and each round once all is agreed."""

    def is_worked_off(self, group: Group) -> bool:
        """True if the group may count as gathered as far as its work is concerned; a mission says what that takes."""
        return True

    def observe(self, fleet: FleetView, now_s: float) -> bool:
        """Note what has happened; True once the last group is together."""
        if not self._consulted:
            if not self._is_consulted(fleet):
                return False
            self._consulted = True
            self.milestones.append(Milestone(now_s, "consultation_done"))
        self.watch(fleet, now_s)
        for group in list(self._apart):
            waits_for_others = group.mission is not None and self._apart[0].mission is None
            if not waits_for_others and self.is_worked_off(group) and self._is_together(fleet, group):
                self._apart.remove(group)
                self.milestones.append(Milestone(now_s, "gathered", group=group.name))
        if self._apart:
            return False
        self.milestones.append(Milestone(now_s, "mission_complete"))
        return True

    def close(self, fleet: FleetView, now_s: float) -> str:
        """Say who is missing where."""
        if not self._consulted:
            return f"consultation had not ended after {now_s:.0f} s"
        if self._apart:
            names = ", ".join(
                f"{group.name} (without {' and '.join(lacking)})"
                if (lacking := self._lacking(fleet, group))
                else group.name
                for group in self._apart
            )
            exhausted = [v.name for v in fleet.vehicles if not v.is_alive]
            why = f"; battery exhausted: {', '.join(exhausted)}" if exhausted else ""
            return f"not together after {now_s:.0f} s: {names}{why}"
        return ""

    @staticmethod
    def _is_consulted(fleet: FleetView) -> bool:
        """True once every mission is planned, and everything assigned counts where it was meant to."""
        by_name = {vehicle.name: vehicle for vehicle in fleet.vehicles}
        for vehicle in fleet.vehicles:
            for group in vehicle.organisation.groups:
                if vehicle.leads(group) and not vehicle.has_planned(group):
                    return False
            for a in vehicle.issued:
                if not by_name[a.vehicle].organisation.plays(a.vehicle, a.group, a.role):
                    return False
            for objective in vehicle.issued_objectives:
                for holder in vehicle.organisation.members(objective.group, objective.role):
                    if objective not in by_name[holder].objectives_of(holder):
                        return False
        return True

    def _is_together(self, fleet: FleetView, group: Group) -> bool:
        """True if all members are at the rally point, no work is left to give out, and founding roles are filled."""
        x_m, y_m = self._rally_points_m[group.rally_point or ""]
        for vehicle in fleet.vehicles:
            if vehicle.organisation.is_member(vehicle.name, group.name):
                own_x_m, own_y_m = vehicle.position_m
                if math.hypot(own_x_m - x_m, own_y_m - y_m) > self._radius_m:
                    return False
                if vehicle.leads(group.name) and vehicle.gives_out(group.name):
                    return False
        return not self._lacking(fleet, group)

    @staticmethod
    def _lacking(fleet: FleetView, group: Group) -> list[str]:
        """Founding roles that too few vehicles still play, as each vehicle sees itself."""
        return [
            role.name
            for role in group.roles
            if role.founding
            and sum(v.organisation.plays(v.name, group.name, role.name) for v in fleet.vehicles if v.is_alive)
            < role.minimum
        ]


class JobTruth(MeetingTruth):
    """Notes who has done which job when, in the table ``jobs`` and as milestones ``job_done``.

    No group counts as gathered before all jobs of its roles are done, wherever its vehicles are.

    Args:
        meeting: of the mission.
        objective: of roles with a job.
        recorder: takes the rows.
    """

    def __init__(self, meeting: Meeting, objective: str, recorder: Recorder) -> None:
        super().__init__(meeting)
        self._objective = objective
        self._groups = tuple(meeting.groups.values())
        self._rows = recorder.rows(JOBS.name)
        self._noted: set[tuple[str, str]] = set()
        self._done: set[str] = set()

    def watch(self, fleet: FleetView, now_s: float) -> None:
        """Note the jobs done since the last look."""
        for vehicle in fleet.vehicles:
            for objective in vehicle.finished:
                done = vehicle.name, objective.argument
                if objective.name == self._objective and done not in self._noted:
                    self._noted.add(done)
                    self._done.add(objective.argument)
                    self._rows.append((now_s, *done))
                    self.milestones.append(Milestone(now_s, "job_done", vehicle.name))

    @property
    def goal_fraction(self) -> float:
        """Share of all jobs of roles that are done."""
        jobs = {role.job for group in self._groups for role in group.roles if role.job is not None}
        return len(self._done & jobs) / len(jobs) if jobs else 1.0

    def is_worked_off(self, group: Group) -> bool:
        """True once all jobs of the group's roles are done."""
        return not self._undone(group)

    def close(self, fleet: FleetView, now_s: float) -> str:
        """Say who is missing where, and which jobs are not done."""
        reason = super().close(fleet, now_s)
        undone = [job for group in self._groups for job in self._undone(group)]
        return f"{reason}; jobs not done: {', '.join(undone)}" if reason and undone else reason

    def _undone(self, group: Group) -> list[str]:
        return [role.job for role in group.roles if role.job is not None and role.job not in self._done]
