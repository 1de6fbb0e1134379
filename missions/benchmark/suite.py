"""Suite: cases, time limit and seeds of a benchmark, from a file with a digest.

Of a held-out split only the SHA-256 of the seed list is published, so that the list can neither be changed later nor
used for tuning before.
"""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import tomli_w
from pydantic import Field

from exchange.channel.loss import STATES
from exchange.channel.network import shipped as shipped_networks
from missions.disk import write_synced
from missions.document import Document
from missions.errors import ConfigurationError, ConfigurationFault, OutputError
from missions.files import MISSIONS, file_of, shipped, shown, text_of
from missions.sweeps.plan import seed_of
from missions.sweeps.study import Study, study_of
from missions.sweeps.study_file import Unforeseen, repeated_names
from remoras.plugins import named_object
from remoras.table import Name, Section
from worldmodel import suggestion

SUITE = "suite"
DEV, TEST = "dev", "test"
DRAWN = "drawn"  # ground of the cells in the held-out split; each repeat has another one
NETWORK_KEY = "channel.network"


class SuiteAbout(Section):
    """Table ``[suite]``."""

    name: Name = Field(description="name of the suite")
    title: str = Field("", description="summary in one line")
    grounds: tuple[str, ...] = Field(min_length=1, description="scenarios, by their shipped names")
    bound: str = Field(description="package.module:object: least paths and work of a scenario")
    limit_s: float = Field(gt=0.0, description="time that counts for a run that has not completed")
    seed: int = Field(1, ge=0, le=2**53, strict=True, description="master seed")
    repeats: int = Field(ge=1, le=10_000, strict=True, description="runs per cell")


class NetworkCase(Section):
    """Table ``[[network]]``: links between the vehicles."""

    name: Name = Field(description="name in tables")
    set: dict[str, Any] = Field(description="keys of the scenario that it sets")


class SuiteFile(Section):
    """Content of a suite file."""

    suite: SuiteAbout
    set: dict[str, Any] = Field({}, description="keys of the scenario common to all runs")
    network: tuple[NetworkCase, ...] = Field(min_length=1)
    unforeseen: tuple[Unforeseen, ...] = Field(min_length=1)


class Cell(NamedTuple):
    """Case; its runs differ in their seed only."""

    ground: str
    network: str
    unforeseen: str

    @property
    def label(self) -> str:
        """Name in tables, such as ``mapping-patches, alike, nothing``."""
        return ", ".join(self)


@dataclass(frozen=True)
class DrawnGrounds:
    """Random grounds of the held-out split: one scenario per repeat of all cells."""

    paths: tuple[str, ...]
    seed: int


@dataclass(frozen=True)
class Suite:
    """Checked suite; ``drawn`` is None for the development split."""

    document: Document
    file: SuiteFile
    drawn: DrawnGrounds | None = None

    @property
    def about(self) -> SuiteAbout:
        """Table ``[suite]``."""
        return self.file.suite

    @property
    def split(self) -> str:
        """Name of the split."""
        return DEV if self.drawn is None else TEST

    @property
    def repeats(self) -> int:
        """Runs of each cell."""
        return self.about.repeats if self.drawn is None else len(self.drawn.paths)

    @property
    def cells(self) -> tuple[Cell, ...]:
        """All cells in file order; unforeseen events vary fastest."""
        return tuple(
            Cell(ground, network.name, case.name)
            for ground in (self.about.grounds if self.drawn is None else (DRAWN,))
            for network in self.file.network
            for case in self.file.unforeseen
        )

    @cached_property  # reads the files of all grounds once
    def digest(self) -> str:
        """SHA-256 of the file with its grounds and networks."""
        texts = [self.document.text]
        grounds = [shipped()[ground] for ground in self.about.grounds] if self.drawn is None else self.drawn.paths
        texts += [text_of(Path(ground)) for ground in grounds]
        known = shipped_networks()
        networks = (case.set.get(NETWORK_KEY) for case in self.file.network)
        texts += [known[name].model_dump_json(exclude_defaults=True) for name in networks if name in known]
        # Joining hashes instead of texts keeps the borders between files in the digest.
        return hashlib.sha256(
            "\n".join(hashlib.sha256(text.encode()).hexdigest() for text in texts).encode()
        ).hexdigest()

    def studies(
        self, strategies: Sequence[str], repeats: int | None = None, settings: Mapping[str, Any] = MappingProxyType({})
    ) -> list[Study]:
        """Return the study of strategies in all cells, or one per drawn ground with its own seed.

        ``settings`` are additional scenario keys. Raises ConfigurationError if a scenario does not allow those of a
        case.
        """
        n = self.repeats if repeats is None else repeats
        if self.drawn is None:
            return [self._study(self.about.grounds, strategies, n, self.about.seed, settings)]
        paths = self.drawn.paths[:n]
        return [self._study([path], strategies, 1, self._master(index), settings) for index, path in enumerate(paths)]

    def _study(
        self, grounds: Sequence[str], strategies: Sequence[str], repeats: int, seed: int, settings: Mapping[str, Any]
    ) -> Study:
        tables = {
            "study": {
                "name": self.about.name,
                "scenario": list(grounds),
                "strategies": list(strategies),
                "repeats": repeats,
                "seed": seed,
                "sampling": "list",
                "keep_tables": 0,
                "metrics": ["mission_time_s", "completed", "n_bytes"],
            },
            "set": {**self.file.set, **settings},
            "point": [network.set for network in self.file.network],
            "unforeseen": [case.model_dump(exclude_defaults=True) for case in self.file.unforeseen],
        }
        study = study_of(Document.of_text(tomli_w.dumps(tables), self.document.path))
        # The study merges equal configurations, which would shift the numbers of ``place``.
        if len(study.configurations) != len(strategies) * len(self.cells):
            fault = ConfigurationFault("network", "", "two cases of this suite run alike; leave one of them out")
            raise ConfigurationError(self.document.path, [fault])
        return study

    def place(self, cell: int, repeat: int, strategy: int, n_strategies: int) -> tuple[int, int, int]:
        """Return the numbers of study, configuration and repeat of a run; each drawn ground is a study."""
        per_ground = len(self.file.network) * len(self.file.unforeseen)
        ground, within = divmod(cell, per_ground)
        number = (ground * n_strategies + strategy) * per_ground + within
        return (0, number, repeat) if self.drawn is None else (repeat, number, 0)

    def seed(self, repeat: int) -> int:
        """Return the seed of a repeat (instance), common to all cells."""
        return seed_of(self.about.seed, repeat) if self.drawn is None else seed_of(self._master(repeat), 0)

    def _master(self, ground: int) -> int:
        return seed_of(self.drawn.seed if self.drawn else 0, ground)


