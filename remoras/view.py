"""Read-only views of vehicles and fleet for the referee of a mission, its truth.

Holders of jobs: how far the vehicles of a fleet agree with those who hold them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple, NoReturn

from remoras.activities import Objective, Wait
from remoras.database import VehicleData
from remoras.executive.layer import Decision
from remoras.organisation import Organisation, RoleAssignment
from remoras.work import Point

if TYPE_CHECKING:
    from remoras.functional.layer import FunctionalLayer
    from remoras.social.layer import SocialLayer
    from remoras.vehicle import Vehicle


class ReadOnlyVehicle:
    """A vehicle as a truth sees it: a ``remoras.mission.VehicleView``; nothing of it can be set.

    Attributes:
        name: of the vehicle.
    """

    name: str
    _vehicle: Vehicle
    _social: SocialLayer
    _functional: FunctionalLayer
    _decision: Decision | None
    _performed: tuple[str, ...]

    def __init__(self, vehicle: Vehicle) -> None:
        self.__dict__.update(
            name=vehicle.name, _vehicle=vehicle, _social=vehicle.social, _functional=vehicle.functional,
            _decision=None, _performed=(),
        )  # fmt: skip

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"{name} of {self.name} is only to be read")

    @property
    def position_m(self) -> Point:
        """Where it really is."""
        motion = self._functional.motion
        return motion.x_m, motion.y_m

    @property
    def speed_mps(self) -> float:
        """How fast it really moves over ground."""
        return self._functional.guidance.ground_mps

    @property
    def data(self) -> VehicleData:
        """What it really is in this run."""
        return self._functional.data

    @property
    def makes_headway(self) -> bool:
        """False once it came no nearer to where it was guided for long, see ``remoras.functional.guidance``."""
        return not self._functional.headway.is_lost

    @property
    def waits(self) -> Wait | None:
        """What it waits for; None while it gets on by itself, or is not alive."""
        return self._functional.waits if self._functional.is_on else None

    @property
    def is_alive(self) -> bool:
        """True while it has energy and no fault has taken it away."""
        return self._functional.is_on

    @property
    def is_in_contact(self) -> bool:
        """True while it is alive, hears and is heard; where the strategy uses no modem, whatever that does."""
        vehicle = self._vehicle
        condition = vehicle.condition
        is_cut_off = (condition.is_mute or condition.is_deaf) and vehicle.radio.communicates
        return self._functional.is_on and not is_cut_off

    @property
    def communicates(self) -> bool:
        """True if it sends and hears packets."""
        return self._vehicle.radio.communicates

    @property
    def will_return(self) -> bool:
        """True while a fault keeps it out of contact that will be over, and it has energy."""
        vehicle = self._vehicle
        return vehicle.condition.will_return and not (self.is_in_contact or vehicle.functional.exhausted)

    @property
    def able_data(self) -> VehicleData | None:
        """What it is left with for work: its data, without sensors that are dead for good; None if nothing is."""
        vehicle, condition = self._vehicle, self._vehicle.condition
        if self._functional.exhausted or vehicle.has_resigned or condition.lost_for_good or not self.makes_headway:
            return None
        if not condition.dead_for_good:
            return self.data
        working = tuple(sensor for sensor in self.data.sensors if sensor.name not in condition.dead_for_good)
        return replace(self.data, sensors=working)

    @property
    def sensing(self) -> tuple[str, ...]:
        """Names of its sensors that were on, and worked, in the last motion tick."""
        sensing = self._functional.sensors.looking
        return sensing if sensing and self._functional.is_on else ()

    @property
    def organisation(self) -> Organisation:
        """Groups and roles as the vehicle sees them."""
        return self._social.organisation

    @property
    def performed(self) -> tuple[str, ...]:
        """Names of the activity sets that it performs; the same object until it decides anew."""
        executive = self._vehicle.executive
        if self._decision is not executive.decision:  # saves 2.6 % of the instructions of a mission
            performed = tuple(executive.sets[index].name for index in executive.decision.chosen)
            self.__dict__.update(_decision=executive.decision, _performed=performed)
        return self._performed

    @property
    def finished(self) -> Sequence[Objective]:
        """Objectives for which it has done all there was to do, in order."""
        return tuple(self._social.finished)

    @property
    def issued(self) -> Iterable[RoleAssignment]:
        """Role assignments that it has given out."""
        return frozenset(self._social.planner.orders.issued)

    @property
    def issued_objectives(self) -> Iterable[Objective]:
        """Objectives that it has given to roles."""
        return frozenset(self._social.planner.orders.issued_objectives)

    def objectives_of(self, vehicle: str) -> tuple[Objective, ...]:
        """Objectives that ``vehicle`` has, as this one sees it."""
        return self._social.objectives_of(vehicle)

    def leads(self, group: str) -> bool:
        """True if it is a head of ``group`` and has the social layer."""
        return self._social.leads(group)

    def has_planned(self, group: str) -> bool:
        """True once it has planned the mission of ``group``."""
        return self._social.planner.has_planned(group)

    def gives_out(self, group: str) -> bool:
        """True while ``group`` has work that it still has to give out or to see done."""
        return self._social.gives_out(group)

    def can_play(self, group: str, role: str) -> bool:
        """True if it is able to play that role of the group."""
        return self._vehicle.data.can_play(group, role)

    @property
    def is_patient(self) -> bool:
        """True while it is cut off and leaves to others what it will do itself if they do not come."""
        return self._social.is_patient

    def has_met(self, group: str) -> bool:
        """True if it takes ``group`` for gathered."""
        return group in self._vehicle.functional.picture.groups.gathered


class ReadOnlyFleet(NamedTuple):
    """A fleet as a truth sees it: a ``remoras.mission.FleetView``.

    Attributes:
        vehicles: every vehicle, in the order of the nodes.
    """

    vehicles: tuple[ReadOnlyVehicle, ...]

    @classmethod
    def of(cls, vehicles: Iterable[Vehicle]) -> ReadOnlyFleet:
        """The view of a fleet of these vehicles."""
        return cls(tuple(ReadOnlyVehicle(vehicle) for vehicle in vehicles))


class HolderCount:
    """Counts what vehicles believe of the others' jobs, and how much of it is wrong.

    Not to know who holds a job is not wrong. Vehicles that keep claims to themselves, as in auctions by consensus, name
    nobody.

    Attributes:
        n_believed: (vehicle, job) pairs in which the vehicle named another one as holder.
        n_wrong: such pairs in which one that it named does not hold the job.
    """

    def __init__(self) -> None:
        self.n_believed = 0
        self.n_wrong = 0
        self._last: Sequence[tuple[str, Organisation]] = ()
        self._last_counts = 0, 0

    def compare(self, believed: Sequence[tuple[str, Organisation]]) -> None:
        """Compare the vehicles at one moment; a job is held by those who believe so of themselves.

        Args:
            believed: name of every living vehicle, and the organisation as it sees it.
        """
        if believed != self._last:  # saves 0.9 % of the instructions of a mission
            self._last, self._last_counts = believed, self._counts(believed)
        n_believed, n_wrong = self._last_counts
        self.n_believed += n_believed
        self.n_wrong += n_wrong

    def _counts(self, believed: Sequence[tuple[str, Organisation]]) -> tuple[int, int]:
        """How many pairs there are, and how many of them are wrong."""
        if not believed:
            return 0, 0
        jobs = [(g.name, role.name) for g in believed[0][1].groups.values() for role in g.roles if role.job is not None]
        counts = [self._counts_of_role(believed, group, role) for group, role in jobs]
        return sum(n for n, _ in counts), sum(n for _, n in counts)

    @staticmethod
    def _counts_of_role(believed: Sequence[tuple[str, Organisation]], group: str, role: str) -> tuple[int, int]:
        named = {name: organisation.members(group, role) for name, organisation in believed}
        holders = {name for name, own in named.items() if name in own}
        of_others = [own for name, own in named.items() if own and own != (name,)]
        return len(of_others), sum(not holders.issuperset(own) for own in of_others)

    @property
    def wrong_fraction(self) -> float | None:
        """Share of the pairs that were wrong; None if there were none."""
        return round(self.n_wrong / self.n_believed, 6) if self.n_believed else None
