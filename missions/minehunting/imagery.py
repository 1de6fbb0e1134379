"""Views of contacts, the sonar snippets taken there, and their analysis.

Mine echoes lie above a level halfway between mine and rock, rock echoes equally far below, with independent normal
errors. Echoes are keyed by seed, contact and view: a repeated view shows the same.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, ClassVar, NamedTuple, Self

from pydantic import Field

from exchange.arithmetic import TAU, distance, log, sincos
from exchange.channel import loss
from missions.meeting.job_mission import ReportedJob
from remoras.behaviours import Perception, Standing
from remoras.beliefs import Known
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.recorder import TIME, VEHICLE, Column, Table
from remoras.sensor import SELF, Fact, Observation, Pose, Quiet, Sensor, SensorSettings, normal_error
from remoras.table import Positive, Section
from remoras.work import Point

STRIPS = Table("strips", (TIME, VEHICLE, Column("contact", "str"), Column("view", "int"), Column("strip", "int")))
SNIPPET = "Snippet"
SHOWN, ON_TARGET, ON_FLOOR, TAKEN_FROM, REFERENCE = (
    "hasSnippet", "hasTargetStrip", "hasFloorStrip", "takenFrom", "referenceLevel",
)  # fmt: skip
ECHOES = 5
TARGET_ECHOES = tuple(f"targetEcho{n}" for n in range(1, ECHOES + 1))
FLOOR_ECHOES = tuple(f"floorEcho{n}" for n in range(1, ECHOES + 1))
REVISITS = "revisits"
AT_VIEW_M = 3.0  # distance from a view's place within which a sonar shows its contact
OF_ONE_VIEW_M = 1.0  # distance within which snippets belong to one view
MOST_LEVEL_DB = 60.0  # receiver limit of levels
REFERENCE_DB = 20.0  # half range of reference levels around 0
DRAWS_OF_STRIP = 64


MOST_STRIPS = 40


class ImageryTable(Section):
    """Table ``[imagery]``: snippets, and the appearance of mines and rocks."""

    strips: int = Field(8, ge=1, le=MOST_STRIPS, description="strips of a snippet, five echoes each")
    target_strips: int = Field(3, ge=1, le=MOST_STRIPS, description="strips of it that show the contact")
    strip_s: Positive = Field(10.0, description="duration of a strip")
    target_db: Positive = Field(1.8, description="deviation of a mine (up) or rock (down) in strips that show it")
    floor_db: Positive = Field(0.6, description="the same in other strips")
    sigma_db: Positive = Field(6.0, description="standard deviation of an echo")
    mine_share: Annotated[float, Field(ge=0.0, le=1.0)] = Field(0.5, description="probability that a contact is a mine")

    def contradictions(self) -> Iterator[tuple[str, str]]:
        if self.target_strips > self.strips:
            yield "target_strips", f"allowed: 1 to {self.strips}, the strips there are"

    def is_target(self, strip: int) -> bool:
        """Return True if a strip, counted from 0, shows the contact: those in the middle.

        >>> [ImageryTable(strips=5, target_strips=2).is_target(strip) for strip in range(5)]
        [False, True, True, False, False]
        """
        first = (self.strips - self.target_strips) // 2
        return first <= strip < first + self.target_strips


@dataclass(frozen=True, kw_only=True)
class ContactView(ReportedJob):
    """View ``number`` (from 0) of a contact; ``contact`` is empty before the request of a revisit."""

    number: int
    contact: str = ""
    contacts_m: Mapping[str, Point] = field(hash=False)
    beside_m: Point

    def is_able(self, data: VehicleData) -> bool:
        return data.sensor(SnippetSonarSettings) is not None

    def left(self, facts: Known) -> Self | None:
        """Return the job at its place; None for a revisit before its request."""
        contact = self.contact if self.number == 0 else facts.get((REVISITS, self.name))
        return None if contact is None else replace(self.of(contact), share_left=self.share_by(facts))

    def of(self, contact: str) -> Self:
        """Return the view of a contact, at its place."""
        x_m, y_m = self.contacts_m[contact]
        return replace(self, contact=contact, place_m=(x_m + self.beside_m[0], y_m + self.beside_m[1]))


def beside_contact(number: int, n_views: int, view_m: float) -> Point:
    """Place of a view relative to its contact; the views lie on a circle.

    >>> beside_contact(1, 4, 10.0)
    (0.0, 10.0)
    """
    sin, cos = sincos(TAU * number / n_views)
    # Adding 0.0 turns -0.0 into 0.0, whose bits differ.
    return round(view_m * cos, 1) + 0.0, round(view_m * sin, 1) + 0.0


@dataclass(frozen=True)
class Minefield:
    """True contacts and images; ``views`` are (place, contact, contact number, view number)."""

    seed: int
    views: tuple[tuple[Point, str, int, int], ...]
    mines: frozenset[str]
    imagery: ImageryTable

    def view_at(self, at_m: Point) -> tuple[int | None, float]:
        """Index of the view at a place, None if there is none, and the distance to the nearest (m)."""
        off_m = [distance(place_m, at_m) for place_m, *_ in self.views]
        return next((n for n, each_m in enumerate(off_m) if each_m <= AT_VIEW_M), None), min(off_m, default=math.inf)

    def header(self, which: int) -> Observation:
        """Snippet of a view with its reference level."""
        place_m, contact, n, number = self.views[which]
        facts: tuple[Fact, ...] = (
            (SELF, TAKEN_FROM, place_m), (SELF, REFERENCE, self._reference_db(n, number)), (contact, SHOWN, SELF),
        )  # fmt: skip
        return Observation(facts, found=SNIPPET, within_m=OF_ONE_VIEW_M)

    def strip(self, which: int, strip: int) -> Observation:
        """Strip of a view's snippet, by number."""
        place_m, contact, n, number = self.views[which]
        shows = self.imagery.is_target(strip)
        names, link = (TARGET_ECHOES, ON_TARGET) if shows else (FLOOR_ECHOES, ON_FLOOR)
        louder_db = self.imagery.target_db if shows else self.imagery.floor_db
        mean_db = louder_db if contact in self.mines else -louder_db
        reference_db = self._reference_db(n, number)
        facts: list[Fact] = [(SELF, TAKEN_FROM, place_m)]
        for echo, name in enumerate(names):
            pair_db = tuple(
                self._level_db(reference_db[side] + mean_db, n, number, DRAWS_OF_STRIP * (strip + 1) + 2 * echo + side)
                for side in (0, 1)
            )
            facts.append((SELF, name, (pair_db[0], pair_db[1])))
        return Observation((*facts, (contact, link, SELF)), (contact, number, strip), SNIPPET, OF_ONE_VIEW_M)

    def _reference_db(self, n: int, number: int) -> Point:
        high, low = (loss.uniform(self.seed, loss.LOOKS, n, number, side) for side in (0, 1))
        return round((2.0 * high - 1.0) * REFERENCE_DB, 1), round((2.0 * low - 1.0) * REFERENCE_DB, 1)

    def _level_db(self, mean_db: float, n: int, number: int, draw: int) -> float:
        error = normal_error(loss.uniform(self.seed, loss.LOOKS, n, number, draw))
        level_db = mean_db + self.imagery.sigma_db * error
        return round(min(max(level_db, -MOST_LEVEL_DB), MOST_LEVEL_DB), 1)


