"""Receivers: a plan cut into parts by the vehicles that it concerns, where a packet does not take it whole.

A block goes in whole or not at all. Cut anywhere, a large plan would begin for nobody before its last fragment is
heard. So each vehicle that is given work has a part of its own, with all that it needs to begin: its roles, and what
their holders pursue on their own. What concerns several vehicles, such as how they come together, is said last.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from remoras.activities import Objective
from remoras.beliefs import Beliefs, Fact
from remoras.social.consultation import OBJECTIVE_PREFIX
from worldmodel import PropertyValue

PLAYS = "playsRole"


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
    said = [(fact, role_named(PropertyValue(*fact)) or ("", "")) for fact in facts]
    players: dict[str, list[str]] = {}  # by role
    parts: dict[str, list[Fact]] = {}
    for (subject, _, _), (attribute, role) in said:
        if attribute == PLAYS:
            players.setdefault(role, []).append(beliefs.name(subject))
            parts.setdefault(beliefs.name(subject), [])
    shared: list[Fact] = []
    for fact, (attribute, role) in said:
        receivers: Iterable[str] = players.get(role, ())
        if attribute == PLAYS:
            receivers = (beliefs.name(fact[0]),)
        elif attribute.startswith(OBJECTIVE_PREFIX):
            objective = Objective(*role.split("."), attribute.removeprefix(OBJECTIVE_PREFIX), beliefs.name(fact[2]))
            receivers = receivers if is_individual(objective) else ()
        for name in receivers:
            parts[name].append(fact)
        if not receivers:
            shared.append(fact)
    return [part for part in (*parts.values(), shared) if part]
