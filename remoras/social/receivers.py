"""Receivers: a plan cut into parts by the vehicles that it concerns, where a packet does not take it whole.

A block goes in whole or not at all. Cut anywhere, a large plan would begin for nobody before its last fragment is
heard. So each vehicle that is given work has a part of its own, with all that it needs to begin: its roles, and what
their holders pursue on their own. Then comes what concerns all, such as where to meet, and last what the holders of
new roles pursue together.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence

from remoras.activities import Objective
from remoras.beliefs import Beliefs, Fact
from remoras.mission import SocialPart
from remoras.social.requests import OBJECTIVE_PREFIX
from remoras.social.succession import PLAYS_ROLE
from worldmodel import PropertyValue


def by_receiver(
    facts: Sequence[Fact],
    beliefs: Beliefs,
    role_named: Callable[[PropertyValue], tuple[str, str] | None],
    is_individual: Callable[[Objective], bool],
) -> list[list[Fact]]:
    """The same facts in parts, those of single vehicles first, in the order in which these are given roles.

    An individual objective is in the part of each vehicle that is given its role.

    Args:
        facts: that a plan comes down to.
        beliefs: of the vehicle, for names.
        role_named: attribute and role of an organisational fact; None for any other fact.
        is_individual: True for objectives that a vehicle pursues without others.
    """
    named = [(fact, role_named(PropertyValue(*fact)) or ("", "")) for fact in facts]
    players: dict[str, list[str]] = {}  # by role
    parts: dict[str, list[Fact]] = {}
    for (subject, *_), (attribute, role) in named:
        if attribute == PLAYS_ROLE:
            players.setdefault(role, []).append(beliefs.name(subject))
            parts.setdefault(beliefs.name(subject), [])
    shared: list[Fact] = []
    together: list[Fact] = []
    for fact, (attribute, role) in named:
        if attribute == PLAYS_ROLE:
            parts[beliefs.name(fact[0])].append(fact)
        elif role not in players or not attribute.startswith(OBJECTIVE_PREFIX):
            shared.append(fact)
        elif is_individual(_objective(role, attribute, beliefs.name(fact[2]))):
            for name in players[role]:
                parts[name].append(fact)
        else:
            together.append(fact)
    return [part for part in (*parts.values(), shared, together) if part]


def _objective(path: str, attribute: str, argument: str) -> Objective:
    group, role = path.split(".")
    return Objective(group, role, attribute.removeprefix(OBJECTIVE_PREFIX), argument)


def aims(
    facts: Iterable[tuple[str, str, object]],
    objectives: Iterable[Objective],
    founding: Collection[Objective],
    beliefs: Beliefs,
    mission: SocialPart,
) -> list[Fact]:
    """Individual objectives of the roles given in ``facts``: whoever gets such a role may not have heard of them.

    Args:
        facts: stated of vehicles, by names.
        objectives: that count.
        founding: those agreed before the dive, of which everybody knows.
        beliefs: of the vehicle.
        mission: says which objectives a vehicle pursues without others.
    """
    roles = [value for _, attribute, value in facts if attribute == PLAYS_ROLE]
    if not roles:
        return []
    return [
        beliefs.fact(f"{objective.group}.{objective.role}", OBJECTIVE_PREFIX + objective.name, objective.argument)
        for objective in objectives
        if objective not in founding
        and f"{objective.group}.{objective.role}" in roles
        and mission.is_individual(objective)
    ]
