"""World model of a scenario: ontologies, pruning, waiting.

They are read once, as the scenario is: their text becomes part of it, as ``worldmodel.ontology_text``, goes into the
manifest of a run and into the keys of a sweep. So a run is read back and repeated where the files are gone or changed.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic import Field, create_model

from missions.errors import ConfigurationError, ConfigurationFault
from missions.files import is_file, shown, text_of
from missions.scenarios.tables import NotNegative, Positive, Raw, Section, Sparse, entries, one_of, table_of
from remoras.mission import Mission
from worldmodel import OntologyError, PruneRule, Source, TBox, core_ontology_paths, read_tbox
from worldmodel.arrivals import WAITING_BLOCKS, WAITING_S
from worldmodel.store import prunable

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


_PRUNED: dict[str, Any] = {  # `class` is no name of an attribute in Python
    "class": (str, Field(description="class of the instances whose values are dropped, or a class above it")),
    "attribute": (str, Field(description="attribute whose values are dropped")),
    "older_than_s": (NotNegative, Field(description="age at which they are dropped, but the newest of each vehicle")),
}
PruneTable = create_model("PruneTable", __base__=Section, __doc__="One entry of ``worldmodel.prune``.", **_PRUNED)


class WorldModelTable(Sparse):
    """The table ``[worldmodel]``."""

    UNSAID = frozenset({"waiting_s", "waiting_blocks", "prune", "ontology", "ontology_text"})

    ontology: tuple[str, ...] = Field(
        (),
        description="Turtle files with further classes and attributes, relative to this one; from an option, to the "
        "working folder",
    )
    ontology_text: dict[str, str] = Field(
        {}, description="text of these files by name; it is filled in as they are read, and what is there is not read"
    )
    waiting_s: Positive = Field(WAITING_S, description="for how long a block waits for what it rests on")
    waiting_blocks: int = Field(
        WAITING_BLOCKS, ge=1, le=65_536, description="blocks of one vehicle that may wait; the oldest is dropped"
    )
    prune: tuple[PruneTable, ...] = Field(
        (), description="old values that vehicles drop, a table each; for attributes whose past values do not matter"
    )


def pruning_of(table: WorldModelTable, tbox: TBox) -> tuple[PruneRule, ...]:
    """What vehicles drop."""
    rules = [rule.model_dump() for rule in table.prune]
    return tuple(
        PruneRule(tbox.class_named(r["class"]).uid, tbox.attribute_named(r["attribute"]).uid, r["older_than_s"])
        for r in rules
    )


def knowledge_faults(raw: Raw, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Rules of pruning for what the ontology does not have."""
    rules = entries(table_of(raw, "worldmodel"), "prune")
    if not rules:
        return
    try:
        tbox = words_of(raw, mission)
    except (OntologyError, OSError):
        return  # reported elsewhere
    classes = [ontology_class.name for ontology_class in tbox.classes]
    attributes = [attribute.name for attribute in prunable(tbox) if not attribute.latest_only]
    for number, rule in enumerate(rules, 1):
        yield from one_of(f"worldmodel.prune.{number}.class", rule.get("class"), classes)
        yield from one_of(f"worldmodel.prune.{number}.attribute", rule.get("attribute"), attributes)
