"""Factors: what strategies differ in, so that a study can cross it, one factor at a time.

A shipped strategy is a point of this table by name. Factors that are switches of shared parts are parameters of the
strategies that share them; the others are fixed by the part that decides, and are refused by name where they are set.

===============  ===============================================  =================================================
factor           levels                                           set by
===============  ===============================================  =================================================
``common_plan``  ``none``, ``missions``, ``jobs``                 ``common_plan``, where somebody decides at sea
``decides``      ``head``, ``each``, ``all``, ``nobody``          the choice of the strategy
``plan``         ``all``, ``own``                                 ``plans_for_all``, ``looks_ahead``
``announces``    ``plan``, ``next-jobs``, ``claims``, ``bids``,   ``announces`` of a head
                 ``states``, ``meetings``, ``nothing``
``helps``        ``yes``, ``no``                                  ``help_s``: ``NO_HELP_S`` sends nobody
``repairs``      ``changes``, ``calls``, ``never``                ``repairs`` of a head
===============  ===============================================  =================================================
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Annotated, Literal

from pydantic import Field

from remoras.strategy import OBJECTIVE, Declaration, Strategy

ALL = 64
"""Queue of a head that gives out all it has planned."""
NO_HELP_S = 1e6
"""No help saves as much, so nobody is sent."""

AtSea = Annotated[
    Literal["none", "missions"],
    Field(description="what all know at 0 s: nothing, or the missions and objectives of all groups"),
]
"""``common_plan`` of strategies that divide jobs at sea."""
CommonPlan = Annotated[
    Literal["none", "missions", "jobs"],
    Field(description="what all know at 0 s: nothing, missions and objectives, or who does which job too"),
]
"""``common_plan`` of strategies of which the head plans."""
Repairs = Annotated[
    Literal["changes", "calls", "never"],
    Field(description="when the head mends the plan: as something changes, as somebody without work calls, or never"),
]

Announces = Annotated[
    Literal["plan", "next-jobs"],
    Field(description="what a head tells each vehicle: all of its part of the plan, or its next jobs only"),
]

MISSIONS_AT_SEA = {
    "hasMission": "a head gives another group its mission",
    "playsRole": "a head gives a member a role",
    OBJECTIVE: "a head gives a role an objective",
}
"""What has to be told where missions are not known at 0 s."""


@dataclass(frozen=True, slots=True)
class Factors:
    """The levels of a strategy.

    Attributes:
        common_plan: what all know at 0 s: ``none``; ``missions``: those of the groups, with objectives and roles
            without a job; ``jobs``: who does which job, too.
        decides: who decides at sea which job is whose: the ``head``, ``each`` for itself by bids, ``all`` alike by the
            same plan, ``nobody``.
        plan: decisions rest on a plan of the jobs of ``all``, or on the ``own`` gain.
        announces: what is told of it.
        helps: vehicles without work are sent to others' jobs.
        repairs: when a plan is mended: on ``changes``, on ``calls`` for work, ``never``.
    """

    common_plan: str
    decides: str
    plan: str
    announces: str
    helps: str
    repairs: str


SETTINGS: Mapping[str, tuple[str, ...]] = {
    "common_plan": ("common_plan",),
    "decides": (),
    "plan": ("plans_for_all", "looks_ahead"),
    "announces": ("announces",),
    "helps": ("help_s",),
    "repairs": ("repairs",),
}
"""Parameters that set each factor, where a strategy has one of them."""
assert tuple(SETTINGS) == tuple(field.name for field in fields(Factors))


def factors_of(strategy: Strategy) -> Factors | None:
    """The levels of a strategy; None if it states none, as an upper bound or a user's own."""
    levels: Factors | None = getattr(strategy, "factors", None)
    return levels


def helps(help_s: float) -> str:
    """The level of ``helps`` of a parameter ``help_s``."""
    return "no" if help_s >= NO_HELP_S else "yes"


def known_from(common_plan: str, declaration: Declaration) -> Declaration:
    """A declaration of a strategy whose missions are planned before, as it is with that ``common_plan``."""
    if common_plan != "none":
        return declaration
    return replace(declaration, planned_before=False, messages={**MISSIONS_AT_SEA, **declaration.messages})


def refusal(strategy: Strategy, name: str, others: Mapping[str, Strategy]) -> str | None:
    """What is said to whoever sets a factor that is no parameter of the strategy; None if ``name`` is no factor.

    Args:
        strategy, name: what was set, of what.
        others: all shipped strategies by name.
    """
    own = factors_of(strategy)
    if own is None or name not in SETTINGS:
        return None
    settable = [key for key in SETTINGS[name] if hasattr(strategy, key)]
    if settable:
        return f"{strategy.name} sets {name} by {settable[0]}"
    levels: dict[str, list[str]] = {}
    for other in others.values():
        if (theirs := factors_of(other)) is not None and getattr(theirs, name) != getattr(own, name):
            levels.setdefault(getattr(theirs, name), []).append(other.name)
    elsewhere = "; ".join(f'"{level}" has {", ".join(names)}' for level, names in levels.items())
    return f'{strategy.name} has "{getattr(own, name)}" alone; {elsewhere}'
