"""Study: what a sweep varies, frozen, read from a TOML file and checked whole.

The design is scenarios x vehicles x strategies x policies x channels x points. A point sets keys of the scenario,
named as ``--set`` names them; points come from a full grid, a list or a Latin hypercube. Every configuration of the
design is resolved when the study is loaded, so that a study that starts can also finish: all faults are reported at
once.
"""

from __future__ import annotations

import itertools
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from missions.errors import ConfigurationError, ConfigurationFault
from missions.scenarios import Scenario, load, shipped
from missions.scenarios.explanations import explanations_of
from missions.sweeps.study_file import (
    Design,
    StudyFile,
    fault_of,
    flattened,
    is_axis,
    located,
    or_one_of,
    own_faults,
    toml_value,
)

Settings = tuple[tuple[str, Any], ...]
"""Keys of a scenario and their values."""


@dataclass(frozen=True)
class Configuration:
    """One cell of the design: the scenario resolved, and how to get it.

    Args:
        source: scenario as `remoras run` takes it.
        settings: every key that the study sets.
    """

    source: str
    settings: Settings
    scenario: Scenario


@dataclass(frozen=True)
class Study:
    """A study whose every configuration has been resolved."""

    text: str
    file: StudyFile
    configurations: tuple[Configuration, ...]

    @property
    def design(self) -> Design:
        return self.file.study

    @property
    def maximum(self) -> int:
        """Most repeats of a configuration."""
        return self.file.stopping.maximum if self.file.stopping else self.design.repeats

    @property
    def n_runs(self) -> int:
        """Runs of the whole study; with a stopping rule the most that there can be."""
        return len(self.configurations) * self.maximum


def shipped_studies() -> dict[str, Path]:
    """Study files that come with the package, by name."""
    folder = Path(str(resources.files("missions")))
    return {path.stem: path for path in sorted(folder.glob("*/studies/*.toml"))}


def is_study(name_or_path: str) -> bool:
    """Is this the name of a shipped study, or a TOML file with a table ``[study]``?"""
    if name_or_path in shipped_studies():
        return True
    try:
        return "study" in tomllib.loads(Path(name_or_path).read_text(encoding="utf-8"))
    except (OSError, ValueError):  # no such file, not text, not TOML
        return False


def example_study() -> str:
    """A commented study file to start from."""
    return (resources.files("missions") / "mapping" / "example-study.toml.txt").read_text(encoding="utf-8")


def study_explanations() -> dict[str, tuple[str, str]]:
    """(type and range, meaning) of every key of a study."""
    return explanations_of(StudyFile)


def load_study(name_or_path: str) -> Study:
    """The study of a shipped name or a TOML file.

    Raises:
        ConfigurationError: with every fault of the file, or of the scenario that it names.
    """
    known = shipped_studies()
    path = known.get(name_or_path, Path(name_or_path))
    if not path.is_file():
        hint = f"a TOML file{or_one_of(name_or_path, list(known))}"
        raise ConfigurationError(name_or_path, [ConfigurationFault("study", name_or_path, hint)])
    try:
        text = path.read_text(encoding="utf-8")
        raw = tomllib.loads(text)
        if isinstance(raw.get("channel"), dict):
            raw["channel"] = [raw["channel"]]
        file = StudyFile.model_validate(raw)
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ConfigurationError(str(path), [ConfigurationFault("TOML", "", str(error))]) from None
    except ValidationError as error:
        raise ConfigurationError(str(path), located(text, map(fault_of, error.errors()))) from None
    if faults := [*own_faults(file)]:
        raise ConfigurationError(str(path), located(text, faults))
    configurations, found = _resolved(file, path.parent)
    if found:
        raise ConfigurationError(str(path), located(text, found))
    return Study(text, file, configurations)


# The design ---------------------------------------------------------------------------------------


