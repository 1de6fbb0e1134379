"""Kinds of faults, as docs/howto/scenario.md has them: what the rows of a run have to show of each.

Of a kind that is not here, one from outside, nobody knows what it does: only whom it befell, and when, is looked at.
"""

from __future__ import annotations

from dataclasses import dataclass

ENERGY = "energy"
"""RecordedKind of the row of a vehicle whose battery is empty; nobody declares it."""


@dataclass(frozen=True, slots=True)
class RecordedKind:
    """What a kind does while it holds.

    Attributes:
        is_away: the vehicle does nothing; is_lost: for the mission; is_late: it has not come yet; begins_anew: at the
            end.
        is_mute: nobody hears it; is_deaf: it hears nobody.
        kills: the detail begins with the sensors that yield nothing.
        drains: the detail begins with the power that the battery loses.
    """

    is_away: bool = False
    is_lost: bool = False
    is_late: bool = False
    begins_anew: bool = False
    is_mute: bool = False
    is_deaf: bool = False
    kills: bool = False
    drains: bool = False

    @property
    def is_out(self) -> bool:
        """True if it keeps a vehicle from hearing or being heard."""
        return self.is_away or self.is_mute or self.is_deaf


KINDS = {
    "lost": RecordedKind(is_away=True, is_lost=True),
    "mute": RecordedKind(is_mute=True),
    "deaf": RecordedKind(is_deaf=True),
    "slow": RecordedKind(),
    "sensor": RecordedKind(kills=True),
    "biased": RecordedKind(),
    "restarts": RecordedKind(is_away=True, begins_anew=True),
    "joins": RecordedKind(is_away=True, is_late=True),
    "drains": RecordedKind(drains=True),
}
NOTHING = RecordedKind()
AWAY = (*(name for name, kind in KINDS.items() if kind.is_away), ENERGY)
"""Kinds of rows while which a vehicle does nothing."""
FLOATING = (*(name for name, kind in KINDS.items() if kind.is_away and not kind.is_late), ENERGY)
"""Those while which it floats."""
OUT_OF_CONTACT = (*(name for name, kind in KINDS.items() if kind.is_out), ENERGY)
NOT_HEARING = tuple(name for name, kind in KINDS.items() if kind.is_away or kind.is_deaf)


def kind_of(name: str) -> RecordedKind:
    """What is known of a kind of rows; nothing of those that nobody declares, and of those from outside."""
    return KINDS.get(name, NOTHING)


def forgets(kind: str, detail: str) -> bool:
    """True if a vehicle has lost its memory once a fault is over."""
    return kind_of(kind).begins_anew and "kept" not in detail


def lost_w(kind: str, detail: str) -> float:
    """Power that the battery loses while a fault holds: "50 W, until 72.2 s"."""
    return float(detail.split(maxsplit=1)[0]) if kind_of(kind).drains else 0.0


def dead_sensors(kind: str, detail: str) -> list[str]:
    """Names of the sensors that yield nothing while a fault holds: "sonar, mapping, for good"."""
    return detail.rpartition(", ")[0].split(", ") if kind_of(kind).kills else []
