"""Satisfaction and altruism: how content a role is, and what moves an activity.

The model follows Simonin and Ferber (SAB 2000) as the REMORAS paper uses it: personal satisfaction comes from
the perceived progress of one's own task, is kept per role and told to the group as a signed byte; a
dissatisfied partner moves others to answer it. The published equations were not at hand; these are ours, and
docs/model/decision.md declares them with their constants.

Personal satisfaction P of a role, -128..127, over a time dt, with the advance a of its objective, -1..1, as fast as
planned where a = 1, standing still where a = 0, thrown back where a = -1::

    P <- clip(P + rate dt),   rate = a gain + (1 - a) tedium,         a >= 0
                                     |a| dismay + (1 - |a|) tedium,   a < 0
    P <- P moved towards 0 by at most fade dt,   if nothing is perceived of the role's advance.

Motivation of an activity of role r, from the three sources the paper names::

    importance * stimulus                               (1) importance and perception of stimuli
    + w_continuing * (P_r + 128) / 255                  (2) only while it is being performed in a role
    + w_external * max(0, C_r * answers - own)          (3) only for collective activities

    C_r = max over signals S addressed to r of max(0, -S) / 128 * exp(-age / tau)
    own = max over the individual activities performed of stimulus * max(0, P) / 127

So a call is weighed (altruism): against how content the vehicle is with work of its own, whose stimulus falls with what
is left of it, and by how much of the call would be settled by an answer.

An activity without a stimulus has no motivation at all: nobody is moved to do what cannot be done.
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
    weight_external: NotNegative = Field(2.0, description="weight of the motivation to answer influence signals")
    gain_per_s: NotNegative = Field(1.0, description="satisfaction gained per second of progress")
    tedium_per_s: float = Field(-1.8, le=0.0, description="satisfaction change per second without progress")
    dismay_per_s: float = Field(-2.0, le=0.0, description="satisfaction change per second of setback")
    fade_per_s: NotNegative = Field(0.5, description="how fast satisfaction in an idle role returns to 0")
    signal_memory_frames: Positive = Field(8.5, description="TDMA frames in which a heard signal fades to 1/e")

    def contradictions(self) -> Iterator[tuple[str, str]]:
        """Weights under which a vehicle could never leave what it performs, whatever is due and whoever calls."""
        if self.weight_continuing >= 1.0 + self.weight_external:
            yield (
                "weight_continuing",
                f"must be below {1.0 + self.weight_external:g} = 1 + weight_external; else a vehicle could never leave "
                "what it performs, whatever is due and whoever calls",
            )

    def constants(self, frame_s: float) -> DecisionConstants:
        """The constants for a TDMA frame of ``frame_s`` seconds."""
        return DecisionConstants(**dict(self), signal_memory_s=self.signal_memory_frames * frame_s)


class DecisionConstants(DecisionTable):
    """The table, with what follows from the TDMA frame; ``signal_memory_s`` is tau."""

    signal_memory_s: Positive = 60.0


def evolved(satisfaction: float, advance: float | None, dt_s: float, constants: DecisionConstants) -> float:
    """Personal satisfaction after ``dt_s``.

    Args:
        satisfaction: before, -128..127.
        advance: how fast the role's objective got on, -1..1; None if the role is not pursued.
        dt_s: for how long.
        constants: rates of change.

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
    """The signed byte by which a satisfaction is sent."""
    return max(LOWEST, min(HIGHEST, round(satisfaction)))


def call(value: int, age_s: float, constants: DecisionConstants) -> float:
    """Strength of a signal's call for help, 0..1: dissatisfaction, weaker with age.

    Args:
        value: of the signal, -128..127.
        age_s: since it was heard.
        constants: the memory of signals.
    """
    return -value / 128.0 * exp(-age_s / constants.signal_memory_s) if value < 0 else 0.0


def contentment(stimulus: float, satisfaction: float) -> float:
    """How content a vehicle is with its work, 0..1: satisfaction in its role, the less the less work is left.

    Args:
        stimulus: of the work, 0..1, which falls with what is left of it.
        satisfaction: in its role; a vehicle that is not satisfied is not content.

    >>> contentment(0.5, 127.0), contentment(1.0, -20.0)
    (0.5, 0.0)
    """
    return stimulus * max(0.0, satisfaction) / HIGHEST


def answered(strongest_call: float, answers: float, own: float) -> float:
    """What a call moves a vehicle to, 0..1: as far as answering settles it and it outweighs the own contentment.

    Simonin and Ferber's altruism: a vehicle answers a call that is stronger than its own satisfaction.

    Args:
        strongest_call: 0..1; answers: how much of it would be settled, 0..1.
        own: contentment with the own work, 0..1.

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
    """Motivation of an activity.

    Args:
        importance: of its objective; stimulus: 0..1, as perceived.
        satisfaction: of the vehicle in its role while it performs the activity; else None.
        heeded: what calls move it to, 0..1, see ``answered``; 0 for individual and vital activities.
        constants: weights.

    >>> motivation(0.5, 1.0, 127.0, 0.0, DecisionConstants(weight_continuing=0.25))
    0.75
    """
    if stimulus <= 0.0:
        return 0.0
    value = importance * stimulus + constants.weight_external * heeded
    if satisfaction is not None:
        value += constants.weight_continuing * (satisfaction - LOWEST) / (HIGHEST - LOWEST)
    return value
