"""Traits: what of a scenario bears on which strategy does best, as numbers that follow from its text alone.

No mission is run for them. They come of the resolved scenario: vehicles, jobs, slots, the losses of its channel, and
what it says of faults. Those whose ratios matter are logarithms to base 2 where they are compared.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import permutations

from exchange.acoustics.link import Transmission
from exchange.acoustics.models import GilbertElliottChannel
from exchange.arithmetic import distance, log2
from missions.errors import ConfigurationError, ConfigurationFault
from missions.runs.setup import Setup
from missions.scenarios.faults import DeclaredFault
from remoras.database import VehicleData
from remoras.faults import ANY
from remoras.known import NOTHING_KNOWN
from remoras.work import Outlook, Point, jobs_left

LEAST_HEARD = 0.01
"""Share of the packets heard below which the age of news is not told apart."""


@dataclass(frozen=True)
class Trait:
    """One number of a scenario.

    Attributes:
        name, unit, text: what it is.
        group: what it is about: fleet, work, sea, unforeseen.
        of: the number of a scenario.
        is_ratio: compared by its logarithm.
        decides: instances are compared by it; by the others only what lies outside of all instances is told.
    """

    name: str
    unit: str
    text: str
    group: str
    of: Callable[[Beforehand], float]
    is_ratio: bool = False
    decides: bool = False

    def compared(self, value: float) -> float:
        """The value as it is compared."""
        return log2(value) if self.is_ratio else value


class Beforehand:
    """What is known of a scenario before any run.

    Args:
        setup: the scenario resolved.

    Raises:
        ConfigurationError: it has no jobs that a strategy could divide, or nobody able to do them.
    """

    def __init__(self, setup: Setup) -> None:
        self.setup = setup
        left, done = jobs_left(setup.mission.jobs, NOTHING_KNOWN)
        self.jobs = [job for name, job in sorted(left.items()) if name in self._seats and name not in done]
        able = [[data for data in setup.database.values() if job.is_able(data)] for job in self.jobs]
        if not self.jobs or not all(able):
            about = setup.scenario.scenario
            allowed = "advice is about jobs that a group divides, and vehicles able to do them, as in mapping-patches"
            raise ConfigurationError(
                about.name, [ConfigurationFault("scenario.mission", f'"{about.mission}"', allowed)]
            )
        self.workers = [data for data in setup.database.values() if any(data in one for one in able)]

    @cached_property
    def _seats(self) -> dict[str, float]:
        """Vehicles for which each job has room; infinite where nothing limits them."""
        return {
            role.job: math.inf if role.maximum is None else float(role.maximum)
            for group in self.setup.agreement.groups
            for role in group.roles
            if role.job is not None
        }

    @cached_property
    def job_times_s(self) -> list[list[float]]:
        """Time that each job takes each vehicle that is able, which is there already (s)."""
        return [
            [after.free_s for data in self.workers if (after := job.after(Outlook(0.0, job.place_m), data)) is not None]
            for job in self.jobs
        ]

    @cached_property
    def job_s(self) -> float:
        """Mean time of a job (s)."""
        return _mean([_mean(times) for times in self.job_times_s])

    @cached_property
    def way_s(self) -> float:
        """Mean time from the start of a vehicle to a job (s)."""
        return _mean([self._way_s(data, job.place_m) for data in self.workers for job in self.jobs])

    @staticmethod
    def _way_s(data: VehicleData, place_m: Point) -> float:
        return distance(data.start_m, place_m) / data.transit_speed_mps

    @cached_property
    def about_s(self) -> float:
        """What the mission takes at least, roughly: ways there and back, and all work divided evenly (s)."""
        n_busy = min(len(self.workers), sum(min(seats, len(self.workers)) for seats in self._seats.values()))
        return 2.0 * self.way_s + self.job_s * len(self.jobs) / n_busy

    @cached_property
    def room(self) -> float:
        """Mean number of vehicles that a job has room for, at most all that work."""
        return _mean([min(self._seats[job.name], float(len(self.workers))) for job in self.jobs])

    @cached_property
    def speed_ratio(self) -> float:
        """The longest over the shortest time that a job takes the vehicles, in the mean over the jobs."""
        return _mean([max(times) / min(times) for times in self.job_times_s])

    @cached_property
    def unlike_jobs(self) -> float:
        """Standard deviation of the times of the jobs over their mean."""
        times = [_mean(times) for times in self.job_times_s]
        return _deviation(times) / self.job_s

    @property
    def speed_spread(self) -> float:
        """Share by which vehicles may be slower or faster than their data."""
        return float(self.setup.scenario.of_feature("uncertainty").speed_spread)

    @property
    def loss(self) -> float:
        """Share of the packets that are lost, in the mean over all links."""
        return self.setup.scenario.channel.mean_per(self.setup.deployment)

    @property
    def loss_spread(self) -> float:
        """Standard deviation of the loss over the links."""
        setup, channel = self.setup, self.setup.scenario.channel
        if isinstance(channel.settings(), GilbertElliottChannel):
            return 0.0
        links = channel.link_model(setup.deployment, 0)
        places = [job.place_m for job in self.jobs]
        range_m = _mean([distance(one, other) for one in places for other in places])
        losses = [
            links.p_loss(Transmission(sender, sender, 0.0, setup.modem.payload_bits), receiver, range_m)
            for sender, receiver in permutations(range(len(setup.database)), 2)
        ]
        return _deviation(losses)

    @property
    def burst_slots(self) -> float:
        """Slots for which a bad link stays bad, on average; 1 where losses are independent."""
        channel = self.setup.scenario.channel.settings()
        if not isinstance(channel, GilbertElliottChannel):
            return 1.0
        return 1.0 / max(channel.p_bad_to_good, 1e-6)

    @property
    def news_s(self) -> float:
        """Age of the latest news of a peer (s): a TDMA frame over the share of the packets that are heard."""
        return self.setup.schedule.frame_s / max(1.0 - self.loss, LEAST_HEARD)

    @property
    def n_found(self) -> float:
        """Jobs that nobody knows of before the mission."""
        left, _ = jobs_left(self.setup.mission.jobs, NOTHING_KNOWN)
        return float(len(self.setup.mission.jobs) - len(left))

    def lost(self) -> Iterator[tuple[DeclaredFault, float]]:
        """Faults by which a vehicle ceases to work for good or for long, each with its mean time (s)."""
        for fault in self.setup.scenario.fault:
            if fault.DISABLES:
                span = fault.span_s
                yield fault, self.about_s / 2.0 if span is None else (span[0] + span[1]) / 2.0

    @property
    def head_lost(self) -> float:
        """1 if who was agreed to lead a group may be lost, else 0."""
        return float(any(fault.vehicle.startswith("head of") for fault, _ in self.lost()))

    @property
    def work_lost(self) -> float:
        """Share of the fleet's time for work that is gone with vehicles that are lost, as far as they would work."""
        names = {data.name for data in self.workers}
        gone = [
            max(0.0, 1.0 - at_s / self.about_s)
            for fault, at_s in self.lost()
            if fault.vehicle in names or fault.vehicle == ANY or fault.vehicle.startswith("head of")
        ]
        return min(1.0, math.fsum(gone) / len(self.workers))

    @property
    def n_lost(self) -> float:
        """Vehicles that may be lost."""
        return float(sum(1 for _ in self.lost()))


