"""What one vehicle knows of the world: a fixed TBox, a growing ABox, and their merging without conflict."""

from worldmodel.abox import Holdings, WorldModel
from worldmodel.checks import CheckResult, check
from worldmodel.errors import FactError, NeedError, OntologyError, UnknownNameError, WorldModelError, suggestion
from worldmodel.facts import (
    Block,
    Change,
    Fault,
    FaultCode,
    Guid,
    Instance,
    Observation,
    PropertyValue,
)
from worldmodel.fields import Field, Grid
from worldmodel.merge import Merged, merge
from worldmodel.needs import InformationNeed, NeedsIndex
from worldmodel.tbox import TYPE_UID, Attribute, OntologyClass, TBox, Value, ValueKind, core_ontology_paths

__all__ = [
    "TYPE_UID",
    "Attribute",
    "Block",
    "Change",
    "CheckResult",
    "FactError",
    "Fault",
    "FaultCode",
    "Field",
    "Grid",
    "Guid",
    "Holdings",
    "InformationNeed",
    "Instance",
    "Merged",
    "NeedError",
    "NeedsIndex",
    "Observation",
    "OntologyClass",
    "OntologyError",
    "PropertyValue",
    "TBox",
    "UnknownNameError",
    "Value",
    "ValueKind",
    "WorldModel",
    "WorldModelError",
    "check",
    "core_ontology_paths",
    "merge",
    "suggestion",
]
