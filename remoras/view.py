"""Read-only views of vehicles and fleet for the ground truth; agreement about job holders."""

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
    """Read-only vehicle for the ground truth (``remoras.mission.VehicleView``)."""

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
        """True position."""
        motion = self._functional.motion
        return motion.x_m, motion.y_m

    @property
    def speed_mps(self) -> float:
        """True speed over ground."""
        return self._functional.guidance.ground_mps

    @property
    def data(self) -> VehicleData:
        """True data in this run."""
        return self._functional.data

    @property
    def makes_headway(self) -> bool:
        """False while it makes no progress towards its target (``remoras.functional.guidance``)."""
        return not self._functional.headway.is_lost

    @property
    def waits(self) -> Wait | None:
        """Condition that it waits for; None without one or if not alive."""
        return self._functional.waits if self._functional.is_on else None

    @property
    def is_alive(self) -> bool:
        """True while energy remains and no fault has removed it."""
        return self._functional.is_on

    @property
    def is_in_contact(self) -> bool:
        """True while alive and able to send and receive; modem faults count only if it communicates."""
        vehicle = self._vehicle
        condition = vehicle.condition
        is_cut_off = (condition.is_mute or condition.is_deaf) and vehicle.radio.communicates
        return self._functional.is_on and not is_cut_off

    @property
    def communicates(self) -> bool:
        """True if it sends and receives packets."""
        return self._vehicle.radio.communicates

    @property
    def will_return(self) -> bool:
        """True while it has energy and a temporary fault keeps it out of contact."""
        vehicle = self._vehicle
        return vehicle.condition.will_return and not (self.is_in_contact or vehicle.functional.exhausted)

    @property
    def able_data(self) -> VehicleData | None:
        """Its data without permanently failed sensors; None if it can do no more work."""
        vehicle, condition = self._vehicle, self._vehicle.condition
        if self._functional.exhausted or vehicle.has_resigned or condition.lost_for_good or not self.makes_headway:
            return None
        if not condition.dead_for_good:
            return self.data
        working = tuple(sensor for sensor in self.data.sensors if sensor.name not in condition.dead_for_good)
        return replace(self.data, sensors=working)

    @property
    def sensing(self) -> tuple[str, ...]:
        """Names of its sensors that were on and worked in the last motion tick."""
        sensing = self._functional.sensors.looking
        return sensing if sensing and self._functional.is_on else ()

    @property
    def organisation(self) -> Organisation:
        """Groups and roles in its view."""
        return self._social.organisation

    @property
    def performed(self) -> tuple[str, ...]:
        """Names of performed activity sets; the same object until the next decision."""
        executive = self._vehicle.executive
        if self._decision is not executive.decision:  # saves 2.6 % of the instructions of a mission
            performed = tuple(executive.sets[index].name for index in executive.decision.chosen)
            self.__dict__.update(_decision=executive.decision, _performed=performed)
        return self._performed

    @property
    def finished(self) -> Sequence[Objective]:
        """Completed objectives, in order."""
        return tuple(self._social.finished)

    @property
    def issued(self) -> Iterable[RoleAssignment]:
        """Role assignments that it has given."""
        return frozenset(self._social.planner.orders.issued)

    @property
    def issued_objectives(self) -> Iterable[Objective]:
        """Objectives that it has given to roles."""
        return frozenset(self._social.planner.orders.issued_objectives)

    def objectives_of(self, vehicle: str) -> tuple[Objective, ...]:
        """Return the objectives of ``vehicle`` in its view."""
        return self._social.objectives_of(vehicle)

    def leads(self, group: str) -> bool:
        """Return whether it leads ``group`` and has the social layer."""
        return self._social.leads(group)

    def has_planned(self, group: str) -> bool:
        """Return whether it has planned the mission of ``group``."""
        return self._social.planner.has_planned(group)

    def gives_out(self, group: str) -> bool:
        """Return whether ``group`` has work that it has to assign or to confirm."""
        return self._social.gives_out(group)

    def can_play(self, group: str, role: str) -> bool:
        """Return whether it is able to play that role of the group."""
        return self._vehicle.data.can_play(group, role)

    @property
    def is_patient(self) -> bool:
        """True during the grace period: while isolated it leaves the jobs of others alone."""
        return self._social.is_patient

    def has_met(self, group: str) -> bool:
        """Return whether it believes ``group`` gathered."""
        return group in self._vehicle.functional.picture.groups.gathered


class ReadOnlyFleet(NamedTuple):
    """Read-only fleet for the ground truth (``remoras.mission.FleetView``), in node order."""

    vehicles: tuple[ReadOnlyVehicle, ...]

    @classmethod
    def of(cls, vehicles: Iterable[Vehicle]) -> ReadOnlyFleet:
        """Create the view of these vehicles."""
        return cls(tuple(ReadOnlyVehicle(vehicle) for vehicle in vehicles))


class HolderCount:
    """Count of beliefs about job holders, per vehicle and job of another, and of the wrong ones.

    Unknown holders are not wrong. Vehicles with private claims, as in auctions by consensus, name none.
    """

    def __init__(self) -> None:
        self.n_believed = 0
        self.n_wrong = 0
        self._last: Sequence[tuple[str, Organisation]] = ()
        self._last_counts = 0, 0

    def compare(self, believed: Sequence[tuple[str, Organisation]]) -> None:
        """Add the beliefs of living vehicles at one time; holders are those in their own view."""
        if believed != self._last:  # saves 0.9 % of the instructions of a mission
            self._last, self._last_counts = believed, self._counts(believed)
        n_believed, n_wrong = self._last_counts
        self.n_believed += n_believed
        self.n_wrong += n_wrong

    def _counts(self, believed: Sequence[tuple[str, Organisation]]) -> tuple[int, int]:
        """Return the number of pairs and of wrong ones."""
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
        """Share of wrong pairs; None without any."""
        return round(self.n_wrong / self.n_believed, 6) if self.n_believed else None
