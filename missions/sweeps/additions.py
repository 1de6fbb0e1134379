"""Strategies that a caller adds to a study: shipped ones, objects of modules, objects of Python files.

A file is imported as a module of its name, from a folder of plug-ins (``remoras/plugin_folders.py``); worker
processes know it, too. So results call ``mine.py:Mine`` what scenarios call it, ``mine:Mine``, wherever the file is.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Iterable, Sequence
from pathlib import Path

from missions.errors import ConfigurationFault
from missions.files import is_file
from missions.scenarios.parts import strategy_named
from remoras.errors import PluginError
from remoras.plugin_folders import asked_for, look_in
from remoras.plugins import refuse_unshipped

OPTION = "--strategy"


def with_strategies(listed: Sequence[str], added: Iterable[str]) -> tuple[tuple[str, ...], list[ConfigurationFault]]:
    """Strategies of a study, those added behind those listed, each once; and what is wrong with the added.

    Args:
        listed: as the study names them.
        added: shipped names, ``package.module:object`` or ``file.py:object``.
    """
    found, faults = list(listed), []
    for given in added:
        try:
            name = importable(given)
            strategy_named(name)
        except PluginError as error:
            faults.append(ConfigurationFault(OPTION, f'"{given}"', str(error)))
        else:
            found += [] if name in found else [name]
    return tuple(found), faults


def importable(given: str) -> str:
    """A plug-in as scenarios name it; the folder of a file is one of plug-ins then.

    Raises:
        PluginError: there is no such file, or it cannot be imported by its name.
    """
    file, colon, name = given.rpartition(":")
    if not colon and given.endswith(".py"):
        raise PluginError(f"names a file and no object in it; allowed: {given}:OBJECT")
    if not file.endswith(".py"):
        return given
    refuse_unshipped("", given)
    path = Path(file).expanduser().resolve()
    if not is_file(path):
        raise PluginError(f"no such file: {path}")
    if not path.stem.isidentifier():
        raise PluginError(f"{path.name} cannot be imported, its name is none of a module; rename it, as my_strategy.py")
    look_in([str(path.parent)])
    try:
        with asked_for(path.stem):
            spec = importlib.util.find_spec(path.stem)
    except (ImportError, ValueError):
        spec = None
    if spec is None or spec.origin is None or Path(spec.origin).resolve() != path:
        other = "a module" if spec is None or spec.origin is None else spec.origin
        raise PluginError(f"{path.name} has the name of {other}, which Python finds first; rename the file")
    return f"{path.stem}:{name}"
