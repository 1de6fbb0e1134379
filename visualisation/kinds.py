"""Kinds of figures by name."""

from __future__ import annotations

from collections.abc import Mapping

KINDS: Mapping[str, tuple[str, ...]] = {
    "trajectories": ("trajectories",),
    "roles": ("roles",),
    "organisation": ("organisation",),
    "satisfaction": ("satisfaction", "roles"),
    "motivation": ("decisions",),
    "htn": ("plans",),
    "knowledge": ("packets", "knowledge"),
    "delivery": ("packets",),
    "tdma": ("packets",),
    "links": ("links",),
}
"""Kinds of figures that every run has, with the tables that each needs; its mission may declare more."""
SWEEP_KINDS = ("differences", "trade-off", "ranking", "overview")
"""Kinds of figures of a sweep, beside a chart of each metric."""
FACTORIAL_KINDS = ("effects",)
"""Kinds of figures of a sweep whose study has a factorial design: they take the place of all others by default."""
