"""Level of detail by bandwidth: ``communication.coarse_above``, by which a long queue makes what is recorded coarser.

Coarser values take fewer bits to tell. They are rounded where they are recorded, and nowhere else: all vehicles hold
the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

from pydantic import Field

from missions.errors import ConfigurationFault
from missions.feature import Feature, Joining, Trial
from missions.files import shown
from missions.scenarios.tables import QUEUE_LIMIT, Raw, table_of
from remoras.events import Part
from worldmodel import Attribute, TBox
from worldmodel.abox import Stated
from worldmodel.coarse import coarsened

if TYPE_CHECKING:
    from remoras.mission import Mission
    from remoras.vehicle import Vehicle

KEY = "coarse_above"


class Detail:
    """How finely a vehicle records.

    Args:
        tbox: whose attributes may declare a coarse grid.
        n_waiting: tells how many items wait to be said.
        above: with more of them than this, values are coarse.
    """

    def __init__(self, tbox: TBox, n_waiting: Callable[[], int], above: int) -> None:
        self._coarse = {attribute.uid: attribute for attribute in tbox.attributes if attribute.coarse}
        self._n_waiting = n_waiting
        self._above = above

    def of(self, facts: Sequence[Stated]) -> Sequence[Stated]:
        """Return the facts as they are to be recorded now; what cannot be recorded stays as it is."""
        if not any(fact[1] in self._coarse for fact in facts) or self._n_waiting() <= self._above:
            return facts
        return [_rounded(self._coarse[fact[1]], fact) if fact[1] in self._coarse else fact for fact in facts]


def _rounded(attribute: Attribute, fact: Stated) -> Stated:
    subject, uid, value, *uncertain = fact
    try:
        rounded, uncertainty = coarsened(attribute, value, uncertain[0] if uncertain else None)
    except (TypeError, ValueError):
        return fact  # the world model says what is wrong
    return (subject, uid, rounded) if uncertainty is None else (subject, uid, rounded, uncertainty)


def detail_faults(raw: Raw, mission: type[Mission] | None) -> Iterator[ConfigurationFault]:
    """A queue that is never as long as coarse values ask for."""
    communication = table_of(raw, "communication")
    above, limit = communication.get(KEY), communication.get("queue_limit", QUEUE_LIMIT)
    if isinstance(above, int) and isinstance(limit, int) and above >= limit > 0:
        allowed = f"must be below queue_limit = {limit}, or the queue never gets that long"
        yield ConfigurationFault(f"communication.{KEY}", shown(above), allowed)


def part_of(joining: Joining) -> Part | None:
    """Let vehicles whose queue is long record what is coarser."""
    above: int = joining.scenario.communication.of_feature(KEY)

    def equip(vehicle: Vehicle) -> None:
        manager = vehicle.radio.manager
        vehicle.beliefs.rounded = Detail(joining.tbox, lambda: len(manager.queue), above).of

    return Part(equip=equip) if above else None


FEATURE = Feature(
    {
        "communication": {
            KEY: (
                int,
                Field(
                    0,
                    ge=0,
                    le=1_000_000,
                    description="items that wait at a vehicle, above which it records values by the "
                    "rm:coarseResolution of their attribute; 0: never",
                ),
            )
        }
    },
    part_of,
    detail_faults,
    trials=(
        Trial(
            "detail",
            "coarse values above 1 to 20 waiting items",
            (f"communication.{KEY}",),
            lambda draws, scenario: {f"communication.{KEY}": draws.one_of((1, 5, 20))},
        ),
    ),
)
