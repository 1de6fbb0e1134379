"""AUV database: static data of vehicles; variable data are facts (REMORAS, section IV.A)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, Protocol, TypeVar

HOME_MARGIN = 1.25
"""Factor on the energy of the way home."""


def power_w(hotel_w: float, drag_w_per_mps3: float, speed_mps: float) -> float:
    """Return the power (W) of a vehicle at a speed."""
    return hotel_w + drag_w_per_mps3 * (speed_mps * speed_mps * speed_mps)


class Carried(Protocol):
    """Settings of a sensor on board (``remoras.SensorSettings``)."""

    @property
    def name(self) -> str:
        """Name used in activities."""

    @property
    def tells_state(self) -> bool:
        """True if the vehicle can query its state."""

    def make(self, data: VehicleData) -> Any:
        """Return the sensor of a vehicle (``remoras.Sensor``)."""


Settings = TypeVar("Settings", bound=Carried)


@dataclass(frozen=True, slots=True)
class VehicleData:
    """Static data of one vehicle.

    ``name`` is unique in the fleet, for example ``AUV00``; ``node`` the index in the TDMA frame. Without
    ``social_layer`` it neither leads a group nor divides jobs, but follows its leader. ``start_m`` is (x east, y north)
    at time 0; vehicles at different ``depth_m`` pass freely. Power = ``hotel_w + drag_w_per_mps3 * speed^3``, hotel
    including the receiving modem; a packet takes ``transmit_j_per_packet`` before its bits; ``energy_j`` is the battery
    capacity. ``playable_roles`` are ``Role`` of any group, or ``Group.Role``. ``sensors`` are settings, in scenario
    order. ``speed_factor``: true speed over that in the data, in one run; 1 as far as the fleet knows.

    >>> from missions.runs.setup import resolved
    >>> from missions.scenarios import load
    >>> data: VehicleData = resolved(load("mapping-rendezvous")).database["AUV01"]
    >>> data.node, data.can_play("Operational", "LeftWinger")
    (2, True)
    """

    name: str
    vehicle_type: str
    node: int
    social_layer: bool
    start_m: tuple[float, float]
    depth_m: float
    depth_limit_m: float
    transit_speed_mps: float
    survey_speed_mps: float
    turn_rate_radps: float
    acceleration_mps2: float
    energy_j: float
    hotel_w: float
    drag_w_per_mps3: float
    transmit_j_per_bit: float
    playable_roles: tuple[str, ...]
    sensors: tuple[Carried, ...] = ()
    speed_factor: float = 1.0
    transmit_j_per_packet: float = 0.0

    def can_play(self, group: str, role: str) -> bool:
        """Return whether it is able to play that role of the group."""
        return role in self.playable_roles or f"{group}.{role}" in self.playable_roles

    def sensor(self, kind: type[Settings]) -> Settings | None:
        """Return the settings of its first sensor of a kind; None without one."""
        for sensor in self.sensors:  # hot path: faster than a generator
            if isinstance(sensor, kind):
                return sensor
        return None

    def power_w(self, speed_mps: float) -> float:
        """Return the power (W) at a speed."""
        return power_w(self.hotel_w, self.drag_w_per_mps3, speed_mps)

    def faster(self, factor: float) -> VehicleData:
        """Return the true vehicle, with both speeds multiplied by ``factor``."""
        return replace(
            self,
            transit_speed_mps=factor * self.transit_speed_mps,
            survey_speed_mps=factor * self.survey_speed_mps,
            speed_factor=factor,
        )


class AUVDatabase(dict[str, VehicleData]):
    """Static data by vehicle name, in node order; nobody changes it."""

    def __init__(self, vehicles: Iterable[VehicleData]) -> None:
        super().__init__((data.name, data) for data in sorted(vehicles, key=lambda data: data.node))
        self.names = tuple(self)

    def able_to_play(self, group: str, role: str) -> tuple[VehicleData, ...]:
        """Return the vehicles able to play that role, in node order."""
        return tuple(data for data in self.values() if data.can_play(group, role))
