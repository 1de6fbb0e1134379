"""Shell completion of names, files, metrics, figures and scenario keys.

Any error yields no completions: output would corrupt the command line.
"""

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
    """Return a source of names: a function or table of a module, loaded on completion."""

    def names(ctx: typer.Context) -> Iterable[str]:
        source: Any = getattr(import_module(module), name)
        return source() if callable(source) else source  # type: ignore[no-any-return]

    return names


_scenarios = _said_by("missions.files", "shipped")
_studies = _said_by("missions.files", "shipped_studies")
_strategies = _said_by("remoras.strategies", "strategies")
_networks = _said_by("exchange.channel.network", "shipped")


def _keys(ctx: typer.Context) -> Iterable[str]:
    from missions.scenarios.explanations import explanations

    return explanations()


def _keys_of_all(ctx: typer.Context) -> Iterable[str]:
    from missions.sweeps.study import study_explanations

    return ["codec", *_keys(ctx), *study_explanations()]


def _folder(ctx: typer.Context) -> Path:
    """Folder argument; before an option value it is still among the raw arguments."""
    return Path(ctx.params.get("folder") or next(argument for argument in ctx.args if not argument.startswith("-")))


def _metrics(ctx: typer.Context) -> Iterable[str]:
    from missions.sweeps.folder import SweepResults

    return SweepResults.read(_folder(ctx)).metrics


def _baselines(ctx: typer.Context) -> Iterable[str]:
    from missions.sweeps.folder import SweepResults

    lines = SweepResults.read(_folder(ctx)).lines.values()
    return sorted({line["summary"][name] for line in lines for name in ("strategy", "policy")})


def _kinds(ctx: typer.Context) -> Iterable[str]:
    from visualisation.output import FACTORIAL_KINDS, KINDS, SWEEP_KINDS

    folder = _folder(ctx)
    if (folder / "study.json").is_file():
        from missions.sweeps.folder import SweepResults
        from visualisation.sweeps.arrangement import by_kind

        return [*SWEEP_KINDS, *FACTORIAL_KINDS, *by_kind(list(SweepResults.read(folder).metrics.values()))]
    from missions.figure import Figure
    from missions.runs.results import Results
    from missions.scenarios.parts import mission_of

    figures = mission_of(Results.read(folder).scenario).figures
    return [*KINDS, *(figure.name for figure in figures if isinstance(figure, Figure))]


def _vehicles(ctx: typer.Context) -> Iterable[str]:
    from missions.runs.results import Results

    return [table.name for table in Results.read(_folder(ctx)).scenario.vehicle]


TOML = (".toml",)
scenario = _offering(_scenarios, TOML)
study = _offering(_studies, TOML)
scenario_or_study = _offering(lambda ctx: [*_scenarios(ctx), *_studies(ctx)], TOML)
strategy = _offering(_strategies, (".py",))
strategy_name = _offering(_strategies)
policy = _offering(_said_by("exchange.policy.policies", "POLICIES"))
channel = _offering(_said_by("exchange.channel.shipped", "CHANNELS"))
modem = _offering(_said_by("exchange.channel.modems", "modems"))
network = _offering(_networks, (".toml", ".csv"))
sea = _offering(lambda ctx: [*_networks(ctx), *_scenarios(ctx)], (".toml", ".csv"))
setting = _offering(lambda ctx: [f"{key}=" for key in _keys(ctx)])
key = _offering(_keys_of_all)
metric = _offering(_metrics)
baseline = _offering(_baselines)
kind = _offering(_kinds)
vehicle = _offering(_vehicles)


def offering(*names: str) -> Any:
    """Complete from these names."""
    return _offering(lambda ctx: names)
