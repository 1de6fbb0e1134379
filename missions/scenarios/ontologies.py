"""Ontology files that a scenario names: ``worldmodel.ontology``, read beside the core ontology and the mission's words.

They are read once, as the scenario is: their text becomes part of it, as ``worldmodel.ontology_text``, goes into the
manifest of a run and into the keys of a sweep. So a run is read back and repeated where the files are gone or changed.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from missions.errors import ConfigurationError, ConfigurationFault
from missions.files import is_file, shown, text_of
from missions.scenarios.tables import Raw, entries, table_of
from remoras.mission import Mission
from worldmodel import OntologyError, Source, TBox, core_ontology_paths, read_tbox

TABLE, FILES, TEXTS = "worldmodel", "ontology", "ontology_text"
KEY = f"{TABLE}.{FILES}"


def with_ontologies(raw: Raw, folder: Path) -> tuple[Raw, list[ConfigurationFault]]:
    """The tables with the text of the ontology files that they name, and what is wrong with the names.

    Args:
        raw: the tables as TOML has them.
        folder: what names of files are relative to; a file whose text is there already is not read.
    """
    table = table_of(raw, TABLE)
    names, texts = table.get(FILES), table.get(TEXTS, {})
    if names is None and not texts:
        return raw, []
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names) or not isinstance(texts, dict):
        return raw, []  # reported as malformed
    faults, read = [], dict[str, Any]()
    for name in names:
        if name in texts:
            read[name] = texts[name]
        elif not is_file(path := folder / name):
            allowed = f"there is no file {path}; allowed: names of Turtle files"
            faults.append(ConfigurationFault(KEY, shown(name), allowed))
        else:
            try:
                read[name] = text_of(path)
            except ConfigurationError as error:
                faults += [ConfigurationFault(KEY, shown(name), fault.allowed) for fault in error.faults]
    for name in sorted(texts.keys() - read.keys() - set(names)):
        allowed = f"the text of no file; allowed: names in {KEY}, which are {', '.join(names) or 'none'}"
        faults.append(ConfigurationFault(f"{TABLE}.{TEXTS}", shown(name), allowed))
    return {**raw, TABLE: {**table, TEXTS: read}} if read else raw, faults


def sources_of(texts: Raw) -> tuple[Source, ...]:
    """The ontology files of a scenario, from their texts by name."""
    return tuple(Source(name, text) for name, text in texts.items() if isinstance(text, str))


def words_of(raw: Raw, mission: type[Mission]) -> TBox:
    """The ontology of a scenario with all that its mission may say.

    Raises:
        OntologyError: a file is wrong.
    """
    own = sources_of(table_of(table_of(raw, TABLE), TEXTS))
    return read_tbox(*core_ontology_paths(), *mission.vocabulary, *own)


def _names_twice(raw: Raw, words: TBox) -> Iterator[ConfigurationFault]:
    """Individuals of the ontology that are called like something of the scenario."""
    taken = {entry.get("name"): table for table in ("vehicle", "group", "rally_point") for entry in entries(raw, table)}
    for name in (individual.name for individual in words.individuals if individual.name in taken):
        yield ConfigurationFault(KEY, shown(name), f"is the name of a {taken[name]}; allowed: names of their own")


def ontology_faults(raw: Raw, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """What is wrong with the ontology files that a scenario names, in themselves or beside the others."""
    texts = table_of(table_of(raw, TABLE), TEXTS)
    if not texts:
        return
    try:
        words = words_of(raw, mission)
        yield from _names_twice(raw, words)
    except OntologyError as error:
        for fault in error.faults:
            name = next((text for text in texts if fault.startswith(f"{text}: ")), None)
            given = "" if name is None else shown(name)
            yield ConfigurationFault(KEY, given, fault if name is None else fault.removeprefix(f"{name}: "))
