"""Keys of ``[mission]`` that all missions have whose groups meet."""

from __future__ import annotations

from typing import Any

from pydantic import Field

MEETING_DEADLINE: Any = Field(
    900.0, gt=0.0, description="a head that has waited this long at the rally point meets with those who are there"
)
