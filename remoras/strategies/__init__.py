"""Organisational strategies: each module that defines ``STRATEGY`` is one, with its name."""

from __future__ import annotations

import dataclasses
import importlib
import pkgutil
import sys
import typing
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from remoras.errors import StrategyError
from remoras.plugins import docstring
from remoras.strategies.factors import SETTINGS, Factors, factors_of, refusal
from remoras.strategy import Declaration, Strategy
from worldmodel import suggestion

__all__ = [
    "Declaration", "Factors", "Parameter", "Strategy", "bounds", "configured", "factors_of", "faults_of_settings",
    "names_of_strategies", "parameters", "shipped", "strategies", "titles",
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class Parameter:
    """Parameter of a strategy: a field of its dataclass, with its default."""

    name: str
    default: bool | int | float | str
    description: str


def strategies() -> dict[str, Strategy]:
    """Return the shipped strategies by name."""
    return {name: strategy for name in names_of_strategies() if (strategy := _loaded(name)) is not None}


def shipped(name: str) -> Strategy | None:
    """Return the shipped strategy of a name, or None; load no other."""
    return _loaded(name) if name in names_of_strategies() else None


def _loaded(name: str) -> Strategy | None:
    return getattr(importlib.import_module(f"{__name__}.{name.replace('-', '_')}"), "STRATEGY", None)


def names_of_strategies() -> list[str]:
    """Return the names of the shipped strategies, and load none."""
    return sorted(module.name.replace("_", "-") for module in pkgutil.iter_modules(__path__))


def bounds() -> frozenset[str]:
    """Names of the shipped upper bounds: shown beside the other strategies, never ranked."""
    return frozenset(name for name, strategy in strategies().items() if strategy.declaration.sharing is not None)


def titles() -> dict[str, str]:
    """Return a line on each shipped strategy, bounds marked."""
    known, upper = strategies(), bounds()
    docs = {name: docstring(sys.modules[type(strategy).__module__]) for name, strategy in known.items()}
    return {name: "(bound) " * (name in upper) + doc.partition("\n")[0] for name, doc in docs.items()}


def parameters(strategy: Strategy) -> tuple[Parameter, ...]:
    """Return the parameters of a strategy: the fields of its dataclass."""
    if not dataclasses.is_dataclass(strategy):
        return ()
    annotated = typing.get_type_hints(type(strategy), include_extras=True)
    return tuple(
        Parameter(
            field.name,
            getattr(strategy, field.name),
            next((m.description or "" for m in typing.get_args(annotated[field.name])[1:]), ""),
        )
        for field in dataclasses.fields(strategy)
        if field.init
    )


def faults_of_settings(strategy: Strategy, settings: Mapping[str, object]) -> Iterator[StrategyError]:
    """Check parameters set together: first each one alone, then combinations."""
    from pydantic import TypeAdapter, ValidationError

    known = [parameter.name for parameter in parameters(strategy)]
    annotated = typing.get_type_hints(type(strategy), include_extras=True)
    is_sound = True
    for name, value in settings.items():
        if name not in known:
            of_factor = refusal(strategy, name, strategies()) if name in SETTINGS else None
            allowed = f"{strategy.name} has {', '.join(known) or 'no parameters'}{suggestion(name, known)}"
            is_sound = False
            yield StrategyError(name, of_factor or allowed)
            continue
        try:
            TypeAdapter(annotated[name]).validate_python(value, strict=True)
        except ValidationError as error:
            message = error.errors()[0]["msg"]
            is_sound = False
            yield StrategyError(name, message[0].lower() + message[1:])
    if is_sound and settings:
        try:
            dataclasses.replace(strategy, **settings)  # type: ignore[type-var]  # it has fields, so it is a dataclass
        except StrategyError as error:
            set_here = next(name for name in (error.key, *settings) if name in settings)
            yield StrategyError(set_here, error.allowed)


def configured(strategy: Strategy, settings: Mapping[str, object]) -> Strategy:
    """Return a copy with parameters set; a StrategyError has the wrong one's name as ``key``."""
    if not settings:
        return strategy
    for fault in faults_of_settings(strategy, settings):
        raise fault
    return dataclasses.replace(strategy, **settings)  # type: ignore[type-var]  # it has fields, so it is a dataclass
