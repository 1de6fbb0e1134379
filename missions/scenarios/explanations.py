"""What the keys of scenarios and studies mean, from the tables themselves."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel

from missions.files import shipped
from missions.scenarios.loading import load
from missions.scenarios.parts import mission_class
from missions.scenarios.scenario import Scenario


def _limit(constraint: Any) -> str:
    """A constraint of pydantic in words."""
    words = {
        "gt": "above",
        "ge": "at least",
        "lt": "below",
        "le": "at most",
        "min_length": "at least",
        "max_length": "at most",
    }
    return ", ".join(
        f"{text} {getattr(constraint, name):g}" for name, text in words.items() if hasattr(constraint, name)
    )


def explanations_of(root: type[BaseModel], prefix: str = "") -> dict[str, tuple[str, str]]:
    """(type and range, meaning) of every key of a table and of the tables in it, by dotted key."""
    found: dict[str, tuple[str, str]] = {}
    for name, info in root.model_fields.items():
        annotation: Any = info.annotation
        inner = [annotation, *getattr(annotation, "__args__", ())]
        nested = next((c for c in inner if isinstance(c, type) and issubclass(c, BaseModel)), None)
        if nested is not None:
            found |= explanations_of(nested, f"{prefix}{name}.")
            continue
        limits = [text for m in info.metadata if (text := _limit(m))]
        default = "" if info.is_required() else f", default {info.default!r}"
        kind = getattr(annotation, "__name__", str(annotation)).replace("typing.", "")
        found[prefix + name] = (", ".join([kind, *limits]) + default, info.description or "")
    return found


def explanations() -> dict[str, tuple[str, str]]:
    """(type and range, meaning) of every key of a scenario; entries of lists without their name."""
    found = explanations_of(Scenario)
    for mission in {mission_class(load(name).scenario.mission): None for name in shipped()}:
        found |= explanations_of(mission.Scenario)
        for kind in mission.sensors.values():
            found |= explanations_of(kind, "vehicle.sensor.")
    return found