class SnippetSonarSettings(SensorSettings):
    """Table ``[[vehicle.sensor]]`` of a sonar that takes snippets."""

    EQUIPMENT: ClassVar[str] = "SideScanSonar"

    def make(self, data: VehicleData) -> Sensor:
        return SnippetSonar()


class SnippetSonar:
    """Sonar that takes each strip of the current view once."""

    table = STRIPS

    def __init__(self) -> None:
        self._at: int | None = None
        self._since_s = 0.0
        self._n_taken: Counter[int] = Counter()

    def sense(self, pose: Pose, world: Minefield, now_s: float) -> Sequence[Observation]:
        """Return the next strip after ``strip_s``; the first includes the reference level."""
        view, off_m = world.view_at((pose.x_m, pose.y_m))
        if view != self._at:
            self._at, self._since_s = view, now_s
        if view is None:
            return Quiet(off_m - AT_VIEW_M)
        if now_s - self._since_s < world.imagery.strip_s:
            return ()
        number = self._n_taken[view]
        if number >= world.imagery.strips:
            return ()
        self._n_taken[view] += 1
        self._since_s = now_s
        strip = world.strip(view, number)
        return (world.header(view), strip) if number == 0 else (strip,)


CLASSIFIED = "classifiedAs"
MINE, ROCK = "mine", "rock"


