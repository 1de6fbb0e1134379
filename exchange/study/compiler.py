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
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

import numpy as np

from exchange.errors import ConfigurationError
from exchange.policy import planning, policies
from exchange.policy.acknowledgement import Acknowledgement
from exchange.study import stating, trial, trials
from exchange.study.trial import Floats, Ints, Load, PolicyRules
from exchange.study.trials import Header, Layouts, layouts_of

SlotLoop = Callable[..., None]
"""Signature of `trials.run_trials` without the header, which is built in."""

Say = Callable[[str], None]
"""Prints a line for the user."""

CALLED: tuple[Callable[..., Any], ...] = (
    trial.generate,
    trial.note_item,
    trial.close,
    trials.draw,
    trials.transpose,
    trials.forget_lanes,
    trials.begin,
    trials.arrive,
    trials.ended,
    trials.choose,
    trials.pass_freely,
    planning.plan_packet,
    stating.compose_packet,
    stating.hear,
    stating.add_symbol,
    stating.number_item,
)
"""Functions that run rarely and are called; all others run in every slot and are inlined."""

ALLOCATING: tuple[Callable[..., Any], ...] = (
    trials.new_fleet,
    trials.new_lanes,
    trials.thresholds_of,
    trials.run_trials,
    stating.new_statements,
    stating.new_plan,
    stating.run_stating_trials,
)
"""Functions that allocate memory; in all others Numba can skip reference counting."""

NUMBA_FROM, NUMBA_BELOW = (0, 66), (0, 69)
"""Supported versions of Numba; the extra `study` of the package has the same bounds."""

SETTINGS = {"CPU_NAME": "generic", "CPU_FEATURES": "", "LOOP_VECTORIZE": 0}
"""Settings of Numba for code that is portable between machines of one kind.

Vector instructions wait for words just stored: they make a slot of five nodes a fifth slower.
"""


HEADER: Header = policies.ACK.header
"""Placeholder for the header rule; `_compile` replaces it in a copy of the entry."""


def run_trials(
    layouts: Layouts, rules: PolicyRules, load: Load, p_loss: Floats, seed: int, first_trial: int, received: Ints,
    outcomes: Ints,
) -> None:  # fmt: skip
    """Entry point of compiled code: `trials.run_trials` with the header rule built in."""
    trials.run_trials(HEADER, layouts, rules, load, p_loss, seed, first_trial, received, outcomes)


def run_stating_trials(
    layouts: Layouts, rules: PolicyRules, load: Load, p_loss: Floats, seed: int, first_trial: int, received: Ints,
    outcomes: Ints,
) -> None:  # fmt: skip
    """Entry point of compiled code for policies that report received sets."""
    stating.run_stating_trials(HEADER, layouts, rules, load, p_loss, seed, first_trial, received, outcomes)


def reached(*functions: FunctionType) -> dict[FunctionType, None]:
    """Return these functions and all plain functions that they reach by name, callees first.

    Functions of NumPy are excluded, since Numba replaces them globally.
    """
    called: dict[FunctionType, None] = {}
    visited: set[FunctionType] = set()

    def visit(function: FunctionType) -> None:
        if function in visited:
            return
        visited.add(function)
        for value in _globals_named(function):
            if isinstance(value, FunctionType) and value.__module__.partition(".")[0] != "numpy":
                visit(value)
        called[function] = None

    for function in functions:
        visit(function)
    return called


def _globals_named(function: FunctionType) -> list[Any]:
    """Return the global values named in a function, also behind module names."""
    names = function.__code__.co_names
    values = [function.__globals__[name] for name in names if name in function.__globals__]
    values += inspect.getclosurevars(function).nonlocals.values()
    of_modules = [getattr(v, name) for v in values if isinstance(v, ModuleType) for name in names if hasattr(v, name)]
    return [value for value in (*values, *of_modules) if not isinstance(value, ModuleType)]


def functions_of(kind: Acknowledgement) -> dict[FunctionType, None]:
    """Return all functions of a kind's slot loop, callees first."""
    loop = stating.run_stating_trials if kind.states else trials.run_trials
    return reached(*[part for part in (kind.header, loop) if isinstance(part, FunctionType)])


def cache_folder(kind: Acknowledgement, numba_version: str) -> Path | None:
    """Return the cache folder of the machine code; None if it is not writable.

    The digest covers the sources of all functions reached and the numeric globals that they use.
    """
    header = f"{kind.header.__module__}.{kind.header.__qualname__}"
    known = sys.implementation.cache_tag, numba_version, header, kind.states
    digest = hashlib.sha256(repr(known).encode())
    functions = functions_of(kind)
    sources = {__file__, *(inspect.getsourcefile(function) or "" for function in functions)}
    for source in sorted(sources - {""}):
        digest.update(Path(source).read_bytes())
    for function in functions:
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


