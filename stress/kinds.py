"""Kinds of faults: what they befall, which keys of ``[[fault]]`` they use, and how strong a seed may draw them.

Those that a scenario may declare say themselves how they are drawn (``missions.fault.Drawing``). The others wrap seams
of the fleet from outside: the channel, what a vehicle hears, says, records and senses, its clock, its strategy.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cache
from typing import Any

from missions.fault import Absence, Drawing, kinds
from missions.scenarios.faults import DeclaredFault, kind_named
from stress.draws import Draws


class Family(StrEnum):
    """What a fault befalls."""

    LINK = "links"
    VEHICLE = "vehicles"
    SENSOR = "sensors"
    MIND = "minds"


@dataclass(frozen=True)
class Kind:
    """One kind of faults.

    Attributes:
        place: among all, in the order of tables and draws.
        name: as ``--faults`` and ``[[fault]]`` say it.
        family: what it befalls; text: what happens.
        keys: keys of ``[[fault]]`` that it uses beside kind, vehicle, at_s and until_s.
        shares: range of ``share`` from which a seed draws; (1, 1) if all is befallen.
        strengths: range of whole numbers, or values, from which a seed draws its own key.
        may_stay: it may last for good; else it heals, or is over at once.
        is_sudden: it happens at a time and does not last.
        by_chance: False if it is drawn only where ``--faults`` asks for it.
        declared: what it is in a scenario; None if none may declare it.
    """

    place: int
    name: str
    family: Family
    text: str
    keys: tuple[str, ...] = ()
    shares: tuple[float, float] = (1.0, 1.0)
    strengths: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)
    may_stay: bool = False
    is_sudden: bool = False
    by_chance: bool = True
    declared: type[DeclaredFault] | None = None

    @property
    def is_of_scenario(self) -> bool:
        """True if a scenario may declare it."""
        return self.declared is not None

    @property
    def takes_away(self) -> bool:
        """True if the vehicle is away while it holds."""
        return self.declared is not None and self.declared.ABSENCE is not None

    @property
    def is_of_start(self) -> bool:
        """True if it holds from the start on, until its time."""
        return self.declared is not None and self.declared.ABSENCE is Absence.BEFORE

    def drawn(self, draws: Draws) -> dict[str, Any]:
        """Its own keys, with values."""
        found = {key: draws.one_of(values) for key, values in self.strengths.items()}
        if "share" in self.keys:
            low, high = self.shares
            found["share"] = round(low + (high - low) * draws.uniform(), 2)
        return found


LINK, VEHICLE, SENSOR, MIND = Family.LINK, Family.VEHICLE, Family.SENSOR, Family.MIND
ON_LINK = ("peer", "share")
JUMPS_S = (-30.0, -2.0, -0.3, 0.3, 2.0, 30.0)
FOR_GOOD = " for good"
"""Behind a kind, or a danger, of which a fault stays: less is promised then."""

UNDECLARED = (
    Kind(10, "loss", LINK, "packets are lost", ON_LINK, (0.1, 0.9)),
    Kind(20, "bursts", LINK, "packets of spells are lost", (*ON_LINK, "slots"), (0.2, 0.8), {"slots": (8, 20, 60)}),
    Kind(30, "partition", LINK, "nothing passes between the vehicle and the peer, or all others", ("peer", "one_way"),
         strengths={"one_way": (True, False)}),
    Kind(40, "twice", LINK, "packets arrive twice", (*ON_LINK, "slots"), (0.1, 0.6), {"slots": (1, 2, 4, 8)}),
    Kind(50, "late", LINK, "packets arrive later", (*ON_LINK, "slots"), (0.1, 0.6), {"slots": (0.1, 1, 2, 4, 8)}),
    Kind(60, "echo", LINK, "the vehicle hears its own packets", ("share", "slots"), (0.1, 0.6), {"slots": (0.2, 1, 4)}),
    Kind(70, "bits", LINK, "bits of packets are flipped", (*ON_LINK, "bits"), (0.05, 0.5), {"bits": (1, 1, 2, 4, 8)}),
    Kind(80, "cut", LINK, "the ends of packets are missing", ON_LINK, (0.05, 0.5)),
    Kind(90, "forged", LINK, "packets say what their sender did not, in good form", ON_LINK, (0.05, 0.3)),
    Kind(160, "clock", VEHICLE, "its clock jumps, and is set back", ("by_s",), strengths={"by_s": JUMPS_S}),
    Kind(200, "random", SENSOR, "its sensors read what they read elsewhere", ("share",), (0.2, 1.0)),
    Kind(210, "frozen", SENSOR, "its sensors read the same again and again"),
    Kind(220, "misplaced", SENSOR, "it reports positions far off", ("share", "by_m"), (0.1, 1.0), {"by_m": (5000.0,)},
         may_stay=True),
    Kind(230, "forged-role", MIND, "it gives itself a role of another", is_sudden=True),
    Kind(240, "forged-objective", MIND, "it gives a role of another group an objective", is_sudden=True),
    Kind(250, "forged-done", MIND, "it says that a job is done which is not", is_sudden=True),
    Kind(255, "forged-lead", MIND, "it claims to lead a group whose head it hears", ("term",),
         strengths={"term": (1, 1, 2, 64, 65, 128, 254, 255)}, is_sudden=True),
    Kind(260, "sulks", MIND, "it signals the least satisfaction", ("share",)),
    Kind(270, "raises", MIND, "its strategy raises", is_sudden=True, by_chance=False),
    Kind(280, "malformed", MIND, "its strategy answers what is not allowed", is_sudden=True, by_chance=False),
)  # fmt: skip
"""Kinds that no scenario may declare."""


def _declared(name: str, declared: type[DeclaredFault]) -> Kind:
    """A kind that a scenario may declare."""
    drawing = declared.DRAWING or Drawing(by_chance=False)
    return Kind(
        drawing.place,
        name,
        Family(drawing.family),
        declared.TEXT,
        tuple(declared.own_keys()),
        strengths=drawing.strengths,
        may_stay=drawing.may_stay,
        is_sudden=drawing.is_sudden,
        by_chance=drawing.by_chance,
        declared=declared,
    )


ALL = tuple(
    sorted([*UNDECLARED, *(_declared(name, kind) for name, kind in kinds().items())], key=lambda kind: kind.place)
)
"""Kinds in the order in which tables show them."""
KINDS: dict[str, Kind] = {kind.name: kind for kind in ALL}
ENDING = frozenset({"raises", "malformed"})
"""Kinds after which a run ends with an error that names the plug-in."""
SELDOM = frozenset(kind.name for kind in ALL if not kind.by_chance)
"""Kinds that are drawn only where ``--faults`` asks for them: they need a value of the mission, or end it."""


@cache
def kind_of(name: str) -> Kind:
    """A kind by its name, or one that a scenario may declare by ``package.module:Class``.

    Raises:
        PluginError: there is none, or one from outside that lacks a part of the seam.
    """
    return KINDS[name] if name in KINDS else _declared(name, kind_named(name))
