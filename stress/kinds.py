"""Kinds of faults: what they befall, which keys of ``[[fault]]`` they use, and how strong a seed may draw them.

Those of vehicles and sensors that a scenario may declare are the same values here. The others wrap seams of the fleet
from outside: the channel, what a vehicle hears, says, records and senses, its clock, its strategy.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from remoras.faults import FaultKind
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
        name: as ``--faults`` and ``[[fault]]`` say it.
        family: what it befalls; text: what happens.
        keys: keys of ``[[fault]]`` that it uses beside kind, vehicle, at_s and until_s.
        shares: range of ``share`` from which a seed draws; (1, 1) if all is befallen.
        strengths: range of whole numbers, or values, from which a seed draws its own key.
        may_stay: it may last for good; else it heals, or is over at once.
        is_sudden: it happens at a time and does not last.
    """

    name: str
    family: Family
    text: str
    keys: tuple[str, ...] = ()
    shares: tuple[float, float] = (1.0, 1.0)
    strengths: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)
    may_stay: bool = False
    is_sudden: bool = False

    @property
    def is_of_scenario(self) -> bool:
        """True if a scenario may declare it."""
        return self.name in list(FaultKind)

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

ALL = (
    Kind("loss", LINK, "packets are lost", ON_LINK, (0.1, 0.9)),
    Kind("bursts", LINK, "packets of spells are lost", (*ON_LINK, "slots"), (0.2, 0.8), {"slots": (8, 20, 60)}),
    Kind("partition", LINK, "nothing passes between the vehicle and the peer, or all others", ("peer", "one_way"),
         strengths={"one_way": (True, False)}),
    Kind("twice", LINK, "packets arrive twice", (*ON_LINK, "slots"), (0.1, 0.6), {"slots": (1, 2, 4, 8)}),
    Kind("late", LINK, "packets arrive later", (*ON_LINK, "slots"), (0.1, 0.6), {"slots": (0.1, 1, 2, 4, 8)}),
    Kind("echo", LINK, "the vehicle hears its own packets", ("share", "slots"), (0.1, 0.6), {"slots": (0.2, 1, 4)}),
    Kind("bits", LINK, "bits of packets are flipped", (*ON_LINK, "bits"), (0.05, 0.5), {"bits": (1, 1, 2, 4, 8)}),
    Kind("cut", LINK, "the ends of packets are missing", ON_LINK, (0.05, 0.5)),
    Kind("forged", LINK, "packets say what their sender did not, in good form", ON_LINK, (0.05, 0.3)),
    Kind("lost", VEHICLE, "the vehicle does nothing", may_stay=True),
    Kind("mute", VEHICLE, "nobody hears the vehicle", may_stay=True),
    Kind("deaf", VEHICLE, "the vehicle hears nobody", may_stay=True),
    Kind("restarts", VEHICLE, "it is off and begins anew", ("memory",), strengths={"memory": ("kept", "lost")}),
    Kind("slow", VEHICLE, "it is slower", ("factor",), strengths={"factor": (0.4, 0.6, 0.8)}, may_stay=True),
    Kind("joins", VEHICLE, "the vehicle is not there before", is_sudden=True),
    Kind("clock", VEHICLE, "its clock jumps, and is set back", ("by_s",), strengths={"by_s": JUMPS_S}),
    Kind("sensor", SENSOR, "its sensors yield nothing", ("sensor",), may_stay=True),
    Kind("biased", SENSOR, "what a sensor reads is off", ("sensor", "attribute", "offset")),
    Kind("drains", VEHICLE, "it loses power", ("drain_w",), strengths={"drain_w": (50.0, 200.0)}),
    Kind("random", SENSOR, "its sensors read what they read elsewhere", ("share",), (0.2, 1.0)),
    Kind("frozen", SENSOR, "its sensors read the same again and again"),
    Kind("misplaced", SENSOR, "it reports positions far off", ("share", "by_m"), (0.1, 1.0), {"by_m": (5000.0,)},
         may_stay=True),
    Kind("forged-role", MIND, "it gives itself a role of another", is_sudden=True),
    Kind("forged-objective", MIND, "it gives a role of another group an objective", is_sudden=True),
    Kind("forged-done", MIND, "it says that a job is done which is not", is_sudden=True),
    Kind("sulks", MIND, "it signals the least satisfaction", ("share",)),
    Kind("raises", MIND, "its strategy raises", is_sudden=True),
    Kind("malformed", MIND, "its strategy answers what is not allowed", is_sudden=True),
)  # fmt: skip
"""Kinds in the order in which tables show them."""
KINDS: dict[str, Kind] = {kind.name: kind for kind in ALL}
ENDING = frozenset({"raises", "malformed"})
"""Kinds after which a run ends with an error that names the plug-in."""
SELDOM = frozenset({"biased", *ENDING})
"""Kinds that are drawn only where ``--faults`` asks for them: they need a value of the mission, or end it."""
