"""What missions share whose vehicles go to places and stay there: jobs that anybody may do, and how a stay gets on.

A survey of a site is such a job.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pydantic import Field

from missions.scenarios.tables import Name, PointM, Positive, Section
from remoras.behaviours import (
    ADVANCING,
    CAPTURE_M,
    DONE,
    Approach,
    Behaviour,
    Perception,
    Reference,
    attracted,
    distance_m,
)
from remoras.beliefs import Key
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.work import Outlook, Point

DONE_BY = "jobDone"
"""Attribute of a job: who has done it."""
THERE_M = 2.0
"""A vehicle this near to a place is there."""


@dataclass(frozen=True)
class AnyonesJob:
    """Most of a ``remoras.work.Job``: every vehicle is able to do it, and nothing must be done before.

    Attributes:
        name: of the job.
        needs: nothing.
    """

    name: str
    needs: ClassVar[tuple[str, ...]] = ()

    @property
    def done(self) -> Key:
        """Somebody has done it."""
        return DONE_BY, self.name

    def is_able(self, data: VehicleData) -> bool:
        """Every vehicle is."""
        return True


class SiteTable(Section):
    """One ``[[site]]``."""

    name: Name = Field(description="name of the site")
    position_m: PointM = Field(description="where it is, x east, y north")
    stay_s: Positive = Field(120.0, description="how long a survey takes there")


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


class Stay:
    """How a vehicle gets to a place and stays there; whoever is called away begins anew.

    Args:
        data: of the vehicle.
    """

    def __init__(self, data: VehicleData) -> None:
        self._speed_mps = data.transit_speed_mps
        self._approach = Approach(data.transit_speed_mps)
        self._since_s: float | None = None

    def perceive(self, to_go_m: float, stay_s: float, now_s: float, performed: bool) -> Perception:
        """Due, the nearest first; it advances on the way and there, and is done after ``stay_s`` there."""
        if to_go_m > THERE_M or not performed:
            self._since_s = None
            advance = self._approach.advance(to_go_m, now_s, performed)
            return Perception(1.0, advance) if performed else attracted(to_go_m)
        self._since_s = now_s if self._since_s is None else self._since_s
        return DONE if now_s - self._since_s >= stay_s else ADVANCING

    def begin_anew(self) -> None:
        """The time there so far does not count."""
        self._since_s = None

    def reference(self, place_m: Point, motion: Motion) -> Reference:
        """To the place in transit; stay there."""
        return Reference(place_m, 0.0 if distance_m(motion, place_m) <= CAPTURE_M else self._speed_mps)


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
