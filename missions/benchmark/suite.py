"""Suite: cases, time limit and seeds of a benchmark, from a file with a digest.

An instance is the ground, the fleet and the losses that one seed draws; all cells have the same instances. The split
``test`` has the instances of another seed, which no setting of a shipped strategy was chosen on.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from pydantic import Field

from exchange.channel.network import shipped as shipped_networks
from missions.document import Document
from missions.errors import ConfigurationError, ConfigurationFault
from missions.files import MISSIONS, file_of, shipped, shown, text_of
from missions.sweeps.plan import seed_of
from missions.sweeps.study import Study, study_of
from missions.sweeps.study_file import Unforeseen, repeated_names
from remoras.table import Name, Section
from worldmodel import suggestion

SUITE = "suite"
DEV = "dev"
NETWORK_KEY = "channel.network"


class SuiteAbout(Section):
    """Table ``[suite]``."""

    name: Name = Field(description="name of the suite")
    title: str = Field("", description="summary in one line")
    scenario: str = Field(description="scenario, by its shipped name")
    bound: str = Field(description="package.module:object: least paths and work of a scenario")
    limit_s: float = Field(gt=0.0, description="time that counts for a run that has not completed")
    seed: int = Field(1, ge=0, le=2**53, strict=True, description="master seed of the split dev")
    test_seed: int = Field(2, ge=0, le=2**53, strict=True, description="master seed of the split test")
    repeats: int = Field(ge=1, le=10_000, strict=True, description="instances, each a run per cell")


class CellCase(Section):
    """Tables ``[[ground]]`` and ``[[network]]``: one level of the ground, or of the links between the vehicles."""

    name: Name = Field(description="name in tables")
    set: dict[str, Any] = Field({}, description="keys of the scenario that it sets")


class SuiteFile(Section):
    """Content of a suite file."""

    suite: SuiteAbout
    set: dict[str, Any] = Field({}, description="keys of the scenario common to all runs")
    ground: tuple[CellCase, ...] = Field(min_length=1)
    network: tuple[CellCase, ...] = Field(min_length=1)
    unforeseen: tuple[Unforeseen, ...] = Field(min_length=1)


class Cell(NamedTuple):
    """Case; its runs differ in their seed only."""

    ground: str
    network: str
    unforeseen: str

    @property
    def label(self) -> str:
        """Name in tables, such as ``half escorted, PER 0.8, nothing``."""
        return ", ".join(self)


@dataclass(frozen=True)
class Suite:
    """Checked suite."""

    document: Document
    file: SuiteFile
    split: str = DEV

    @property
    def about(self) -> SuiteAbout:
        """Table ``[suite]``."""
        return self.file.suite

    @property
    def cells(self) -> tuple[Cell, ...]:
        """All cells in file order; unforeseen events vary fastest."""
        file = self.file
        return tuple(
            Cell(ground.name, network.name, case.name)
            for ground in file.ground
            for network in file.network
            for case in file.unforeseen
        )

    @cached_property  # reads the files of ground and networks once
    def digest(self) -> str:
        """SHA-256 of the file with its scenario and networks."""
        known = shipped_networks()
        networks = (case.set.get(NETWORK_KEY) for case in self.file.network)
        texts = [
            self.document.text,
            text_of(Path(shipped()[self.about.scenario])),
            *(known[name].model_dump_json(exclude_defaults=True) for name in networks if name in known),
        ]
        # Joining hashes instead of texts keeps the borders between files in the digest.
        return hashlib.sha256(
            "\n".join(hashlib.sha256(text.encode()).hexdigest() for text in texts).encode()
        ).hexdigest()

    def study(
        self, strategies: Sequence[str], repeats: int | None = None, settings: Mapping[str, Any] = MappingProxyType({})
    ) -> Study:
        """Return the study of strategies in all cells; ``settings`` are additional scenario keys.

        Raises ConfigurationError if the scenario does not allow those of a case.
        """
        tables = {
            "study": {
                "name": self.about.name,
                "scenario": self.about.scenario,
                "strategies": list(strategies),
                "repeats": self.about.repeats if repeats is None else repeats,
                "seed": self._master,
                "sampling": "list",
                "keep_tables": 0,
                "metrics": ["mission_time_s", "completed", "n_bytes"],
            },
            "set": {**self.file.set, **settings},
            "point": [{**ground.set, **network.set} for ground in self.file.ground for network in self.file.network],
            "unforeseen": [case.model_dump(exclude_defaults=True) for case in self.file.unforeseen],
        }
        study = study_of(Document.of_tables(tables, self.document.path))
        # The study merges equal configurations, which would shift the numbers of ``number``.
        if len(study.configurations) != len(strategies) * len(self.cells):
            fault = ConfigurationFault("network", "", "two cases of this suite run alike; leave one of them out")
            raise ConfigurationError(self.document.path, [fault])
        return study

    def number(self, cell: int, strategy: int) -> int:
        """Return the number of the configuration of a strategy in a cell."""
        return strategy * len(self.cells) + cell

    def seed(self, repeat: int) -> int:
        """Return the seed of a repeat (instance), common to all cells."""
        return seed_of(self._master, repeat)

    @property
    def _master(self) -> int:
        return self.about.seed if self.split == DEV else self.about.test_seed


def suites() -> dict[str, Path]:
    """Return the shipped suites, by name."""
    return {path.stem: path for path in sorted((MISSIONS / "benchmark" / "suites").glob("*.toml"))}


def suite_named(name_or_path: str, split: str = DEV) -> Suite:
    """Read a shipped suite or a TOML file; raises ConfigurationError with all faults."""
    path = file_of(SUITE, name_or_path, suites())
    document = Document.at(path)
    file = document.values(SuiteFile)
    kinds = {"ground": file.ground, "network": file.network, "unforeseen": file.unforeseen}
    faults = [fault for kind, cases in kinds.items() for fault in repeated_names(kind, cases)]
    if file.suite.scenario not in (known := shipped()):
        allowed = f"a shipped scenario, see `remoras list scenarios`{suggestion(file.suite.scenario, known)}"
        faults.append(ConfigurationFault("suite.scenario", shown(file.suite.scenario), allowed))
    if faults:
        raise document.error(faults)
    return Suite(document, file, split)
