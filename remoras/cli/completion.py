"""Shell completion of names, files, figures and keys; an error yields no completions."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable
from importlib import import_module
from pathlib import Path
from typing import Any

import typer

Offer = Callable[[typer.Context, str], list[str]]
Names = Callable[[typer.Context], Iterable[str]]


def _offering(names: Names, suffixes: tuple[str, ...] = ()) -> Offer:
    """Complete from names, and from files with these suffixes and their folders."""

    @functools.wraps(names)
    def offer(ctx: typer.Context, incomplete: str) -> list[str]:
        try:
            matches = [name for name in names(ctx) if name.startswith(incomplete)]
            return matches + (_files(incomplete, suffixes) if suffixes else [])
        except Exception:  # damaged folder or failing plug-in: no completion
            return []

    offer.__annotations__ = {"ctx": typer.Context, "incomplete": str}
    del offer.__wrapped__  # Typer reads the parameters of the function itself
    return offer


def _files(incomplete: str, suffixes: tuple[str, ...]) -> list[str]:
    folder, _, start = incomplete.rpartition("/")
    place = Path(folder or ("/" if incomplete.startswith("/") else "."))
    paths = sorted(path for path in place.iterdir() if path.name.startswith(start))
    prefix = f"{folder}/" if "/" in incomplete else ""
    folders = [f"{prefix}{path.name}/" for path in paths if path.is_dir() and not path.name.startswith(".")]
    return [f"{prefix}{path.name}" for path in paths if path.name.endswith(suffixes)] + folders


def _said_by(module: str, name: str) -> Names:
    def names(ctx: typer.Context) -> Iterable[str]:
        source: Any = getattr(import_module(module), name)
        return source() if callable(source) else source  # type: ignore[no-any-return]

    return names


_scenarios = _said_by("missions.files", "shipped")
_studies = _said_by("missions.files", "shipped_studies")
_strategies = _said_by("remoras.strategies", "strategies")
_policies = _said_by("exchange.policy.policies", "POLICIES")
_networks = _said_by("exchange.channel.network", "shipped")


def _keys(ctx: typer.Context) -> Iterable[str]:
    from missions.scenarios.explanations import explanations

    return explanations()


def _keys_of_all(ctx: typer.Context) -> Iterable[str]:
    from missions.sweeps.study import study_explanations

    return ["codec", *_keys(ctx), *study_explanations()]


def _kinds(ctx: typer.Context) -> Iterable[str]:
    from visualisation.output import FACTORIAL_KINDS, KINDS, SWEEP_KINDS

    return [*KINDS, *SWEEP_KINDS, *FACTORIAL_KINDS]


TOML = (".toml",)
scenario = _offering(_scenarios, TOML)
study = _offering(_studies, TOML)
scenario_or_study = _offering(lambda ctx: [*_scenarios(ctx), *_studies(ctx)], TOML)
strategy = _offering(_strategies, (".py",))
strategy_name = _offering(_strategies)
policy = _offering(_policies)
channel = _offering(_said_by("exchange.channel.shipped", "CHANNELS"))
modem = _offering(_said_by("exchange.channel.modems", "modems"))
network = _offering(_networks, (".toml", ".csv"))
sea = _offering(lambda ctx: [*_networks(ctx), *_scenarios(ctx)], (".toml", ".csv"))
setting = _offering(lambda ctx: [f"{key}=" for key in _keys(ctx)])
key = _offering(_keys_of_all)
baseline = _offering(lambda ctx: [*_strategies(ctx), *_policies(ctx)])
kind = _offering(_kinds)


def offering(*names: str) -> Any:
    """Return the completion of fixed names."""
    return _offering(lambda ctx: names)
