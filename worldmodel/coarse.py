"""Coarse values: the wider grid on which numbers and points may be recorded where a channel has no room for more.

An attribute declares it by ``rm:coarseResolution``, a whole multiple of ``rm:resolution``. Every coarse value is then a
value of the fine grid too, the same double: whoever holds it need not know that it was rounded.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from typing import cast

from worldmodel.fields import Field, Value
from worldmodel.tbox import Attribute


def coarse_fields(fields: Sequence[Field], stated: Sequence[object]) -> tuple[Field, ...]:
    """Return the wider grids of an attribute; none where nothing is stated.

    Args:
        fields: its grids.
        stated: what the ontology says of the step.

    Raises:
        ValueError: it is not one number, or no such grid.
    """
    if not stated or not fields:
        return ()
    step = stated[0]
    if len(stated) > 1 or isinstance(step, bool) or not isinstance(step, int | float | Decimal):
        raise ValueError(f"{' and '.join(map(str, stated))} is not one number")
    coarse = tuple(Field(field.minimum, field.maximum, float(step), field.unit) for field in fields)
    for field in fields:
        steps = Fraction(repr(float(step))) / Fraction(repr(float(field.resolution)))
        if steps.denominator != 1 or steps < 2:
            raise ValueError(f"{step} is not two or more whole steps of {field.resolution:g}")
    return coarse


def coarsened(attribute: Attribute, value: Value, uncertainty: float | None = None) -> tuple[Value, float | None]:
    """Return the nearest coarse value, and how uncertain that is.

    What is rounded to a step has an error of its own, of standard deviation step / sqrt(12); variances add up.

    Args:
        attribute: that declares a coarse grid.
        value: within its range.
        uncertainty: standard deviation of the value, None if it carries none.

    Raises:
        TypeError, ValueError: the attribute has no such value.
    """
    rounded = replace(attribute, fields=attribute.coarse).quantise(value)
    if uncertainty is None or attribute.uncertainty is None:
        return rounded, uncertainty
    step = attribute.coarse[0].resolution
    sigma = math.sqrt(uncertainty * uncertainty + step * step / 12.0)
    return rounded, max(uncertainty, min(sigma, attribute.uncertainty.maximum))


def is_coarse(attribute: Attribute, value: Value) -> bool:
    """True if a finite number or point lies on the coarse grid; False where there is none."""
    if not attribute.coarse:
        return False
    numbers = value if isinstance(value, tuple) else (cast(float, value),)
    return all(
        field.grid.value_at(field.grid.index_of(number)) == number
        for field, number in zip(attribute.coarse, numbers, strict=True)
    )
