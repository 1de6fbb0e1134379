"""Strategies that a caller adds to a study: shipped ones, objects of modules, objects of Python files."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from missions.errors import ConfigurationFault
from missions.scenarios.named import importable
from missions.scenarios.parts import strategy_named
from remoras.errors import PluginError

OPTION = "--strategy"


def with_strategies(listed: Sequence[str], added: Iterable[str]) -> tuple[tuple[str, ...], list[ConfigurationFault]]:
    """Strategies of a study, those added behind those listed, each once; and what is wrong with the added.

    Args:
        listed: as the study names them.
        added: shipped names, ``package.module:object`` or ``file.py:object``.
    """
    strategies, faults = list(listed), []
    for strategy in added:
        try:
            name = importable(strategy)
            strategy_named(name)
        except PluginError as error:
            faults.append(ConfigurationFault(OPTION, f'"{strategy}"', str(error)))
        else:
            strategies += [] if name in strategies else [name]
    return tuple(strategies), faults
