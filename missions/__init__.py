"""Missions: scenarios and what becomes of them.

A folder for each mission; ``scenarios`` reads and checks, ``runs`` runs once, ``sweeps`` runs a study, ``comparison``
compares its results. This package itself offers what goes wrong and what a metric is.
"""

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
