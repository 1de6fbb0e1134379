"""Experience: what the runs of all strategies on all instances came to, as a file that comes with the package."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from missions.advising.instances import SEED
from missions.advising.running import STRATEGIES, instance_file, runs_of, times_s
from missions.advising.traits import TRAITS, traits_of
from missions.errors import OutputError
from missions.files import MISSIONS, text_of
from missions.runs.setup import resolved
from missions.scenarios import load
from missions.sweeps.code import code_with
from missions.sweeps.plan import version

SHIPPED = MISSIONS / "advising" / "experience.json"
FORMAT = 1
AGAIN = "remoras advise --make DIR makes it anew"

Numbers = npt.NDArray[np.float64]


@dataclass(frozen=True)
class TriedInstance:
    """One instance with its runs.

    Attributes:
        number: by which it is drawn.
        traits: in the order and units of ``TRAITS``.
        times_s: mission times of each strategy, by repeat.
    """

    number: int
    traits: tuple[float, ...]
    times_s: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Experience:
    """Instances with their runs.

    Attributes:
        strategies: in the order of the times.
        version, code: of the program that made the runs; seed: of the draws.
    """

    strategies: tuple[str, ...]
    instances: tuple[TriedInstance, ...]
    version: str
    code: str
    seed: int = SEED

    @cached_property
    def traits(self) -> Numbers:
        """Traits that decide, as they are compared: instances x traits."""
        return np.array([compared(instance.traits) for instance in self.instances])

    @cached_property
    def log_times(self) -> Numbers:
        """Mean of the logarithms of the times over the repeats: instances x strategies."""
        return np.array([[_mean_log(times) for times in instance.times_s] for instance in self.instances])

    def of(self, numbers: Sequence[int]) -> Experience:
        """The experience of some instances, by their places."""
        return Experience(
            self.strategies, tuple(self.instances[at] for at in numbers), self.version, self.code, self.seed
        )

    def text(self) -> str:
        """As the file has it; the digest is of all the rest."""
        tables: dict[str, Any] = {
            "format": FORMAT,
            "version": self.version,
            "code": self.code,
            "seed": self.seed,
            "strategies": self.strategies,
            "traits": [trait.name for trait in TRAITS],
        }
        rows = [
            json.dumps([instance.number, instance.traits, instance.times_s], separators=(",", ":"))
            for instance in self.instances
        ]
        head = json.dumps(tables)[:-1]
        listed = ",\n".join(rows)
        return f'{head},\n"instances": [\n{listed}\n],\n"digest": "{_digest(head + listed)}"}}\n'


def compared(traits: Sequence[float]) -> list[float]:
    """Of all traits of a scenario those that decide, as they are compared."""
    return [trait.compared(value) for trait, value in zip(TRAITS, traits, strict=True) if trait.decides]


def experience_in(folder: Path) -> Experience:
    """The experience of the runs in a folder, see ``missions.advising.running.make``.

    Raises:
        OutputError: runs are missing.
    """
    found = []
    numbers = sorted(int(path.stem[-3:]) for path in folder.glob("instance-*.toml"))
    for number in numbers:
        times = times_s(folder, number)
        made = max(map(len, times.values()))
        if not made or any(len(each) not in (1, made) for each in times.values()):
            raise OutputError(f"{runs_of(folder, number)}: runs are missing; the same command goes on")
        values = tuple(tuple(times[name]) * (made // len(times[name])) for name in STRATEGIES)
        found.append(TriedInstance(number, traits_of(resolved(load(str(instance_file(folder, number))))), values))
    if not found:
        raise OutputError(f"{folder}: holds no instances; {AGAIN}")
    return Experience(STRATEGIES, tuple(found), version(), code_with())


def read_experience(path: Path = SHIPPED) -> Experience:
    """The experience of a file.

    Raises:
        OutputError: it is none, was altered, or has other traits than this version.
    """
    text = text_of(path)
    try:
        tables = json.loads(text)
        if tables["traits"] != [trait.name for trait in TRAITS] or tables["format"] != FORMAT:
            raise OutputError(f"{path}: has other traits than this version; {AGAIN}")
        found = _of_tables(tables)
        whole = found.text() == text
    except (ValueError, KeyError, TypeError):
        whole = False
    if not whole:
        raise OutputError(f"{path}: is no experience for advice, or was altered; {AGAIN}")
    return found


def _of_tables(tables: Mapping[str, Any]) -> Experience:
    rows = [
        TriedInstance(int(number), tuple(map(float, traits)), tuple(tuple(map(float, each)) for each in times))
        for number, traits, times in tables["instances"]
    ]
    return Experience(tuple(tables["strategies"]), tuple(rows), tables["version"], tables["code"], tables["seed"])


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _mean_log(times: Sequence[float]) -> float:
    return math.fsum(map(math.log, times)) / len(times)
