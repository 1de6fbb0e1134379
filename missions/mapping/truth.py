"""Truth of the mapping and rendezvous mission: notes when vehicles finish or give up, beside what every meeting has."""

from __future__ import annotations

from missions.meeting.meeting import Meeting
from missions.meeting.truth import MeetingTruth
from remoras.activities import Objective
from remoras.mission import FleetView, Milestone


class MappingTruth(MeetingTruth):
    """Watches the run: when consultation ends, who finishes or gives up, which group is together."""

    def __init__(self, meeting: Meeting) -> None:
        super().__init__(meeting)
        self._last_performed: dict[int, tuple[str, ...]] = {}
        self._exploring: dict[str, bool] = {}
        self._stopped: dict[str, Milestone] = {}
        self._finished: set[Objective] = set()

    def close(self, fleet: FleetView, now_s: float) -> str:
        """Add who gave up, and say who is missing where."""
        self.milestones += self._stopped.values()
        self.milestones.sort(key=lambda milestone: milestone.time_s)
        return super().close(fleet, now_s)

    def watch(self, fleet: FleetView, now_s: float) -> None:
        """Note who finishes an area, and who turns away from one."""
        for number, vehicle in enumerate(fleet.vehicles):
            performed = vehicle.performed
            if performed is self._last_performed.get(number):
                continue
            self._last_performed[number] = performed
            exploring = "ZigzagExploring" in performed
            if exploring:
                self._stopped.pop(vehicle.name, None)
            elif self._exploring.get(vehicle.name):
                self._stopped[vehicle.name] = Milestone(now_s, "mapping_stopped", vehicle.name)
            self._exploring[vehicle.name] = exploring
            for objective in vehicle.finished:
                if objective.name == "Exploring" and objective not in self._finished:
                    self._finished.add(objective)
                    self._stopped.pop(vehicle.name, None)
                    self.milestones.append(Milestone(now_s, "mapping_done", vehicle.name))
