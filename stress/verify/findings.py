"""Findings: what does not follow, what was looked at, and what could not be."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

LISTED = 20
"""Findings of one check that are listed; the others are counted."""


class NoResults(Exception):
    """A folder holds no results that can be read."""


@dataclass(frozen=True, slots=True)
class Discrepancy:
    """One thing that does not follow.

    Attributes:
        check: that found it; table: file in which it stands.
        time_s, vehicle: which row; None and empty where it is of no time or vehicle.
        stated: what the file says; follows: what it should say, in words or numbers.
        key: of the run, in a sweep.
    """

    check: str
    table: str
    time_s: float | None
    vehicle: str
    stated: str
    follows: str
    key: str = ""

    def __str__(self) -> str:
        where = [self.table, *([f"run {self.key}"] if self.key else [])]
        where += [f"{self.time_s:g} s"] if self.time_s is not None else []
        where += [self.vehicle] if self.vehicle else []
        return f"{', '.join(where)}: {self.stated}; it follows {self.follows} [{self.check}]"


@dataclass
class CheckReport:
    """What came of checking.

    Attributes:
        findings: the first of each check; n_findings: all, by check.
        checked: how many values each check looked at; not_checked: why, by what could not be.
        key: of the run that is being checked, in a sweep.
        strange: vehicles of that run that a fault befell of which nobody here knows what it does, and from when on (s).
    """

    findings: list[Discrepancy] = field(default_factory=list)
    n_findings: Counter[str] = field(default_factory=Counter)
    checked: Counter[str] = field(default_factory=Counter)
    not_checked: dict[str, str] = field(default_factory=dict)
    key: str = ""
    strange: Mapping[str, float] = field(default_factory=dict)

    def add(self, check: str, table: str, time_s: Any, vehicle: str, stated: Any, follows: Any) -> None:
        """Something does not follow, unless nobody here knows what befell the vehicle, or one of them."""
        if self.strange and (vehicle == "" or float(time_s or 0.0) >= self.strange.get(vehicle, math.inf)):
            self.skip(f"{check} after a fault of a kind from outside", "what it does is known to its own class alone")
            return
        self.n_findings[check] += 1
        if self.n_findings[check] <= LISTED:
            at_s = None if time_s is None else float(time_s)
            self.findings.append(Discrepancy(check, table, at_s, vehicle, str(stated), str(follows), self.key))

    def look(self, check: str, n: int = 1) -> None:
        """So many values are looked at by a check."""
        self.checked[check] += n

    def skip(self, what: str, why: str) -> None:
        """Something cannot be checked."""
        self.not_checked[what] = why

    def same(self, check: str, table: str, name: str, stated: Any, follows: Any, within: float = 0.0) -> None:
        """A stated value must be the one that follows, as far as numbers were rounded."""
        self.look(check)
        if not _is_close(stated, follows, within):
            self.add(check, table, None, "", f"{name} is {_shown(stated)}", _shown(follows))

    @property
    def as_json(self) -> dict[str, Any]:
        """All of it as one JSON value."""
        return {
            "ok": not self.findings,
            "findings": [asdict(finding) for finding in self.findings],
            "n_findings": dict(sorted(self.n_findings.items())),
            "checked": dict(sorted(self.checked.items())),
            "not_checked": dict(sorted(self.not_checked.items())),
        }

    @property
    def lines(self) -> Iterable[str]:
        """A line for each finding, and one for each check that has more."""
        yield from map(str, self.findings)
        for check, n in sorted(self.n_findings.items()):
            if n > LISTED:
                yield f"{n - LISTED} more [{check}]"


def _is_close(stated: Any, follows: Any, within: float) -> bool:
    if isinstance(stated, bool) or isinstance(follows, bool) or not isinstance(follows, int | float):
        return bool(stated == follows and isinstance(stated, bool) == isinstance(follows, bool))
    return isinstance(stated, int | float) and abs(stated - follows) <= within


def _shown(value: Any) -> str:
    return f"{value:.10g}" if isinstance(value, float) else repr(value) if isinstance(value, str) else str(value)
