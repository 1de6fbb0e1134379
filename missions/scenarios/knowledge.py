"""World model of a scenario: ontologies, pruning, pending blocks.

Ontology files become part of the scenario (``worldmodel.ontology_text``), so that runs are repeated without the files.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import Field, create_model

from missions.errors import ConfigurationError, ConfigurationFault, one_of
from missions.files import is_file, shown, text_of
from remoras.mission import Mission
from remoras.table import NotNegative, Positive, Section, Sparse
from worldmodel import OntologyError, PruneRule, Source, TBox, core_ontology_paths, read_tbox
from worldmodel.holdings import WAITING_BLOCKS, WAITING_S, prunable

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario

KEY = "worldmodel.ontology"


def words_of(texts: Mapping[str, str], mission: type[Mission]) -> TBox:
    """Return the ontology of a scenario and its mission; raise OntologyError if invalid."""
    return read_tbox(*core_ontology_paths(), *mission.vocabulary, *sources_of(texts))


def words_in(scenario: Scenario, mission: type[Mission]) -> TBox | None:
    """Return the ontology of a scenario under validation; None if invalid, reported elsewhere."""
    try:
        return words_of(scenario.worldmodel.ontology_text, mission)
    except (OntologyError, OSError):
        return None


def sources_of(texts: Mapping[str, str]) -> tuple[Source, ...]:
    """Return the ontology files of a scenario from their texts."""
    return tuple(Source(name, text) for name, text in texts.items())


def with_ontologies(table: WorldModelTable, folder: Path) -> tuple[WorldModelTable, list[ConfigurationFault]]:
    """Read the named ontology files without known text; return faults of the names."""
    names, texts = table.ontology, table.ontology_text
    faults, read = [], dict[str, str]()
    for name in names:
        # A known text wins over the file, which may have changed since the run.
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
    return table.model_copy(update={"ontology_text": read}), faults


def vocabulary_faults(scenario: Scenario, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Yield faults of the ontology files, alone and combined."""
    texts = scenario.worldmodel.ontology_text
    try:
        words = words_of(texts, mission)
    except (OntologyError, OSError) as error:
        # Without own files, the fault is in the vocabulary of the mission.
        if not texts:
            allowed = f"its vocabulary cannot be read: {error}"
            yield ConfigurationFault("scenario.mission", "", allowed)
        for fault in error.faults if texts and isinstance(error, OntologyError) else ():
            name = next((text for text in texts if fault.startswith(f"{text}: ")), None)
            value = "" if name is None else shown(name)
            yield ConfigurationFault(KEY, value, fault if name is None else fault.removeprefix(f"{name}: "))
        return
    taken = scenario.taken_names() if texts else {}
    for name in (individual.name for individual in words.individuals if individual.name in taken):
        yield ConfigurationFault(KEY, shown(name), f"is the name of a {taken[name]}; rename one of them")
    classes = [ontology_class.name for ontology_class in words.classes]
    for number, rule in enumerate(scenario.worldmodel.prune, 1):
        attributes = [attribute.name for attribute in prunable(words) if not attribute.latest_only]
        entry = rule.model_dump()
        yield from one_of(f"worldmodel.prune.{number}.class", entry["class"], classes)
        yield from one_of(f"worldmodel.prune.{number}.attribute", entry["attribute"], attributes)
    known = [attribute.name for attribute in words.attributes]
    for name in scenario.communication.needs:
        for unknown in one_of(f"communication.needs.{name}", name, known):
            yield ConfigurationFault(unknown.key, "", f"no attribute of the ontology; {unknown.allowed}")


_PRUNED: dict[str, Any] = {  # `class` is a keyword
    "class": (str, Field(description="class of the instances whose values are pruned, or a superclass")),
    "attribute": (str, Field(description="attribute whose values are pruned")),
    "older_than_s": (NotNegative, Field(description="age at which they are pruned, except the newest of each vehicle")),
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
        {}, description="text of these files by name; filled in as they are read, given text is not read from the file"
    )
    waiting_s: Positive = Field(WAITING_S, description="time that a block is pending for its dependencies")
    waiting_blocks: int = Field(
        WAITING_BLOCKS, ge=1, le=65_536, description="maximum pending blocks per vehicle; the oldest is discarded"
    )
    prune: tuple[PruneTable, ...] = Field(
        (), description="pruned values, a table each; for attributes whose past values do not matter"
    )


def pruning_of(table: WorldModelTable, tbox: TBox) -> tuple[PruneRule, ...]:
    """Return the pruning rules."""
    rules = [rule.model_dump() for rule in table.prune]
    return tuple(
        PruneRule(tbox.class_named(r["class"]).uid, tbox.attribute_named(r["attribute"]).uid, r["older_than_s"])
        for r in rules
    )
