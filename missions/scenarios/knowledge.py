"""What vehicles keep in their world models: ``[worldmodel]``, and what has to hold between it and the ontology."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pydantic import Field, create_model

from missions.errors import ConfigurationFault
from missions.scenarios.ontologies import words_of
from missions.scenarios.tables import NotNegative, Positive, Raw, Section, Sparse, entries, one_of, table_of
from remoras.mission import Mission
from worldmodel import OntologyError, PruneRule, TBox
from worldmodel.arrivals import WAITING_BLOCKS, WAITING_S
from worldmodel.store import prunable

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
