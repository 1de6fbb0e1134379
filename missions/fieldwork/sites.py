"""Site surveys: travel to a site and dwell there."""

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
    """A site: a ``remoras.work.Job`` with dwell ``stay_s``."""

    place_m: Point
    stay_s: float

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook:
        """Return the outlook after the survey."""
        return outlook.stayed(self.place_m, self.stay_s, data)


class SurveyingSite(Behaviour):
    """Survey of a site by a dwell, which restarts after an interruption."""

    def __init__(self, site: SiteSurvey, data: VehicleData) -> None:
        self._site = site
        self._stay = Stay(data)
        self._way = Reference(site.place_m, data.transit_speed_mps, CAPTURE_M)
        self._still = Reference(site.place_m, 0.0)

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending until the dwell ends, nearest first; progresses on the way and on site."""
        if picture.facts.get(self._site.done) is not None:
            return DONE
        to_go_m = distance_m(motion, self._site.place_m)
        return self._stay.perceive(to_go_m, self._site.stay_s, picture.body.now_s, performed)

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Head for the site in transit; hold there."""
        return self._still if distance_m(motion, self._site.place_m) <= CAPTURE_M else self._way
