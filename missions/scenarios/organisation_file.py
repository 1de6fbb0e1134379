"""Organisation files: groups in a file of their own, which a scenario names, or which is checked alone."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError

from missions.document import Document
from missions.errors import ConfigurationFault
from missions.files import LARGEST_BYTES, is_file, shown, text_of
from missions.scenarios.organisation import GROUP, ROLE, TABLES, TEMPLATE, Specification, specified
from missions.scenarios.organisation_checks import structure_faults
from missions.scenarios.scenario import GroupTable
from missions.scenarios.tables import Raw, Section, entries, names_of

ORGANISATION = "organisation"
"""Key of a scenario that names the file."""


class OrganisationTables(Section):
    """What an organisation file holds."""

    role: tuple[dict[str, Any], ...] = ()
    group_template: tuple[dict[str, Any], ...] = ()
    group: tuple[GroupTable, ...] = Field(min_length=1)


def with_organisation(document: Document) -> tuple[Document, list[ConfigurationFault]]:
    """A scenario with the tables of the organisation file that it names, or what is wrong with that.

    Args:
        document: whose key ``organisation`` names a file, relative to its own.

    Raises:
        ConfigurationError: the file cannot be read, or is not TOML.
    """
    if ORGANISATION not in document.raw:
        return document, []
    given = document.raw[ORGANISATION]
    if not isinstance(given, str):
        return document, [ConfigurationFault(ORGANISATION, shown(given), "a text: the name of a TOML file")]
    path = Path(document.path).parent / given
    if not is_file(path):
        allowed = f"there is no file {path}; allowed: a TOML file with {', '.join(TABLES)}"
        return document, [ConfigurationFault(ORGANISATION, shown(given), allowed)]
    part = Document.of_text(text_of(path, LARGEST_BYTES), str(path))
    faults = _unknown(part)
    for name in TABLES:
        if name in document.raw:
            allowed = f"given beside {ORGANISATION} = {shown(given)}, where the groups are: leave one of them out"
            faults.append(ConfigurationFault(name, "", allowed, document.line_of(name), document.path))
    if not entries(part.raw, GROUP):
        allowed = f"there is no [[group]] in {path}; allowed: a TOML file with {', '.join(TABLES)}"
        return document, [*faults, ConfigurationFault(ORGANISATION, shown(given), allowed)]
    own = {name: tables for name, tables in part.raw.items() if name in TABLES}
    return replace(document, raw={**document.raw, **own}, parts=(part,)), faults


def _unknown(part: Document) -> list[ConfigurationFault]:
    return [
        ConfigurationFault(
            name, "", f"unknown in an organisation file; allowed: {', '.join(TABLES)}", part.line_of(name), part.path
        )
        for name in part.raw
        if name not in TABLES
    ]


def is_organisation(raw: Raw) -> bool:
    """True if tables are those of an organisation file alone."""
    return bool(raw) and set(raw) <= set(TABLES)


def checked(document: Document) -> Specification:
    """An organisation file with its groups written out; a template without a group is checked as if it had one.

    What needs a scenario is not checked: rally points, jobs, who is able to play a role, and keys of a mission.

    Raises:
        ConfigurationError: with every fault of the file.
    """
    raw = document.raw
    unused = set(names_of(raw, TEMPLATE)).difference(str(entry.get("template")) for entry in entries(raw, GROUP))
    pretended = [
        {"rally_point": "", "name": f"{name} without a group", "template": name}
        for name in names_of(raw, TEMPLATE)
        if name in unused and not entries(raw, GROUP)
    ]
    listed = raw.get(GROUP, [])
    found = specified({**raw, GROUP: [*listed, *pretended]} if isinstance(listed, list) else raw)
    faults = [*_unknown(document), *found.faults, *_malformed(document, found.raw), *structure_faults(found.raw)]
    if faults:
        raise document.error(found.attributed(faults))
    return found


def _malformed(document: Document, raw: Raw) -> list[ConfigurationFault]:
    """Faults of single values; keys that a mission may have are passed over."""
    tables = {name: raw[name] for name in (ROLE, TEMPLATE, GROUP) if name in raw}
    try:
        OrganisationTables.model_validate_json(json.dumps(tables, default=str), strict=True)
    except ValidationError as error:
        return document.faults_of(error, OrganisationTables, tables, ("extra_forbidden",))
    return []
