"""Feasibility estimates before a mission: time and energy that the jobs of a fleet take.

Jobs are allocated by list scheduling (Graham 1969): the longest first, each to the vehicle that would complete it
first. A vehicle travels in transit, works at survey speed, waits at hotel load until the last job is done, and returns
home with a margin. Ways to a rendezvous are ignored. The estimate is no bound: strategies may allocate better, share
jobs or lose time. It therefore gives a warning, not a fault.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from exchange.arithmetic import distance
from missions.runs.setup import Setup
from remoras.beliefs import NOTHING_KNOWN
from remoras.database import HOME_MARGIN, VehicleData
from remoras.work import Job, Outlook, jobs_left

UNUSUAL_SHARE = 0.01
"""Least usual share of a modem's range; a lower one may be in kilometres."""


@dataclass(frozen=True)
class Caution:
    """Warning: ``text`` compares the requirement of a valid scenario with the supply."""

    key: str
    text: str

    def __str__(self) -> str:
        return f"{self.key}: {self.text}"


@dataclass
class _Part:
    data: VehicleData
    outlook: Outlook
    jobs: list[str] = field(default_factory=list)
    way_m: float = 0.0
    work_s: float = 0.0

    def take(self, job: Job, then: Outlook) -> None:
        all_s = then.free_s - self.outlook.free_s
        way_m = min(distance(self.outlook.position_m, job.place_m), all_s * self.data.transit_speed_mps)
        self.jobs.append(job.name)
        self.way_m += way_m
        self.work_s += all_s - way_m / self.data.transit_speed_mps
        self.outlook = then

    @property
    def home_m(self) -> float:
        return distance(self.outlook.position_m, self.data.start_m)

    def energy_j(self, end_s: float) -> float:
        data = self.data
        survey_w, transit_w = data.power_w(data.survey_speed_mps), data.power_w(data.transit_speed_mps)
        moving_j = transit_w * self.way_m / data.transit_speed_mps
        home_j = survey_w * HOME_MARGIN * self.home_m / data.survey_speed_mps
        return moving_j + survey_w * self.work_s + data.hotel_w * max(0.0, end_s - self.outlook.free_s) + home_j


def cautions(setup: Setup) -> Iterator[Caution]:
    """Yield a warning for each vehicle or job that exceeds energy or mission duration, and for too short a range."""
    range_m = setup.scenario.communication.range_m
    if range_m < UNUSUAL_SHARE * setup.modem.range_m:
        yield Caution(
            "communication.range_m", f"is {range_m:g} m, of modem {setup.modem.name} {setup.modem.range_m:g} m"
        )
    duration_s = setup.scenario.scenario.duration_s
    jobs, _ = jobs_left(setup.mission.jobs, NOTHING_KNOWN)
    idle = _parts(setup)
    alone = {name: soonest for name, job in jobs.items() if (soonest := _soonest(setup, job, idle)) is not None}
    free_s = {name: after.free_s for name, (_, after) in alone.items()}
    for name, (vehicle, _) in alone.items():
        if free_s[name] > duration_s:
            yield Caution(
                f"job {name}",
                f"takes {vehicle} about {free_s[name]:.0f} s with the way there, and no other vehicle less; "
                f"scenario.duration_s is {duration_s:g}",
            )
    parts = _divided(setup, [jobs[name] for name in sorted(alone, key=lambda name: (-free_s[name], name))])
    last_s = max((part.outlook.free_s for part in parts), default=0.0)
    end_s = min(duration_s, last_s) if jobs else duration_s
    # If a single job exceeds the duration, its own warning says more.
    if last_s > duration_s and all(own_s <= duration_s for own_s in free_s.values()):
        late = max(parts, key=lambda part: part.outlook.free_s)
        yield Caution(
            "scenario.duration_s",
            f"is {duration_s:g}; all {len(alone)} jobs take about {last_s:.0f} s, {late.data.name} longest "
            f"({late.way_m:.0f} m of way, {late.work_s:.0f} s of work)",
        )
    for part in parts:
        if (needed_j := part.energy_j(end_s)) > part.data.energy_j:
            yield _short_of_energy(part, needed_j, end_s)


def _soonest(setup: Setup, job: Job, parts: Mapping[str, _Part]) -> tuple[str, Outlook] | None:
    """Vehicle that would complete a job first after its part, of equals the lower node, with its outlook then."""
    ends = [
        (after.free_s, data.node, data.name, after)
        for data in _able(setup, job)
        if (after := job.after(parts[data.name].outlook, data)) is not None
    ]
    return min(ends)[2:] if ends else None


def _able(setup: Setup, job: Job) -> list[VehicleData]:
    roles = [
        (group.name, role.name) for group in setup.agreement.groups for role in group.roles if role.job == job.name
    ]
    return [
        data
        for data in setup.database.values()
        if any(data.can_play(group, role) for group, role in roles) and job.is_able(data)
    ]


def _parts(setup: Setup) -> dict[str, _Part]:
    return {name: _Part(data, Outlook(0.0, data.start_m)) for name, data in setup.database.items()}


def _divided(setup: Setup, jobs: Iterable[Job]) -> list[_Part]:
    parts = _parts(setup)
    for job in jobs:
        if (soonest := _soonest(setup, job, parts)) is not None:
            name, after = soonest
            parts[name].take(job, after)
    return list(parts.values())


def _short_of_energy(part: _Part, needed_j: float, end_s: float) -> Caution:
    data = part.data
    survey_w = data.power_w(data.survey_speed_mps)
    terms = [f"{max(0.0, end_s - part.outlook.free_s):.0f} s of waiting at {data.hotel_w:g} W"]
    if part.jobs:
        work = f"{part.work_s:.0f} s of work at {survey_w:.0f} W ({', '.join(part.jobs)})"
        terms = [f"{part.way_m:.0f} m of way", work, *terms, f"{part.home_m:.0f} m home"]
    range_m = data.energy_j / survey_w * data.survey_speed_mps
    return Caution(
        f"vehicle.{data.name}.energy_j",
        f"is {data.energy_j:g}, for {range_m:.0f} m at survey speed; its part takes about {needed_j:.0f} J: "
        f"{', '.join(terms)}",
    )
