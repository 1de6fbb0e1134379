"""The keys of scenarios and studies, as ``explain`` and completion have them, kept from one process to the next.

They stand in the tables of all missions, features and faults, and to load these takes longer than anything else that
the two do.
"""

from __future__ import annotations

import hashlib
import json
from contextlib import suppress
from pathlib import Path

import missions
from missions.files import SCENARIO, STUDY
from worldmodel.disk_cache import files_digest, keep_file, package_mark, read_kept

Explained = dict[str, tuple[str, str]]
"""(Type and range, meaning) by dotted key."""
ROOT = Path(str(missions.__file__)).parents[1]
KEYS = "keys"
KINDS = SCENARIO, STUDY
SAID_BY = "worldmodel", "exchange", "remoras", "missions"
"""Packages whose modules and files say what keys there are."""


def explained() -> dict[str, Explained]:
    """Every key of a file, by the kind of file: scenario, study."""
    folders = [ROOT / name for name in SAID_BY]
    files = (file for folder in folders for kind in ("py", "toml") for file in folder.rglob(f"*.{kind}"))
    code = hashlib.sha256(files_digest(files) + package_mark("pydantic")).digest()  # which words ranges
    with suppress(ValueError, TypeError, AttributeError, KeyError):
        found = json.loads(read_kept(KEYS, code) or b"")
        return {kind: {key: (text, meaning) for key, (text, meaning) in found[kind].items()} for kind in KINDS}
    from missions.scenarios.explanations import explanations
    from missions.sweeps.study import study_explanations

    made = {SCENARIO: explanations(), STUDY: study_explanations()}
    keep_file(KEYS, code, json.dumps(made).encode())
    return made
