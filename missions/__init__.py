"""Missions: ``scenarios`` reads and checks input, ``runs`` runs one, ``sweeps`` a study, ``comparison`` its results."""

from missions.errors import (
    ClusterError,
    ConfigurationError,
    ConfigurationFault,
    DiskFullError,
    MissionsError,
    OutputError,
    StudyChangedError,
)
from missions.metric import Better, Metric

__all__ = [
    "Better",
    "ClusterError",
    "ConfigurationError",
    "ConfigurationFault",
    "DiskFullError",
    "Metric",
    "MissionsError",
    "OutputError",
    "StudyChangedError",
]