def suites() -> dict[str, Path]:
    """Return the shipped suites, by name."""
    return {path.stem: path for path in sorted((MISSIONS / "benchmark" / "suites").glob("*.toml"))}


def suite_named(name_or_path: str) -> Suite:
    """Read a shipped suite or a TOML file; raises ConfigurationError with all faults."""
    path = file_of(SUITE, name_or_path, suites())
    document = Document.of_text(text_of(path), str(path))
    file = document.values(SuiteFile)
    doubled = [*repeated_names("network", file.network), *repeated_names("unforeseen", file.unforeseen)]
    if faults := [*doubled, *_unknown_grounds(file)]:
        raise document.error(faults)
    return Suite(document, file)


def _unknown_grounds(file: SuiteFile) -> Iterator[ConfigurationFault]:
    known = shipped()
    for ground in file.suite.grounds:
        if ground not in known:
            allowed = f"a shipped scenario, see `remoras list scenarios`{suggestion(ground, known)}"
            yield ConfigurationFault("suite.grounds", shown(ground), allowed)


class JudgingTable(Section):
    """File of a held-out split."""

    ground: str = Field(description="shipped scenario that instances are derived from")
    generator: str = Field(description="package.module:object: tables of an instance from a seed")
    seeds_sha256: str = Field(pattern="^[0-9a-f]{64}$", description="digest of the list of seeds")


def judging_of(suite: Suite) -> JudgingTable:
    """Return the file of a held-out split; raises OutputError without one."""
    path = Path(suite.document.path)
    path = path.parent / "test" / path.name
    if not path.is_file():
        raise OutputError(f"--split test: {suite.about.name} has none: {path} is missing; allowed: dev")
    return Document.of_text(text_of(path), str(path)).values(JudgingTable)


def split_to_judge(suite: Suite, seeds: Path | None, folder: Path) -> Suite:
    """Return the held-out split of a suite; write its grounds to ``folder``.

    ``seeds`` is a file with one seed per line. Raises OutputError for a missing split, missing seeds or another list,
    ConfigurationError for a ground that cannot be drawn.
    """
    judging = judging_of(suite)
    digest, name = judging.seeds_sha256, suite.about.name
    if seeds is None:
        when = f"the seeds of {name} have the sha256 {digest[:12]} and are released with the next version"
        raise OutputError(f"--split test: --seeds FILE is missing; {when}")
    text = text_of(seeds)
    if (sha256 := hashlib.sha256(text.encode()).hexdigest()) != digest:
        raise OutputError(f"--seeds {seeds}: sha256 = {sha256[:12]}; allowed: {digest[:12]}, the seeds of {name}")
    draw = named_object(judging.generator)
    tables = tomllib.loads(text_of(shipped()[judging.ground]))
    paths = []
    for number, line in enumerate(text.splitlines(), 1):
        if not (line.isdecimal() and int(line) < STATES):
            raise OutputError(f"{seeds}:{number}: {line!r}; allowed: a whole number below 2^62")
        ground = draw(tables, int(line))
        ground["scenario"]["name"] = f"{DRAWN}-{number:02d}"
        path = (folder / f"ground-{number:02d}.toml").resolve()
        path.parent.mkdir(parents=True, exist_ok=True)
        write_synced(path, tomli_w.dumps(ground))
        paths.append(str(path))
    # The seeds of runs follow from the same list, so they are as unknown beforehand as the grounds.
    of_runs = hashlib.sha256(f"runs {text}".encode()).hexdigest()
    return replace(suite, drawn=DrawnGrounds(tuple(paths), int(of_runs[:12], 16)))
