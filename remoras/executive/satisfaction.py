"""Satisfaction and altruism: how content a role is, and what moves an activity.

The model follows Simonin and Ferber (SAB 2000) as the REMORAS paper uses it: personal satisfaction comes from
the perceived progress of one's own task, is kept per role and told to the group as a signed byte; a
dissatisfied partner moves others to answer it. The published equations were not at hand; these are ours, and
docs/model.md declares them with their constants.

Personal satisfaction P of a role, -128..127, over a time dt::

    P <- clip(P + rate dt),   rate = gain    if the role's activities progress,
                                     tedium  if they are pursued and stand still,
                                     dismay  if they are thrown back,
    P <- P moved towards 0 by at most fade dt,   if the role is not pursued.

Motivation of an activity of role r, from the three sources the paper names::

    importance * stimulus                               (1) importance and perception of stimuli
    + w_continuing * (P_r + 128) / 255                  (2) only while it is being performed
    + w_external * max over signals S addressed to r of
                   max(0, -S) / 128 * exp(-age / tau)   (3) only for collective activities

An activity without a stimulus has no motivation at all: nobody is moved to do what cannot be done.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

LOWEST, HIGHEST = -128, 127


class Advance(IntEnum):
    """How a role's activities get on; of several in one role the greatest counts."""

    NONE = 0
    BACKWARD = 1
    FORWARD = 2


@dataclass(frozen=True, slots=True)
class DecisionConstants:
    """Constants of the equations above; rates are per second and ``signal_memory_s`` is tau.

    Attributes:
        period_s: a decision is made this often, and at once when something has to be planned.
    """

    period_s: float = 2.0
    weight_continuing: float = 0.2
    weight_external: float = 1.0
    gain_per_s: float = 1.0
    tedium_per_s: float = -1.8
    dismay_per_s: float = -2.0
    fade_per_s: float = 0.5
    signal_memory_s: float = 60.0


def clipped(value: float) -> float:
    """The nearest value within -128..127."""
    return LOWEST if value < LOWEST else HIGHEST if value > HIGHEST else value


def evolved(satisfaction: float, advance: Advance | None, dt_s: float, constants: DecisionConstants) -> float:
    """Personal satisfaction after ``dt_s``.

    Args:
        satisfaction: before, -128..127.
        advance: how the role's activities got on; None if the role is not pursued.
        dt_s: how long they did.
        constants: rates of change.

    >>> evolved(126.5, Advance.FORWARD, 1.0, DecisionConstants())
    127
    >>> evolved(0.25, None, 1.0, DecisionConstants())
    0.0
    """
    if advance is Advance.FORWARD:
        return clipped(satisfaction + constants.gain_per_s * dt_s)
    if advance is Advance.NONE:
        return clipped(satisfaction + constants.tedium_per_s * dt_s)
    if advance is Advance.BACKWARD:
        return clipped(satisfaction + constants.dismay_per_s * dt_s)
    fade = constants.fade_per_s * dt_s
    return satisfaction - fade if satisfaction > fade else satisfaction + fade if satisfaction < -fade else 0.0


def signal_of(satisfaction: float) -> int:
    """The signed byte by which a satisfaction is sent."""
    return int(clipped(round(satisfaction)))


def call(value: int, age_s: float, constants: DecisionConstants) -> float:
    """Strength of a signal's call for help, 0..1: dissatisfaction, weaker with age.

    Args:
        value: of the signal, -128..127.
        age_s: since it was heard.
        constants: the memory of signals.
    """
    return -value / 128.0 * math.exp(-age_s / constants.signal_memory_s) if value < 0 else 0.0


def motivation(
    importance: float,
    stimulus: float,
    performed: bool,
    satisfaction: float,
    strongest_call: float,
    constants: DecisionConstants,
) -> float:
    """Motivation of an activity.

    Args:
        importance: of its objective; stimulus: 0..1, as perceived.
        performed: True if the vehicle is performing it.
        satisfaction: of the vehicle in its role.
        strongest_call: of the signals that address its role, 0..1; 0 for individual and vital activities.
        constants: weights.

    >>> motivation(0.5, 1.0, True, 127.0, 0.0, DecisionConstants(weight_continuing=0.2))
    0.7
    """
    if stimulus <= 0.0:
        return 0.0
    value = importance * stimulus + constants.weight_external * strongest_call
    if performed:
        value += constants.weight_continuing * (satisfaction - LOWEST) / (HIGHEST - LOWEST)
    return value