def points(file: StudyFile) -> list[Settings]:
    """Settings of every point, in the order of the file; the last key of a grid varies fastest.

    A Latin hypercube (McKay, Beckman, Conover 1979) is scaled to the bounds; its values have six digits, and are whole
    where both bounds are.
    """
    if file.study.sampling == "list":
        return [tuple(flattened(point)) for point in file.point]
    if file.study.sampling == "latin":
        from scipy.stats import qmc

        keys, bounds = zip(*flattened(file.latin), strict=True)
        unit = qmc.LatinHypercube(len(keys), seed=file.study.seed).random(file.study.samples)
        return [
            tuple((key, _between(low, high, share)) for key, (low, high), share in zip(keys, bounds, row, strict=True))
            for row in unit.tolist()
        ]
    return _product(dict(flattened(file.grid)))


def _between(low: float, high: float, share: float) -> float:
    """The value at a share 0..1 of the way; among whole numbers each has the same part of the way.

    >>> _between(4, 6, 0.34), _between(4.0, 6.0, 0.34)
    (5, 4.68)
    """
    if isinstance(low, int) and isinstance(high, int):
        return low + min(int(share * (high - low + 1)), high - low)
    return float(f"{low + share * (high - low):.6g}")


def _product(grid: Mapping[str, Any]) -> list[Settings]:
    """Settings of a full grid; a value that is no list, or a list of tables, stays the same everywhere."""
    choices = [[(key, value) for value in (values if is_axis(values) else [values])] for key, values in grid.items()]
    return [tuple(chosen) for chosen in itertools.product(*choices)]


def _channels(file: StudyFile) -> list[Settings]:
    channels = [{f"channel.{key}": value for key, value in table.items()} for table in file.channel]
    return [settings for channel in channels for settings in _product(channel)] or [()]


def _resolved(file: StudyFile, folder: Path) -> tuple[tuple[Configuration, ...], list[ConfigurationFault]]:
    """Every configuration once, and the faults of those that the scenario does not allow."""
    design = file.study
    found: dict[str, Configuration] = {}
    faults: dict[tuple[str, str], ConfigurationFault] = {}
    table = {"grid": "grid", "list": "point", "latin": "latin"}[design.sampling]
    choices: list[list[tuple[str, Settings]]] = [
        [("set", tuple(flattened(file.set)))],
        [("study:strategies", (("strategy.name", name),)) for name in design.strategies or ()] or [("", ())],
        [("study:policies", (("communication.policy", name),)) for name in design.policies or ()] or [("", ())],
        [("study:vehicles", (("fleet.size", size),)) for size in design.vehicles or ()] or [("", ())],
        [("channel", settings) for settings in _channels(file)],
        [(table, point) for point in points(file)],
    ]
    for name in design.scenario:
        nearby = folder / name
        source = name if name in shipped() or not nearby.is_file() else str(nearby.resolve())
        if source not in shipped() and not Path(source).is_file():
            hint = f"a TOML file{or_one_of(name, list(shipped()))}"
            faults.setdefault(("study:scenario", hint), ConfigurationFault("study:scenario", f'"{name}"', hint))
            continue
        load(source)
        for chosen in itertools.product(*choices):
            settings = {key: value for _, pairs in chosen for key, value in pairs}
            written = {key: _written(where, key) for where, pairs in chosen for key, _ in pairs}
            overrides = [(written[key], f"{key}={toml_value(value)}") for key, value in settings.items()]
            try:
                scenario = load(source, overrides)
            except ConfigurationError as error:
                for fault in error.faults:
                    own = [place for key, place in written.items() if key.startswith(f"{fault.key}.")]
                    place = own[0] if own else fault.key
                    given = "" if own else fault.given
                    faults.setdefault((place, fault.allowed), replace(fault, key=place, given=given))
                continue
            found.setdefault(scenario.model_dump_json(), Configuration(source, tuple(settings.items()), scenario))
    return tuple(found.values()), list(faults.values())


def _written(where: str, key: str) -> str:
    """Table and key of the study file that set a key of the scenario, as ``table:key``."""
    return where if ":" in where else f"{where}:{key.removeprefix('channel.') if where == 'channel' else key}"
