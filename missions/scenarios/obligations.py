"""Obligations of groups: ``[[group.obligation]]``, and what has to hold between them and the rest."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Protocol

from pydantic import Field

from missions.errors import ConfigurationFault
from missions.scenarios.ontologies import words_of
from missions.scenarios.tables import Positive, Raw, Section, entries, names_of, one_of
from remoras.mission import Mission
from remoras.obligations import Obligation
from worldmodel import OntologyError

PREFIX = "objective"
"""Attributes of roles whose name begins so are objectives."""


class ObligationTable(Section):
    """One ``[[group.obligation]]``."""

    role: str = Field(description="role of the group whose holders owe it")
    objective: str = Field(description="objective of the role that has to be reached")
    deadline_s: Positive = Field(description="time of the mission by which it has to be")


class _Owing(Protocol):
    """A group whose roles owe something."""

    @property
    def name(self) -> str: ...

    @property
    def obligation(self) -> Sequence[ObligationTable]: ...


class _WithGroups(Protocol):
    @property
    def group(self) -> Sequence[_Owing]: ...


def obligations_of(scenario: _WithGroups) -> tuple[Obligation, ...]:
    """The obligations of all groups."""
    return tuple(
        Obligation(group.name, one.role, one.objective, one.deadline_s)
        for group in scenario.group
        for one in group.obligation
    )


def obligation_faults(raw: Raw, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Obligations of roles that the group has not, for objectives that there are not, or said twice."""
    groups = [group for group in entries(raw, "group") if entries(group, "obligation")]
    if not groups:
        return
    known = _objectives(raw, mission)
    for group in groups:
        said: dict[tuple[str, str], int] = {}
        for number, one in enumerate(entries(group, "obligation"), 1):
            key = f"group.{group.get('name')}.obligation.{number}"
            yield from one_of(f"{key}.role", one.get("role"), names_of(group, "role"))
            yield from one_of(f"{key}.objective", one.get("objective"), known)
            about = str(one.get("role")), str(one.get("objective"))
            if said.setdefault(about, number) != number:
                allowed = f"{about[0]} has an obligation for {about[1]} already, number {said[about]}: leave one out"
                yield ConfigurationFault(f"{key}.objective", f'"{about[1]}"', allowed)


def _objectives(raw: Raw, mission: type[Mission]) -> list[str]:
    """Names of the objectives that the ontology of a scenario has."""
    try:
        tbox = words_of(raw, mission)
    except (OntologyError, OSError):
        return []  # reported elsewhere
    names = (attribute.name for attribute in tbox.attributes if attribute.name.startswith(PREFIX))
    return sorted(name.removeprefix(PREFIX) for name in names)
