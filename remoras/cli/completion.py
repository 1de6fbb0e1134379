"""Shell completion of names, files, figures and keys; an error yields no completions."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from importlib import import_module
from pathlib import Path


def offering(*sources: str, suffixes: tuple[str, ...] = (), end: str = "") -> Callable[[str], list[str]]:
    """Complete names, each with an ``end``, and files with these suffixes and their folders.

    A source is ``module:object`` for the names that an object lists or returns, else itself a name.
    """

    def offer(incomplete: str) -> list[str]:
        try:
            names = [f"{name}{end}" for source in sources for name in _names(source)]
            matches = [name for name in names if name.startswith(incomplete)]
            return matches + (_files(incomplete, suffixes) if suffixes else [])
        except Exception:  # damaged folder or failing plug-in: no completion
            return []

    return offer


def _names(source: str) -> Iterable[str]:
    module, colon, name = source.partition(":")
    if not colon:
        return [source]
    listed: Iterable[str] | Callable[[], Iterable[str]] = getattr(import_module(module), name)
    return listed() if callable(listed) else listed


def _files(incomplete: str, suffixes: tuple[str, ...]) -> list[str]:
    folder, _, start = incomplete.rpartition("/")
    place = Path(folder or ("/" if incomplete.startswith("/") else "."))
    paths = sorted(path for path in place.iterdir() if path.name.startswith(start))
    prefix = f"{folder}/" if "/" in incomplete else ""
    folders = [f"{prefix}{path.name}/" for path in paths if path.is_dir() and not path.name.startswith(".")]
    return [f"{prefix}{path.name}" for path in paths if path.name.endswith(suffixes)] + folders


SCENARIOS, STUDIES = "missions.files:shipped", "missions.files:shipped_studies"
STRATEGIES, POLICIES = "remoras.strategies:strategies", "exchange.policy.policies:POLICIES"
NETWORKS, KEYS = "exchange.channel.network:shipped", "missions.scenarios.explanations:explanations"

scenario = offering(SCENARIOS, suffixes=(".toml",))
study = offering(STUDIES, suffixes=(".toml",))
scenario_or_study = offering(SCENARIOS, STUDIES, suffixes=(".toml",))
strategy = offering(STRATEGIES, suffixes=(".py",))
strategy_name = offering(STRATEGIES)
policy = offering(POLICIES)
channel = offering("exchange.channel.shipped:CHANNELS")
modem = offering("exchange.channel.modems:modems")
network = offering(NETWORKS, suffixes=(".toml", ".csv"))
sea = offering(NETWORKS, SCENARIOS, suffixes=(".toml", ".csv"))
setting = offering(KEYS, end="=")
key = offering("codec", KEYS, "missions.sweeps.study:study_explanations")
baseline = offering(STRATEGIES, POLICIES)
kind = offering(*(f"visualisation.output:{kinds}" for kinds in ("KINDS", "SWEEP_KINDS", "FACTORIAL_KINDS")))
