"""Ground truth of the mission: charted tiles, recovered object, choreography."""

from __future__ import annotations

from collections.abc import Collection

from missions.meeting.meeting import Meeting
from missions.meeting.truth import JobTruth
from missions.trident.choreography import Monitor
from missions.trident.scenario import TridentScenario
from missions.trident.services import ATTEMPTS, CHARTED
from missions.trident.site import TARGET, Site, Tile
from missions.trident.tasks import WORKING
from remoras.mission import FleetView, Milestone
from remoras.recorder import Recorder
from remoras.truth import within_reach

RECOVERY_SHARE = 0.5
"""Weight of the recovery in the goal; the rest is the map."""


class TridentTruth(JobTruth):
    """Referee of a run."""

    def __init__(self, meeting: Meeting, scenario: TridentScenario, recorder: Recorder, site: Site) -> None:
        super().__init__(meeting, WORKING, recorder)
        self._goal = scenario.mission.goal
        self._recovery = scenario.recovery.name
        self._site = site
        self._n_tiles = len(site.numbers)
        self._monitor = Monitor(scenario.choreography, recorder)
        self._charted_rows, self._attempt_rows = recorder.rows(CHARTED.name), recorder.rows(ATTEMPTS.name)
        self._items = recorder.items
        self._n_charted = self._n_attempts = self._n_items = 0
        self._charted: set[Tile] = set()
        self.is_recovered = False
        self._reached: tuple[tuple[object, ...], float] | None = None  # cached reachable fraction with its inputs

    def observe(self, fleet: FleetView, now_s: float) -> bool:
        """Record events; return True once the goal is reached and the group has gathered."""
        self._take_note(now_s)
        return super().observe(fleet, now_s)

    def _take_note(self, now_s: float) -> None:
        charted, attempts, items = self._charted_rows, self._attempt_rows, self._items
        n_charted, n_attempts = len(charted), len(attempts)
        n_items = len(items)
        for _, _, column, row in charted[self._n_charted :]:
            self._charted.add((column, row))
        for time_s, vehicle, _, does, of, _, succeeded in attempts[self._n_attempts :]:
            if succeeded:
                self._note_success(time_s, vehicle, does == "handle", of == TARGET)
        for _, origin, _, recorded_s, subject, attribute, *_ in items[self._n_items :]:
            if attribute == "chosen":
                self.milestones.append(Milestone(recorded_s, "chosen", origin))
            elif attribute == "surveyedBy":  # a survey on request is no objective
                self.note(origin, subject, now_s)
        self._n_charted, self._n_attempts, self._n_items = n_charted, n_attempts, n_items
        self._monitor.look(now_s)

    def _note_success(self, time_s: float, vehicle: str, is_handled: bool, is_target: bool) -> None:
        what = ("recovered" if is_target else "mistaken") if is_handled else "held"
        self.milestones.append(Milestone(time_s, what, vehicle))
        self.is_recovered = self.is_recovered or (is_handled and is_target)

    @property
    def charted_fraction(self) -> float:
        """Share of all tiles truly charted."""
        return len(self._charted) / self._n_tiles if self._n_tiles else 1.0

    @property
    def goal_fraction(self) -> float:
        """Weighted share of the requested map and of the recovery."""
        return self._share(self.charted_fraction, self.is_recovered)

    def _share(self, charted: float, is_recovered: bool) -> float:
        mapping = min(1.0, charted / self._goal)
        return (1.0 - RECOVERY_SHARE) * mapping + RECOVERY_SHARE * is_recovered

    @property
    def jobs_done(self) -> Collection[str]:
        """Blocks reported as surveyed, and the recovery once it is real."""
        return {*(self._done - {self._recovery}), *((self._recovery,) if self.is_recovered else ())}

    def reachable_fraction(self, fleet: FleetView) -> float:
        """Share of the goal that the remaining vehicles can still reach."""
        of = tuple([v.able_data for v in fleet.vehicles]), len(self._charted), len(self._done), self.is_recovered
        if self._reached is None or self._reached[0] != of:
            self._reached = of, self._reachable_fraction(fleet)
        return self._reached[1]

    def _reachable_fraction(self, fleet: FleetView) -> float:
        jobs = self._jobs
        within = within_reach(jobs, self._groups, fleet, self.jobs_done)
        able = within_reach({name: jobs[name] for name in jobs if name != self._recovery}, self._groups, fleet, ())
        n_within = sum(block in able for tile, (block, _) in self._site.numbers.items() if tile not in self._charted)
        charted = (len(self._charted) + n_within) / self._n_tiles if self._n_tiles else 1.0
        return self._share(charted, self._recovery in within)

    def close(self, fleet: FleetView, now_s: float) -> str:
        """Return the reason of failure."""
        self._monitor.look(now_s)
        reason = super().close(fleet, now_s)
        missing = [] if self.is_recovered else ["the target is not recovered"]
        if self.charted_fraction < self._goal:
            missing.append(f"{self.charted_fraction:.0%} of the site charted of {self._goal:.0%}")
        return "; ".join(text for text in (reason, *missing) if text)