class Evidence(NamedTuple):
    """Evidence about a contact: log likelihood ratio mine/rock, strips across and beside it."""

    log_ratio: float
    n_target: int
    n_floor: int


def evidence_of(contact: str, facts: Known, imagery: ImageryTable) -> Evidence:
    """Evidence of all snippets with a known reference level."""
    echoes = (TARGET_ECHOES, imagery.target_db), (FLOOR_ECHOES, imagery.floor_db)
    terms: list[float] = []
    n_strips = [0, 0]
    for snippet in facts.values((SHOWN, contact)):
        high_db, low_db = facts.get((REFERENCE, snippet), (0.0, 0.0))
        for kind, (names, mean_db) in enumerate(echoes):
            pairs = [facts.values((name, snippet)) for name in names]
            n_strips[kind] += max(map(len, pairs))
            # Log likelihood ratio of a level x: 2 m (x - reference) / sigma^2, with m the distance of the mean from
            # halfway (Wald, Sequential Analysis, 1947).
            weight = 2.0 * mean_db / (imagery.sigma_db * imagery.sigma_db)
            terms += [weight * (high - high_db + low - low_db) for of_name in pairs for high, low in of_name]
    return Evidence(math.fsum(terms), *n_strips)


class Analysing(Standing):
    """Background classification; requests another view once all strips across a contact leave it undecided."""

    def __init__(self, scenario: Any, firsts: Sequence[ContactView], revisits: Sequence[ContactView]) -> None:
        confidence, self._waits_s = scenario.mission.confidence, scenario.mission.waits_s
        self._imagery: ImageryTable = scenario.imagery
        # Log likelihood ratio for a decision, with equal priors; 4.6 for a confidence of 99 %.
        self._decisive = log(confidence / (1.0 - confidence))
        self._firsts, self._revisits = firsts, revisits
        self._news_s: dict[str, tuple[tuple[int, ...], float]] = {}

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Return conclusions; never pending."""
        facts, now_s = picture.facts, picture.body.now_s
        free = [view for view in self._revisits if facts.get((REVISITS, view.name)) is None]
        observations: list[Observation] = []
        for first in self._firsts:
            if facts.get((CLASSIFIED, first.contact)) is not None:
                continue
            verdict = self._verdict(first, facts, now_s, bool(free))
            if verdict == REVISITS:
                observations.append(Observation(((free.pop(0).name, REVISITS, first.contact),)))
            elif verdict:
                observations.append(Observation(((first.contact, CLASSIFIED, verdict),)))
        return Perception(0.0, concludes=tuple(observations))

    def _verdict(self, first: ContactView, facts: Known, now_s: float, may_ask: bool) -> str:
        imagery = self._imagery
        known = evidence_of(first.contact, facts, imagery)
        likely = MINE if known.log_ratio > 0.0 else ROCK
        if abs(known.log_ratio) >= self._decisive:
            return likely
        views = [first, *(view for view in self._revisits if facts.get((REVISITS, view.name)) == first.contact)]
        n_done = sum(facts.get(view.done) is not None for view in views)
        news = known.n_target, known.n_floor, n_done
        before, since_s = self._news_s.get(first.contact, ((), now_s))
        if news != before:
            self._news_s[first.contact] = news, now_s
            since_s = now_s
        is_over = n_done == len(views) and now_s - since_s >= self._waits_s
        n_target = len(views) * imagery.target_strips
        # Strips beside the contact say little, so another view is requested without waiting for them.
        if may_ask and (known.n_target >= n_target or is_over):
            return REVISITS
        has_all = known.n_target + known.n_floor >= len(views) * imagery.strips
        return likely if has_all or (is_over and known.n_target > 0) else ""
