"""Satisfaction-altruism model: personal satisfaction of roles, motivation of activities.

The model follows Simonin and Ferber (SAB 2000) as used in the REMORAS paper: personal satisfaction follows the
perceived progress of a role's task and is sent to the group as a signed byte; a dissatisfied peer moves others to
respond. The published equations were not at hand; docs/model/decision.md declares these and their constants.

Personal satisfaction P of a role, -128..127, over a time dt, with the progress a of its objective, -1..1 (1 as fast as
planned, 0 no progress, negative a setback)::

    P <- clip(P + rate dt),   rate = a gain + (1 - a) tedium,         a >= 0
                                     |a| dismay + (1 - |a|) tedium,   a < 0
    P <- P moved towards 0 by at most fade dt,   if no progress of the role is perceived.

Motivation of an activity of role r, from the three sources of the paper::

    importance * stimulus                               (1) importance and perception of stimuli
    + w_continuing * (P_r + 128) / 255                  (2) only while it is being performed in a role
    + w_external * max(0, C_r * answers - own)          (3) only for collective activities

    C_r = max over signals S addressed to r (or to an own role of the group with the same activity)
          of max(0, -S) / 128 * exp(-age / tau)
    own = max over the individual activities performed of stimulus * max(0, P) / 127

Altruism thus weighs a call against the satisfaction with own work, whose stimulus falls with the remaining work, and by
the effect of responding. Without a stimulus the motivation is 0: the activity cannot be done.
"""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import Field

from exchange.arithmetic import exp
from remoras.table import NotNegative, Positive, Section

LOWEST, HIGHEST = -128, 127


class DecisionTable(Section):
    """The table ``[decision]``: constants of the equations above; rates are per second."""

    period_s: Positive = Field(2.0, description="time between two decisions of the executive layer")
    weight_continuing: NotNegative = Field(0.1, description="weight of the motivation to continue")
    weight_external: NotNegative = Field(2.0, description="weight of the motivation to respond to influence signals")
    gain_per_s: NotNegative = Field(1.0, description="satisfaction gained per second of progress")
    tedium_per_s: float = Field(-1.8, le=0.0, description="satisfaction change per second without progress")
    dismay_per_s: float = Field(-2.0, le=0.0, description="satisfaction change per second of setback")
    fade_per_s: NotNegative = Field(0.5, description="rate at which satisfaction in an idle role returns to 0")
    signal_memory_frames: Positive = Field(8.5, description="TDMA frames in which a received signal fades to 1/e")

    def contradictions(self) -> Iterator[tuple[str, str]]:
        """Yield weights with which a vehicle could never leave its current activity."""
        if self.weight_continuing >= 1.0 + self.weight_external:
            yield (
                "weight_continuing",
                f"must be below {1.0 + self.weight_external:g} = 1 + weight_external; else a vehicle could never leave "
                "its activity, whatever is pending and whichever peer requests help",
            )

    def constants(self, frame_s: float) -> DecisionConstants:
        """Return the constants for a TDMA frame of ``frame_s`` seconds."""
        return DecisionConstants(**dict(self), signal_memory_s=self.signal_memory_frames * frame_s)


class DecisionConstants(DecisionTable):
    """Constants of the table plus ``signal_memory_s`` (tau), which follows from the TDMA frame."""

    signal_memory_s: Positive = 60.0


def evolved(satisfaction: float, advance: float | None, dt_s: float, constants: DecisionConstants) -> float:
    """Return personal satisfaction, -128..127, after ``dt_s``.

    ``advance`` is the progress of the role's objective, -1..1; None if the role is not pursued.

    >>> evolved(126.5, 1.0, 1.0, DecisionConstants())
    127
    >>> evolved(0.0, 0.5, 10.0, DecisionConstants(gain_per_s=1.0, tedium_per_s=-2.0))
    -5.0
    >>> evolved(0.25, None, 1.0, DecisionConstants())
    0.0
    """
    if advance is None:
        fade = constants.fade_per_s * dt_s
        return satisfaction - fade if satisfaction > fade else satisfaction + fade if satisfaction < -fade else 0.0
    towards = constants.gain_per_s if advance >= 0.0 else constants.dismay_per_s
    share = abs(advance)
    value = satisfaction + (share * towards + (1.0 - share) * constants.tedium_per_s) * dt_s
    return LOWEST if value < LOWEST else HIGHEST if value > HIGHEST else value


def signal_of(satisfaction: float) -> int:
    """Return the signed byte that encodes a satisfaction."""
    return max(LOWEST, min(HIGHEST, round(satisfaction)))


def call(value: int, age_s: float, constants: DecisionConstants) -> float:
    """Return the strength 0..1 of a call for help: dissatisfaction, faded with age."""
    return -value / 128.0 * exp(-age_s / constants.signal_memory_s) if value < 0 else 0.0


def contentment(stimulus: float, satisfaction: float) -> float:
    """Return satisfaction with own work, 0..1: remaining work times satisfaction in the role.

    >>> contentment(0.5, 127.0), contentment(1.0, -20.0)
    (0.5, 0.0)
    """
    return stimulus * max(0.0, satisfaction) / HIGHEST


def answered(strongest_call: float, answers: float, own: float) -> float:
    """Return the effect 0..1 of a call: its strength times effect of responding, minus ``own``.

    Altruism by Simonin and Ferber: a vehicle responds to a call stronger than its own satisfaction, all 0..1.

    >>> answered(0.75, 1.0, 0.25), answered(0.75, 0.25, 0.25)
    (0.5, 0.0)
    """
    return max(0.0, strongest_call * answers - own)


def motivation(
    importance: float,
    stimulus: float,
    satisfaction: float | None,
    heeded: float,
    constants: DecisionConstants,
) -> float:
    """Return the motivation of an activity.

    ``satisfaction`` is that in its role while performed, else None; ``heeded`` the effect of calls, 0..1
    (``answered``), 0 for individual and vital activities.

    >>> motivation(0.5, 1.0, 127.0, 0.0, DecisionConstants(weight_continuing=0.25))
    0.75
    """
    if stimulus <= 0.0:
        return 0.0
    value = importance * stimulus + constants.weight_external * heeded
    if satisfaction is not None:
        value += constants.weight_continuing * (satisfaction - LOWEST) / (HIGHEST - LOWEST)
    return value
