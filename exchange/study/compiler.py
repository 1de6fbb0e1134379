"""Compilation of the policy study's slot loop by Numba; vehicles never import this module.

Each kind of acknowledgement is compiled separately, on first use, with its header rule built in. The functions to
compile are all that the loop reaches, in the package or in a user's kind. Machine code is cached on disk in a folder
named by a digest of all its sources, since Numba itself checks one file only; without a writable folder, each process
compiles again. Without a supported Numba the loop runs as Python: same numbers, thousands of times slower.
"""

import hashlib
import inspect
import os
import re
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

import numpy as np

from exchange.errors import ConfigurationError
from exchange.policy.acknowledgement import Acknowledgement
from exchange.study import lanes, stating, trials
from exchange.study.lanes import Case, Ints, Lanes, allocated, sizes_of
from exchange.study.trials import Fleet, Header, layouts_of

SlotLoop = Callable[..., None]
"""Signature of `trials.run_trials` without the rules of slot and header, which are built in."""

Say = Callable[[str], None]
"""Prints a line for the user."""

NUMBA_FROM, NUMBA_BELOW = (0, 66), (0, 69)
"""Supported versions of Numba; the extra `study` of the package has the same bounds."""

SETTINGS = {"CPU_NAME": "generic", "CPU_FEATURES": "", "LOOP_VECTORIZE": 0}
"""Settings of Numba for code that is portable between machines of one kind.

Vector instructions wait for words just stored: they make a slot of five nodes a fifth slower.
"""


def new_fleet(kind: Acknowledgement, case: Case, received: Ints) -> Fleet:
    """Allocate the state of new trials.

    Args:
        received: cache of receptions, shape (any, n_trials), initially zero; shared by policies with the same seed,
            trials and loss probability.
    """
    layouts, sizes = layouts_of(kind, case.n_nodes), sizes_of(case)
    statements = stating.new_statements(case) if kind.states else None
    of_lanes = allocated(Lanes, sizes | {"trial": received.shape[1]}, received)
    return allocated(Fleet, sizes | {"bit": layouts.node.shape[1]}, layouts, of_lanes, statements)


def _globals_named(function: FunctionType) -> list[Any]:
    """Return the global values named in a function, also behind module names."""
    found, names = inspect.getclosurevars(function), function.__code__.co_names
    values = [*found.globals.values(), *found.nonlocals.values()]
    of_modules = [getattr(v, name) for v in values if isinstance(v, ModuleType) for name in names if hasattr(v, name)]
    return [value for value in (*values, *of_modules) if not isinstance(value, ModuleType)]


def slot_rule_of(kind: Acknowledgement) -> Callable[..., None]:
    """Return the slot rule of a kind."""
    return stating.play_slot if kind.states else trials.play_slot


def as_python(kind: Acknowledgement) -> SlotLoop:
    """Return the slot loop of a kind as Python: `trials.run_trials` with the rules of slot and header built in."""
    slot_rule, header = slot_rule_of(kind), kind.header

    # Numba takes the variables of an enclosing function as constants.
    def run_trials(case: Case, fleet: Fleet) -> None:
        trials.run_trials(slot_rule, header, case, fleet)

    return run_trials


def functions_of(kind: Acknowledgement) -> dict[FunctionType, None]:
    """Return all plain functions that a kind's slot loop reaches by name.

    Functions of NumPy are excluded, since Numba replaces them globally.
    """
    reached: dict[FunctionType, None] = {}
    waiting: list[Any] = [slot_rule_of(kind), kind.header, trials.run_trials]
    while waiting:
        function = waiting.pop()
        is_plain = isinstance(function, FunctionType) and function.__module__.partition(".")[0] != "numpy"
        if is_plain and function not in reached:
            reached[function] = None
            waiting += _globals_named(function)
    return reached


