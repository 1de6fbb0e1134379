"""World model of one vehicle: fixed TBox, growing set of facts, conflict-free merge."""

from worldmodel.errors import (
    FactError,
    NeedError,
    OntologyError,
    QueryError,
    UnknownNameError,
    WorldModelError,
    suggestion,
)
from worldmodel.facts import (
    EPOCHS,
    STATUS,
    Block,
    Change,
    Fault,
    FaultCode,
    Instance,
    Lacking,
    Merged,
    Observation,
    PropertyValue,
)
from worldmodel.fusion import Estimate, doubted, fused
from worldmodel.holdings import Keeping, PruneRule
from worldmodel.merge import expire, merge
from worldmodel.needs import NOBODY, PLAIN, InformationNeed, Needs, NeedsIndex, Terms, Wanted
from worldmodel.ontology import (
    core_ontology_paths,
    ontology_path,
    read_tbox,
)
from worldmodel.ontology.fields import Field, Value
from worldmodel.ontology.tbox import TYPE_UID, Attribute, OntologyClass, Source, TBox, ValueKind, reaching
from worldmodel.world_model import Knowledge, Reception, Stated, WorldModel, tidy

__all__ = [
    "EPOCHS",
    "NOBODY",
    "PLAIN",
    "STATUS",
    "TYPE_UID",
    "Attribute",
    "Block",
    "Change",
    "Estimate",
    "FactError",
    "Fault",
    "FaultCode",
    "Field",
    "InformationNeed",
    "Instance",
    "Keeping",
    "Knowledge",
    "Lacking",
    "Merged",
    "NeedError",
    "Needs",
    "NeedsIndex",
    "Observation",
    "OntologyClass",
    "OntologyError",
    "PropertyValue",
    "PruneRule",
    "QueryError",
    "Reception",
    "Source",
    "Stated",
    "TBox",
    "Terms",
    "UnknownNameError",
    "Value",
    "ValueKind",
    "Wanted",
    "WorldModel",
    "WorldModelError",
    "core_ontology_paths",
    "doubted",
    "expire",
    "fused",
    "merge",
    "ontology_path",
    "reaching",
    "read_tbox",
    "suggestion",
    "tidy",
]