RATIO: dict[str, bool] = {"is_ratio": True}
DECIDES: dict[str, bool] = {"decides": True}
TRAITS = (
    Trait("news_s", "s", "age of news: frame over the share of packets heard", "sea", lambda k: k.news_s, True, True),
    Trait("lost", "vehicles", "vehicles that may be lost", "unforeseen", lambda k: k.n_lost, **DECIDES),
    Trait("room", "vehicles", "vehicles that a job has room for", "work", lambda k: k.room, True, True),
    Trait("workers", "vehicles", "vehicles able to do a job", "fleet", lambda k: float(len(k.workers)), **RATIO),
    Trait("vehicles", "vehicles", "vehicles that send", "fleet", lambda k: float(len(k.setup.database)), **RATIO),
    Trait("speed_ratio", "1", "longest over shortest time of the same job", "fleet", lambda k: k.speed_ratio, **RATIO),
    Trait("speed_spread", "1", "share by which speeds may differ", "fleet", lambda k: k.speed_spread),
    Trait("jobs", "jobs", "jobs that are known", "work", lambda k: float(len(k.jobs)), **RATIO),
    Trait("job_s", "s", "mean time of a job", "work", lambda k: k.job_s, **RATIO),
    Trait("unlike_jobs", "1", "deviation of the jobs' times over their mean", "work", lambda k: k.unlike_jobs),
    Trait("way_s", "s", "mean time from a start to a job", "work", lambda k: k.way_s, **RATIO),
    Trait("frame_s", "s", "TDMA frame", "sea", lambda k: k.setup.schedule.frame_s, **RATIO),
    Trait("payload", "bit", "most of a packet", "sea", lambda k: float(k.setup.modem.payload_bits), **RATIO),
    Trait("loss", "1", "mean share of packets lost", "sea", lambda k: k.loss),
    Trait("loss_spread", "1", "deviation of the loss over the links", "sea", lambda k: k.loss_spread),
    Trait("burst_slots", "slots", "mean length of bursts", "sea", lambda k: k.burst_slots, **RATIO),
    Trait("found", "jobs", "jobs that are found at sea", "unforeseen", lambda k: k.n_found),
    Trait("head_lost", "1", "1 if a head may be lost", "unforeseen", lambda k: k.head_lost),
    Trait("work_lost", "1", "share of time for work gone with those lost", "unforeseen", lambda k: k.work_lost),
)
"""All traits, those that decide first."""
CHOSEN_ON = 65
"""Which traits decide was chosen, by leaving instances out, on those before this number; all others had no part."""
DECIDING = tuple(trait for trait in TRAITS if trait.decides)
GROUPS = tuple(dict.fromkeys(trait.group for trait in DECIDING))
"""What those are about that decide."""


def traits_of(setup: Setup) -> tuple[float, ...]:
    """The traits of a scenario, in their order and units, to five digits.

    Raises:
        ConfigurationError: the mission has no jobs that a strategy could divide.
    """
    known = Beforehand(setup)
    return tuple(float(f"{round(trait.of(known), 6):.5g}") for trait in TRAITS)


def _mean(values: Sequence[float]) -> float:
    return math.fsum(values) / len(values)


def _deviation(values: Sequence[float]) -> float:
    middle = _mean(values)
    return math.sqrt(_mean([(value - middle) * (value - middle) for value in values]))
