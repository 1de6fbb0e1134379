"""What a biased sensor makes of what it would have read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from remoras.faults import Bias
from remoras.sensor import Observation
from worldmodel import TBox


def biased(observation: Observation, sensor: str, biases: Sequence[Bias], tbox: TBox) -> Observation:
    """The observation of a sensor as it comes out of it with these biases; beyond the range of an attribute it stays.

    Args:
        observation: as it would be without a fault.
        sensor: its name.
        biases: of the vehicle's sensors.
        tbox: with the ranges of attributes.
    """
    if not biases:
        return observation
    facts = list(observation.facts)
    for bias in biases:
        for position, (subject, attribute, value, *rest) in enumerate(facts):
            if (offset := bias.of(sensor, attribute)) is None:
                continue
            fields = tbox.attribute_named(attribute).fields
            numbers: Any = value if isinstance(value, tuple) else (value,)
            off = [min(max(n + by, f.minimum), f.maximum) for n, by, f in zip(numbers, offset, fields, strict=True)]
            read: Any = (subject, attribute, tuple(off) if len(off) > 1 else off[0], *rest)
            facts[position] = read
    return replace(observation, facts=tuple(facts))
