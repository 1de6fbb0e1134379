"""The shipped invariants, those of missions and those that a user names."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

from missions.errors import ConfigurationError, ConfigurationFault
from missions.scenarios.named import importable
from missions.scenarios.parts import mission_class
from missions.scenarios.scenario import Scenario
from remoras.errors import PluginError
from remoras.plugins import faults_of, named_object
from stress.follows import Follows
from stress.invariants import ending, knowledge, motion, organisation, record
from stress.invariants.seam import Invariant, Moment

SHIPPED: tuple[type[Invariant], ...] = (
    ending.NoException, knowledge.TrueBeliefs, knowledge.Recorded, knowledge.WholeBlocks, knowledge.Remembered,
    knowledge.OneContent, knowledge.NewestCounts, knowledge.Past, knowledge.SoundPackets, knowledge.KnowledgeAgreement,
    knowledge.Rest, organisation.OnlyAuthorised, organisation.Cardinality, motion.Finite, motion.Borders, motion.Speed,
    motion.Energy, motion.SeparationKept, ending.TrueVerdict, record.WholeTables, ending.SummaryOfTables,
    Follows, ending.Ends, ending.Finishes, ending.SameDigest,
)  # fmt: skip
"""In the order of tables."""


def invariants_of(scenario: Scenario, added: Sequence[str] = ()) -> tuple[type[Invariant], ...]:
    """All invariants of the runs of a scenario.

    Args:
        scenario: whose mission may declare some.
        added: ``package.module:object`` or ``file.py:object``.

    Raises:
        ConfigurationError: one cannot be loaded, or lacks a part.
    """
    own: tuple[type[Invariant], ...] = mission_class(scenario.scenario.mission).invariants
    return (*SHIPPED, *own, *map(_named, added))


def _named(given: str) -> type[Invariant]:
    """The class of an invariant that a user names."""
    try:
        found: Any = named_object(importable(given))
    except PluginError as error:
        reason = str(error)
        hint = "" if "allowed:" in reason else "; allowed: file.py:NAME or package.module:NAME"
        raise _fault(given, reason + hint) from None
    lacking = [*faults_of(found, Invariant, ("name", "moment", "not_under", "broken"))]
    if not isinstance(found, type):
        lacking.append("is no class: each run makes an object of its own")
    elif not lacking and found.moment not in list(Moment):  # type: ignore[attr-defined]
        lacking.append(f"moment is {found.moment!r}; allowed: {', '.join(Moment)}")  # type: ignore[attr-defined]
    if lacking:
        raise _fault(given, "; ".join(lacking))
    return cast("type[Invariant]", found)


def _fault(given: str, allowed: str) -> ConfigurationError:
    return ConfigurationError("remoras stress", [ConfigurationFault("--invariant", f'"{given}"', allowed)])