WITHOUT_MEMORY: dict[str, Any] = {"_nrt": False}
"""Option of functions without allocation: Numba counts no references in them."""

_compilable: set[FunctionType] = set()
_ready: dict[tuple[Header, bool], SlotLoop] = {}
"""Compiled loops by header rule and by whether packets report received sets."""


def make_compilable(kind: Acknowledgement) -> None:
    """Register the functions of the slot loop with Numba; as Python they stay unchanged."""
    from numba.extending import register_jitable

    for function in functions_of(kind):
        if function in _compilable:
            continue
        _compilable.add(function)
        if function in ALLOCATING:
            register_jitable(forceinline=True)(function)
        elif function in CALLED:
            register_jitable(**WITHOUT_MEMORY)(function)
        else:
            register_jitable(forceinline=True, **WITHOUT_MEMORY)(function)


def why_uncompiled() -> str:
    """Explain why the slot loop cannot be compiled, with the remedy; empty if it can."""
    low, high = (".".join(map(str, bound)) for bound in (NUMBA_FROM, NUMBA_BELOW))
    install = f'pip install "numba>={low},<{high}"'
    remedy = f'the policy study runs uncompiled, with the same numbers, slowly; for speed the extra "study": {install}'
    try:
        installed = version("numba")
    except PackageNotFoundError:
        return f"numba is not installed: {remedy}"
    release = tuple(int(number) for number in re.findall(r"\d+", installed)[:2])
    return "" if NUMBA_FROM <= release < NUMBA_BELOW else f"numba {installed} is none that is known to work: {remedy}"


def as_python(kind: Acknowledgement) -> SlotLoop:
    """Return the slot loop of a kind as Python."""
    return partial(stating.run_stating_trials if kind.states else trials.run_trials, kind.header)


def slot_loops(kinds: Iterable[Acknowledgement], say: Say) -> dict[Acknowledgement, SlotLoop]:
    """Return the slot loop of each kind; ``say`` receives notices about compilation."""
    if hint := why_uncompiled():
        say(hint)
        return {kind: as_python(kind) for kind in kinds}
    return {kind: compiled(kind, say) for kind in kinds}


def compiled(kind: Acknowledgement, say: Say) -> SlotLoop:
    """Return the compiled slot loop of a kind; raise ConfigurationError if it does not compile."""
    key = kind.header, kind.states
    if key not in _ready:
        entry = run_stating_trials if kind.states else run_trials
        folder = cache_folder(kind, version("numba"))
        what = f"compiling the policy study for {kind.name}"
        if folder is None:
            say(f"{what}, about 5 s (each time: there is no folder to keep the machine code in)")
        elif not any(folder.rglob(f"*{entry.__name__}*.nbi")):
            say(f"{what} on this machine, about 5 s (once: it is kept in {folder})")
        _ready[key] = _compile(kind, entry, folder)
    return _ready[key]


def _compile(kind: Acknowledgement, entry: SlotLoop, folder: Path | None) -> SlotLoop:
    import numba
    from numba.core.errors import NumbaError

    make_compilable(kind)
    with _settings(numba.config, CACHE_DIR=str(folder or ""), **SETTINGS):
        header: Any = numba.njit(forceinline=True, error_model="numpy", **WITHOUT_MEMORY)(kind.header)
        assert isinstance(entry, FunctionType)
        of_kind = FunctionType(entry.__code__, {**entry.__globals__, "HEADER": header}, entry.__name__)
        of_kind.__module__, of_kind.__qualname__ = entry.__module__, entry.__qualname__
        machine_code: SlotLoop = numba.njit(nogil=True, error_model="numpy", cache=folder is not None)(of_kind)
        # No trials: only the types of the arguments matter here.
        layouts, rules, load = layouts_of(kind, 2), PolicyRules(False, False, 2), Load(1, 1, 0.0, 1, 1, 0, 0, 0)
        received, outcomes = np.zeros((0, 1), np.int64), np.zeros((0, trial.N_QUANTITIES, 3), np.int64)
        try:
            machine_code(layouts, rules, load, np.ones((2, 2)), 0, 0, received, outcomes)
        except NumbaError as error:
            raise ConfigurationError(
                f"acknowledgement {kind.name!r} cannot be compiled for the policy study; its header may use its "
                f"arguments, ``&``, ``|``, ``~`` and functions of that kind only. Numba says: {str(error).strip()}"
            ) from error
    return machine_code


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
