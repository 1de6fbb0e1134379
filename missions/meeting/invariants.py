"""What every run keeps that ends with a meeting: who is said to have met was there.

See ``stress.invariants.seam`` for what an invariant is; only whoever tests asks.
"""

from __future__ import annotations

from typing import Any

from exchange.arithmetic import length
from missions.fault import Danger

ROUNDING_M = 1e-6


class TrueMeeting:
    """Where a group counts as gathered, each member has been at the rally point by then, or is named as missing.

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
        for met in (one for one in run.milestones if one.name == "gathered"):
            x_m, y_m = meeting.rally_points_m[meeting.groups[met.group].rally_point]
            radius_m = meeting.arrival_radius_m + ROUNDING_M
            known = {one.vehicle for one in run.milestones if (one.name, one.group) == ("missed_meeting", met.group)}
            for time_s, vehicle, at_x_m, at_y_m, *_ in run.recorder.trajectories:
                if time_s <= met.time_s + ROUNDING_M and length(at_x_m - x_m, at_y_m - y_m) <= radius_m:
                    known.add(vehicle)
            for vehicle in scene.fleet.vehicles:
                if vehicle.name not in known and vehicle.social.organisation.is_member(vehicle.name, met.group):
                    return f"{met.group} has gathered at {met.time_s:g} s; {vehicle.name} was not at its rally point"
        return None
