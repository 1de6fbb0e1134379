"""What every run keeps that ends with a meeting: who is said to have met was there.

See ``stress.invariants.seam`` for what an invariant is; only whoever tests asks.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from exchange.arithmetic import length
from missions.fault import Danger

ROUNDING_M = ROUNDING_S = 1e-6


class TrueMeeting:
    """Where a group counts as gathered, each member has been at the rally point by then, or is named as missing.

    A member is who had a role of the group then, as it saw itself; who got one later came to a group that had met.
    Under faults that keep a vehicle out of contact or take it away nobody waits for it.
    """

    name = "meetings"
    moment = "end"
    not_under = frozenset({Danger.PRESENCE, Danger.HEARING, Danger.VOICE, Danger.ENERGY})

    def broken(self, scene: Any) -> str | None:
        """Compare milestones with the tracks."""
        run, meeting = scene.finished, scene.setup.mission.meeting
        if run is None:
            return None
        for met in (milestone for milestone in run.milestones if milestone.name == "gathered"):
            x_m, y_m = meeting.rally_points_m[meeting.groups[met.group].rally_point]
            radius_m = meeting.arrival_radius_m + ROUNDING_M
            known = {
                milestone.vehicle
                for milestone in run.milestones
                if (milestone.name, milestone.group) == ("missed_meeting", met.group)
            }
            for time_s, vehicle, at_x_m, at_y_m, *_ in run.recorder.trajectories:
                if time_s <= met.time_s + ROUNDING_S and length(at_x_m - x_m, at_y_m - y_m) <= radius_m:
                    known.add(vehicle)
            for name in sorted(_members(run.recorder.roles, met.group, met.time_s) - known):
                return f"{met.group} has gathered at {met.time_s:g} s; {name} was not at its rally point"
        return None


def _members(roles: Iterable[tuple[Any, ...]], group: str, until_s: float) -> set[str]:
    """Vehicles that have a role of a group at a time, by the rows of the table of roles."""
    holds: set[tuple[str, str]] = set()
    for time_s, vehicle, of, role, event in roles:
        if of == group and time_s <= until_s + ROUNDING_S:
            if event == "assigned":
                holds.add((vehicle, role))
            elif event == "left":
                holds.discard((vehicle, role))
    return {vehicle for vehicle, _ in holds}
