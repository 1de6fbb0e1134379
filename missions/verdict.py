"""What the success of runs was judged over: results say it, since it once was another.

An earlier version judged success over survivors: work that nobody left was able to do did not count, so a fleet that
was lost early could complete its mission. Results of then say nothing of it, and keep their figures.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

KEY = "verdict"
"""Of the manifest of a run and of the record of a study."""
VERDICT = "all declared work"


def older_verdict(folder: Path, found: Mapping[str, Any]) -> str:
    """A note on results whose success was judged otherwise; empty if it was as this version does.

    Args:
        folder: of the results.
        found: their manifest, or the record of their study.
    """
    if found.get(KEY) == VERDICT:
        return ""
    return (
        f"{folder}: an older version judged success over survivors there; completed, goal_fraction and times of runs "
        "with losses are not those of this version"
    )
