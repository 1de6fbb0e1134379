"""Read-only views of vehicles and fleet for the referee of a mission, its truth."""

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
        """False once it came no nearer to where it was guided for long, see ``remoras.functional.headway``."""
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
        return self._social.standing.organisation

    @property
    def performed(self) -> tuple[str, ...]:
        """Names of the activity sets that it performs; the same object until it decides anew."""
        executive = self._vehicle.executive
        if self._decision is not executive.decision:
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
        return self._social.standing.is_patient

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
