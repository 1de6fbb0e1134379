"""Suite: the cases, the limit and the seeds on which strategies are compared, read from a file that has a digest.

Its cells are grounds x networks x what is unforeseen. The runs of some strategies in all cells are a study, which the
sweeps make: they resume, and use several processes.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import tomli_w
from pydantic import Field, ValidationError

from exchange.acoustics.network import shipped as shipped_networks
from missions.document import Document
from missions.errors import ConfigurationError, ConfigurationFault
from missions.files import MISSIONS, file_of, shipped, shown, text_of
from missions.scenarios.tables import Name, Section
from missions.sweeps.study import Study, study_of
from missions.sweeps.study_file import Unforeseen
from worldmodel import suggestion

SUITE = "suite"
DEV = "dev"
"""Split to develop on."""
NETWORK_KEY = "channel.network"


class SuiteAbout(Section):
    """The table ``[suite]``."""

    name: Name = Field(description="name of the suite")
    title: str = Field("", description="what it is about, in a line")
    grounds: tuple[str, ...] = Field(min_length=1, description="scenarios, by their shipped names")
    bound: str = Field(description="package.module:object that gives the least ways and work of a scenario")
    limit_s: float = Field(gt=0.0, description="time that a run counts that has not completed")
    seed: int = Field(1, ge=0, le=2**53, strict=True, description="master seed")
    repeats: int = Field(ge=1, le=10_000, strict=True, description="runs of each cell")


class NetworkCase(Section):
    """One ``[[network]]``: links between the vehicles."""

    name: Name = Field(description="what tables call it")
    set: dict[str, Any] = Field(description="keys of the scenario that it sets")


class SuiteFile(Section):
    """A suite as its file has it."""

    suite: SuiteAbout
    set: dict[str, Any] = Field({}, description="keys of the scenario that are the same in all runs")
    network: tuple[NetworkCase, ...] = Field(min_length=1)
    unforeseen: tuple[Unforeseen, ...] = Field(min_length=1)


class Cell(NamedTuple):
    """One case: all runs of it differ in their seed alone."""

    ground: str
    network: str
    unforeseen: str

    @property
    def label(self) -> str:
        """Name in tables.

        >>> Cell("mapping-patches", "alike", "nothing").label
        'mapping-patches, alike, nothing'
        """
        return ", ".join(self)


@dataclass(frozen=True)
class Suite:
    """A suite that has been read and checked."""

    document: Document
    file: SuiteFile

    @property
    def about(self) -> SuiteAbout:
        """The table ``[suite]``."""
        return self.file.suite

    @cached_property
    def cells(self) -> tuple[Cell, ...]:
        """All cells, in the order of the file; what is unforeseen varies fastest."""
        return tuple(
            Cell(ground, network.name, case.name)
            for ground in self.about.grounds
            for network in self.file.network
            for case in self.file.unforeseen
        )

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the file, and of the files of its grounds and networks."""
        texts = [self.document.text]
        texts += [text_of(shipped()[ground]) for ground in self.about.grounds]
        known = shipped_networks()
        networks = (case.set.get(NETWORK_KEY) for case in self.file.network)
        texts += [known[name].model_dump_json(exclude_defaults=True) for name in networks if name in known]
        return hashlib.sha256(
            "\n".join(hashlib.sha256(text.encode()).hexdigest() for text in texts).encode()
        ).hexdigest()

    def study(self, strategies: Sequence[str], repeats: int | None = None) -> Study:
        """The runs of some strategies in all cells.

        Args:
            strategies: shipped names, or ``package.module:object``.
            repeats: of each cell, if not as many as the suite has.

        Raises:
            ConfigurationError: a scenario does not allow what a network or a case sets.
        """
        about = self.about
        tables = {
            "study": {
                "name": about.name,
                "scenario": list(about.grounds),
                "strategies": list(strategies),
                "repeats": about.repeats if repeats is None else repeats,
                "seed": about.seed,
                "sampling": "list",
                "keep_tables": 0,
                "metrics": ["mission_time_s", "completed", "n_bytes"],
            },
            "set": self.file.set,
            "point": [network.set for network in self.file.network],
            "unforeseen": [case.model_dump(exclude_defaults=True) for case in self.file.unforeseen],
        }
        study = study_of(Document.of_text(tomli_w.dumps(tables), self.document.path))
        if len(study.configurations) != len(strategies) * len(self.cells):
            fault = ConfigurationFault("network", "", "two cases of this suite run alike; leave one of them out")
            raise ConfigurationError(self.document.path, [fault])
        return study

    def number(self, cell: int, strategy: int, n_strategies: int) -> int:
        """Number of the configuration of a study that runs a strategy in a cell.

        >>> suite = suite_named("fathom-1")
        >>> [suite.number(cell, 1, 2) for cell in (0, 19, 20)]
        [20, 39, 60]
        """
        per_ground = len(self.cells) // len(self.about.grounds)
        ground, within = divmod(cell, per_ground)
        return (ground * n_strategies + strategy) * per_ground + within


def suites() -> dict[str, Path]:
    """Suites that come with the package, by name."""
    return {path.stem: path for path in sorted((MISSIONS / "benchmark" / "suites").glob("*.toml"))}


def suite_named(name_or_path: str) -> Suite:
    """A shipped suite by its name, or one of a TOML file.

    Raises:
        ConfigurationError: there is none, or with every fault of the file.
    """
    path = file_of(SUITE, name_or_path, suites())
    document = Document.of_text(text_of(path), str(path))
    try:
        file = SuiteFile.model_validate(document.raw)
    except ValidationError as error:
        raise document.error(document.faults_of(error, SuiteFile)) from None
    if faults := [*_doubled(file), *_unknown_grounds(file)]:
        raise document.error(faults)
    return Suite(document, file)


def _doubled(file: SuiteFile) -> Iterator[ConfigurationFault]:
    named: Mapping[str, Sequence[NetworkCase | Unforeseen]] = {"network": file.network, "unforeseen": file.unforeseen}
    for table, cases in named.items():
        names = [case.name for case in cases]
        for number, name in enumerate(names, 1):
            if name in names[: number - 1]:
                allowed = "a second entry of this name; give each its own"
                yield ConfigurationFault(f"{table}.{number}.name", shown(name), allowed)


def _unknown_grounds(file: SuiteFile) -> Iterator[ConfigurationFault]:
    known = shipped()
    for ground in file.suite.grounds:
        if ground not in known:
            allowed = f"a shipped scenario, see `remoras list scenarios`{suggestion(ground, known)}"
            yield ConfigurationFault("suite.grounds", shown(ground), allowed)
