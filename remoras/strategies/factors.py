"""Factors: dimensions of strategies, for factorial studies (``docs/strategies.md``)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Annotated, Literal

from pydantic import Field

from remoras.strategy import INFLUENCE_SIGNAL, OBJECTIVE, Declaration, HelpBy, Strategy

ALL = 64
"""Queue of a leader that sends its whole plan."""
NO_JOIN_S = 1e6
"""Saving (s) that no vehicle reaches by joining a job: disables joining."""

AtSea = Annotated[
    Literal["none", "missions"],
    Field(description="common knowledge at 0 s: none, or missions and objectives of all groups"),
]
"""``common_plan`` of strategies that divide jobs at run time."""
CommonPlan = Annotated[
    Literal["none", "missions", "jobs"],
    Field(description="common knowledge at 0 s: none, missions and objectives, or also the job assignment"),
]
"""``common_plan`` of strategies with a planning leader."""
Repairs = Annotated[
    Literal["changes", "calls", "never"],
    Field(description="when the leader repairs the plan: on changes, on a call by an idle vehicle, or never"),
]

Help = Annotated[
    HelpBy,
    Field(description="how a vehicle that waits for another gets help: none, by influence signals, or by an auction"),
]
Announces = Annotated[
    Literal["plan", "next-jobs"],
    Field(description="messages of a leader to each vehicle: its whole part of the plan, or only its next jobs"),
]

MISSIONS_AT_SEA = {
    "hasMission": "a head gives another group its mission",
    "playsRole": "a head gives a member a role",
    OBJECTIVE: "a head gives a role an objective",
}
"""Messages needed if missions are unknown at 0 s."""
HELP_MESSAGES: Mapping[str, Mapping[str, str]] = {
    "none": {},
    "calls": {INFLUENCE_SIGNAL: "one signed byte for every role that the sender plays, in every slot"},
    "auction": {
        "seeksHelp": "the sender's job waits for another vehicle; not acknowledged",
        "helpBid": "how much of the wait the sender would end; not acknowledged",
        "isToHelp": "award by the waiting vehicle; not acknowledged",
    },
}


@dataclass(frozen=True, slots=True)
class Factors:
    """Factor levels of a strategy.

    ``common_plan`` at 0 s: ``none``; ``missions`` with objectives and roles without jobs; ``jobs``: assignments too. On
    assignments at run time ``decides`` the ``head``, ``each`` vehicle by bids, ``all`` by an identical plan, or
    ``nobody``. The ``plan`` behind it is for ``all`` jobs, or maximises the ``own`` gain. ``announces`` is the content
    of the messages. ``joins``: idle vehicles take part in others' jobs. ``repairs``: on ``changes``, on ``calls`` for
    work, or ``never``. ``help`` for a vehicle that waits for another: ``none``, by ``calls``, or by ``auction``.
    """

    common_plan: str
    decides: str
    plan: str
    announces: str
    joins: str
    repairs: str
    help: str = "none"


SETTINGS: Mapping[str, tuple[str, ...]] = {
    "common_plan": ("common_plan",),
    "decides": (),
    "plan": ("plans_for_all", "looks_ahead"),
    "announces": ("announces",),
    "joins": ("join_s",),
    "repairs": ("repairs",),
    "help": ("help",),
}
"""Parameters that set each factor, for strategies with that parameter."""
assert tuple(SETTINGS) == tuple(field.name for field in fields(Factors))


def factors_of(strategy: Strategy) -> Factors | None:
    """Return the levels of a strategy; None if it declares none, such as an upper bound."""
    levels: Factors | None = getattr(strategy, "factors", None)
    return levels


def joins(join_s: float) -> str:
    """Return the level of ``joins`` for a parameter ``join_s`` (s)."""
    return "no" if join_s >= NO_JOIN_S else "yes"


def helped_by(help: HelpBy, declaration: Declaration) -> Declaration:
    """Adapt a declaration to the factor ``help``."""
    messages = {**declaration.messages, **HELP_MESSAGES[help]}
    n_blocks = declaration.blocks_per_round + (help == "auction")
    return replace(declaration, help=help, messages=messages, blocks_per_round=n_blocks)


def known_from(common_plan: str, declaration: Declaration) -> Declaration:
    """Adapt a declaration to ``common_plan``: ``none`` adds the messages that send missions."""
    if common_plan != "none":
        return declaration
    return replace(declaration, planned_before=False, messages={**MISSIONS_AT_SEA, **declaration.messages})


def refusal(strategy: Strategy, name: str, others: Mapping[str, Strategy]) -> str | None:
    """Explain why a factor is no parameter of the strategy; None if ``name`` is no factor."""
    own = factors_of(strategy)
    if own is None or name not in SETTINGS:
        return None
    parameters: list[str] = [field.name for field in fields(strategy)] if is_dataclass(strategy) else []
    settable = [key for key in SETTINGS[name] if key in parameters]
    if settable:
        return f"{strategy.name} sets {name} by {settable[0]}"
    levels: dict[str, list[str]] = {}
    for other in others.values():
        if (theirs := factors_of(other)) is not None and getattr(theirs, name) != getattr(own, name):
            levels.setdefault(getattr(theirs, name), []).append(other.name)
    elsewhere = "; ".join(f'"{level}" has {", ".join(names)}' for level, names in levels.items())
    return f'{strategy.name} has "{getattr(own, name)}" alone; {elsewhere}'
