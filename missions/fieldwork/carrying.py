"""Deliveries: pick up a load at one place, hand it over at another."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from missions.meeting.staying import AnyonesJob, Stay
from remoras.behaviours import ADVANCING, DONE, Behaviour, Perception, Reference
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.work import Outlook, Point


@dataclass(frozen=True)
class Delivery(AnyonesJob):
    """A load: a ``remoras.work.Job`` with ``handling_s`` at pick-up and at hand-over each."""

    place_m: Point
    to_m: Point
    handling_s: float
    length_m: Callable[[Point, Point], float]

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook:
        """Return the outlook after the delivery."""
        way_m = self.length_m(outlook.position_m, self.place_m) + self.length_m(self.place_m, self.to_m)
        return Outlook(outlook.free_s + way_m / data.transit_speed_mps + 2.0 * self.handling_s, self.to_m)


class Carrying(Behaviour):
    """Pick-up and hand-over of a load."""

    def __init__(self, delivery: Delivery, data: VehicleData) -> None:
        self._delivery, self._data = delivery, data
        self._stay = Stay(data)
        self._has_load = False

    @property
    def _place_m(self) -> Point:
        return self._delivery.to_m if self._has_load else self._delivery.place_m

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending, nearest first; progresses on the way and during pick-up and hand-over."""
        of = self._delivery
        if picture.facts.get(of.done) is not None:
            return DONE
        to_go_m = of.length_m(motion.position_m, self._place_m)
        found = self._stay.perceive(to_go_m, of.handling_s, picture.body.now_s, performed)
        if found is not DONE or self._has_load:
            return found
        self._has_load, self._stay = True, Stay(self._data)
        return ADVANCING

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Head for the next end in transit; hold there."""
        return self._stay.reference(self._place_m, motion)
