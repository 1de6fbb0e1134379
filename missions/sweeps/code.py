"""Fingerprint of the code that makes runs, to keep runs of different programs apart.

It digests every file that can change a run, plug-ins and their project files included; Python, Mesa, NumPy by version.
"""

from __future__ import annotations

import hashlib
import importlib.util
import platform
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from modulefinder import ModuleFinder
from pathlib import Path

from missions.files import is_reference, texts
from missions.scenarios import Scenario
from missions.scenarios.features import names_used_in
from remoras.plugins import asked_for

MAKE_RUNS = ("worldmodel", "exchange", "remoras", "missions")  # packages that make runs
TELL_ONLY = ("remoras/cli", "missions/benchmark", "missions/comparison", "missions/sweeps")
"""Folders in these packages that only plan or report runs."""
RESTED_ON = ("mesa", "numpy")  # distributions whose version may change a run
N_DIGITS = 12


@cache  # asked for each run, and plug-ins are parsed
def fingerprint(named: frozenset[str] = frozenset()) -> Mapping[str, str]:
    """Return digests by path and versions by name of this program and named plug-ins, cached like the loaded code."""
    return {**program(), **code_digests(named)}


def short(digests: Mapping[str, str]) -> str:
    """Combine a fingerprint into one digest."""
    return _digest("\n".join(f"{name} {value}" for name, value in sorted(digests.items())).encode())


@cache  # digests of 500 files
def program() -> dict[str, str]:
    """Return digests and versions of this program alone."""
    digests = {"python": platform.python_version(), **{name: version(name) for name in RESTED_ON}}
    top = Path(__file__).parents[2]
    for file in sorted(file for package in MAKE_RUNS for file in (top / package).rglob("*")):
        name = file.relative_to(top).as_posix()
        if file.is_file() and "__pycache__" not in file.parts and not name.startswith(TELL_ONLY):
            digests[name] = _digest(file.read_bytes())
    return digests


def references(scenarios: Iterable[Scenario]) -> frozenset[str]:
    """Return the texts of scenarios that may name a plug-in object, and the objects of installed features in use."""
    used = (
        text
        for scenario in scenarios
        for text in (*texts(scenario.model_dump(mode="json")), *names_used_in(scenario))
        if is_reference(text)
    )
    return frozenset(used)


def code_digests(named: Iterable[str]) -> dict[str, str]:
    """Return digests of plug-ins named ``package.module:object`` and of their local imports."""
    digests: dict[str, str] = {}
    for reference in sorted(named):
        module = reference.partition(":")[0]
        if (file := _file_of(module)) is not None:
            top = file.parents[module.count(".") + (file.stem == "__init__")]
            for source in sorted({file, *_imported(module, top)}):
                digests[source.relative_to(top).as_posix()] = _digest(source.read_bytes())
    return digests


def _imported(module: str, top: Path) -> Iterator[Path]:
    others: set[str] = set()
    if any(top.glob("*-info")):  # other distributions lie beside an installed one
        others = {path.name.partition(".")[0] for path in top.iterdir()} - {module.partition(".")[0]}
    finder = ModuleFinder([str(top)], excludes=others)
    # A faulty plug-in has at least its own file in the digest; its fault appears on loading.
    with suppress(ImportError, SyntaxError, ValueError):
        finder.import_hook(module)
    names = (getattr(imported, "__file__", None) for imported in finder.modules.values())
    yield from (Path(name) for name in names if name is not None and name.endswith(".py"))


def _file_of(module: str) -> Path | None:
    try:
        with asked_for(module):
            spec = importlib.util.find_spec(module)
    except Exception:  # finding it loads parent packages, which may raise anything
        return None
    return Path(spec.origin) if spec is not None and spec.origin is not None and spec.has_location else None


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:N_DIGITS]
