"""Missions: scenarios, runs and studies.

Each mission has a folder. ``scenarios`` reads and checks input, ``runs`` runs once, ``sweeps`` runs a study,
``comparison`` compares its results. This package exports errors and metrics.
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
