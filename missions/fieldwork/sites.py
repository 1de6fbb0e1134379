"""A site that is surveyed: whoever has it goes there and stays."""

from __future__ import annotations

from dataclasses import dataclass

from missions.meeting.staying import AnyonesJob, Stay
from remoras.behaviours import CAPTURE_M, DONE, Behaviour, Perception, Reference, distance_m
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.work import Outlook, Point


@dataclass(frozen=True)
class SiteSurvey(AnyonesJob):
    """A site: a ``remoras.work.Job``.

    Attributes:
        name: of the site; place_m: where it is; stay_s: how long a survey takes there.
    """

    place_m: Point
    stay_s: float

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook:
        """When the vehicle will be free if it surveys the site next."""
        return outlook.stayed(self.place_m, self.stay_s, data)


class SurveyingSite(Behaviour):
    """Goes to a site and stays until it is surveyed; whoever is called away begins anew.

    Args:
        site: the job; data: of the vehicle.
    """

    def __init__(self, site: SiteSurvey, data: VehicleData) -> None:
        self._site = site
        self._stay = Stay(data)
        self._way = Reference(site.place_m, data.transit_speed_mps, CAPTURE_M)
        self._still = Reference(site.place_m, 0.0)

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due, the nearest first, until the vehicle has stayed long enough; it advances on the way and on site."""
        if picture.facts.get(self._site.done) is not None:
            return DONE
        to_go_m = distance_m(motion, self._site.place_m)
        return self._stay.perceive(to_go_m, self._site.stay_s, picture.body.now_s, performed)

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """To the site in transit; stay there."""
        return self._still if distance_m(motion, self._site.place_m) <= CAPTURE_M else self._way