def cache_folder(kind: Acknowledgement, numba_version: str) -> Path | None:
    """Return the cache folder of the machine code; None if it is not writable.

    The digest covers the sources of all functions reached and the numeric globals that they use.
    """
    digest = hashlib.sha256(f"{sys.implementation.cache_tag} {numba_version}".encode())
    functions = functions_of(kind)
    for source in sorted({__file__, *(inspect.getsourcefile(function) or __file__ for function in functions)}):
        digest.update(Path(source).read_bytes())
    for function in functions:
        # Numba freezes global numbers, which may come from files that are not among the sources.
        numbers = [value for value in _globals_named(function) if isinstance(value, bool | int | float | tuple)]
        digest.update(f"{function.__module__}.{function.__qualname__} {numbers}".encode())
    base = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    try:
        folder = (Path(base) if base else Path.home() / ".cache") / "remoras" / digest.hexdigest()[:16]
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except (OSError, RuntimeError):
        return None


_registered: set[FunctionType] = set()
_ready: dict[tuple[Header, bool], SlotLoop] = {}
"""Compiled loops by header rule and by whether packets report received sets."""


def make_compilable(kind: Acknowledgement) -> None:
    """Register the functions of the slot loop with Numba; as Python they stay unchanged."""
    from numba.extending import register_jitable

    for function in functions_of(kind).keys() - _registered:
        # All is inlined but the draws, which are rarer. Without allocation (_nrt), Numba counts no references.
        register_jitable(forceinline=function is not lanes.draw, _nrt=False)(function)
        _registered.add(function)


def why_uncompiled() -> str:
    """Explain why the slot loop cannot be compiled, with the remedy; empty if it can."""
    low, high = (".".join(map(str, bound)) for bound in (NUMBA_FROM, NUMBA_BELOW))
    install = f'pip install "numba>={low},<{high}"'
    remedy = f'the policy study runs slower, with equal numbers; for speed install the extra "study": {install}'
    try:
        installed = version("numba")
    except PackageNotFoundError:
        return f"numba is not installed: {remedy}"
    release = tuple(int(number) for number in re.findall(r"\d+", installed)[:2])
    return "" if NUMBA_FROM <= release < NUMBA_BELOW else f"numba {installed} is not supported: {remedy}"


def slot_loops(kinds: Iterable[Acknowledgement], say: Say) -> dict[Acknowledgement, SlotLoop]:
    """Return the slot loop of each kind; ``say`` receives notices about compilation."""
    if hint := why_uncompiled():
        say(hint)
        return {kind: as_python(kind) for kind in kinds}
    return {kind: compiled(kind, say) for kind in kinds}


def compiled(kind: Acknowledgement, say: Say) -> SlotLoop:
    """Return the compiled slot loop of a kind; raise ConfigurationError if it does not compile."""
    import numba
    from numba.core.errors import NumbaError

    # All other properties of a kind are arguments of the loop.
    key = kind.header, kind.states
    if key in _ready:
        return _ready[key]
    folder = cache_folder(kind, version("numba"))
    what = f"compiling the policy study for {kind.name}"
    if folder is None:
        say(f"{what}, about 5 s (each time: there is no folder to keep the machine code in)")
    elif not any(folder.rglob("*.nbi")):
        say(f"{what} on this machine, about 5 s (once: it is kept in {folder})")
    make_compilable(kind)
    with _settings(numba.config, CACHE_DIR=str(folder or ""), **SETTINGS):
        loop: SlotLoop = numba.njit(nogil=True, error_model="numpy", cache=folder is not None)(as_python(kind))
        # No trials: only the types of the arguments matter here.
        case = Case(2)
        try:
            loop(case, new_fleet(kind, case, np.zeros((0, 0), np.int64)))
        except NumbaError as error:
            raise ConfigurationError(
                f"acknowledgement {kind.name!r} cannot be compiled for the policy study; its header may use its "
                f"arguments, ``&``, ``|``, ``~`` and functions of that kind only. Numba says: {str(error).strip()}"
            ) from error
    _ready[key] = loop
    return loop


@contextmanager
def _settings(config: Any, **values: Any) -> Iterator[None]:
    before = {name: getattr(config, name) for name in values}
    for name, value in values.items():
        setattr(config, name, value)
    try:
        yield
    finally:
        for name, value in before.items():
            setattr(config, name, value)
