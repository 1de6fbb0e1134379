"""The one place that knows Numba: turns the slot loop of the policy study into machine code.

A vehicle never comes here. The code is kept on disk for the next study, in a folder whose name is a digest of all
sources it was made from: Numba by itself looks at one of them only. Where nothing can be written, the code is made anew
in each process.
"""

import hashlib
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from exchange import ack, policies, selection
from exchange.acoustics import loss
from exchange.study import montecarlo, trial

MachineCode = Callable[..., None]
"""Takes what `montecarlo.run_trials` takes."""

Say = Callable[[str], None]
"""Takes a line of text for the user."""

SOURCES = (ack, policies, selection, loss, trial, montecarlo)

INLINED: tuple[Callable[..., Any], ...] = (
    ack.packet_meant,
    ack.open_slot,
    ack.compose,
    ack.unite_matrices,
    ack.add_pseudo_acknowledgements,
    ack.absorb,
    ack.learn_from_row,
    ack.learn_from_matrix,
    ack.all_if,
    ack.carried_items,
    ack.settled,
    policies.acknowledgement_bits,
    loss.mixed,
    loss.trial_key,
    loss.slot_key,
    loss.link_uniform,
    trial.clear,
    trial.node_state,
    trial.note_progress,
    montecarlo.receivers,
    montecarlo.drawn_receivers,
    montecarlo.fill_packet,
    montecarlo.play_slot,
    montecarlo.count_false_beliefs,
    montecarlo.run_trial,
)
"""What every slot of every trial runs through, and what hands over its constants."""

CALLED: tuple[Callable[..., Any], ...] = (
    selection.select,
    trial.add_item,
    trial.free_column,
    trial.note_item,
    trial.slots_in_window,
    trial.close_batch,
    trial.close_window,
    montecarlo.poisson_number,
    montecarlo.generate,
)
"""What is run now and then."""

ALLOCATING: tuple[Callable[..., Any], ...] = (trial.new_fleet, montecarlo.run_block)
"""What takes memory: the others get arrays and only look into them, so Numba need not count references there."""

SETTINGS = {"CPU_NAME": "generic", "CPU_FEATURES": "", "LOOP_VECTORIZE": 0}
"""Loops run over a handful of nodes. Vector instructions would wait for the single words that were just stored: with
them a slot of five nodes takes a fifth longer. Without, code that is kept on disk serves every machine of its kind."""

_ready: dict[bool, MachineCode] = {}


def cache_folder(numba_version: str) -> Path | None:
    """Where the machine code is kept, or None if nothing can be written there."""
    digest = hashlib.sha256(f"{sys.implementation.cache_tag} {numba_version}".encode())
    for module in SOURCES:
        digest.update(Path(str(module.__file__)).read_bytes())
    base = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    try:
        folder = (Path(base) if base else Path.home() / ".cache") / "remoras" / digest.hexdigest()[:16]
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except (OSError, RuntimeError):
        return None


@cache
def make_compilable() -> None:
    """Tell Numba that compiled code may call these functions; as Python they stay what they are."""
    from numba.extending import register_jitable

    for function in INLINED:
        register_jitable(forceinline=True, _nrt=False)(function)
    for function in CALLED:
        register_jitable(_nrt=False)(function)
    for function in ALLOCATING:
        register_jitable(forceinline=True)(function)


def compiled(narrow: bool, say: Say) -> MachineCode:
    """The slot loop as machine code, ready to run, from the disk if it was made before.

    Args:
        narrow: all items fit into one word: `montecarlo.run_narrow_trials`, else `montecarlo.run_trials`.
        say: is told before work that takes some seconds.
    """
    if narrow not in _ready:
        function = montecarlo.run_narrow_trials if narrow else montecarlo.run_trials
        folder = cache_folder(version("numba"))
        if folder is None:
            say("compiling the policy study, about 10 s (each time: there is no folder to keep the machine code in)")
        elif not any(folder.rglob(f"*{function.__name__}*.nbi")):
            say(f"compiling the policy study for this machine, about 10 s (once: it is kept in {folder})")
        _ready[narrow] = _compile(function, folder)
    return _ready[narrow]


def _compile(function: MachineCode, folder: Path | None) -> MachineCode:
    import numba

    make_compilable()
    with _settings(numba.config, CACHE_DIR=str(folder or ""), **SETTINGS):
        machine_code: MachineCode = numba.njit(nogil=True, error_model="numpy", cache=folder is not None)(function)
        # No trials: only the types of the arguments matter here.
        rules = trial.Rules(0, False, False, 2, 1)
        load = trial.Load(1, 1, 0.0, 1, 1, 0, 0, 0)
        received, outcomes = np.zeros((0, 1), np.int64), np.zeros((0, trial.N_QUANTITIES, 3), np.int64)
        machine_code(rules, load, np.ones((2, 2)), 0, 0, received, outcomes)
    return machine_code


@contextmanager
def _settings(config: Any, **values: Any) -> Iterator[None]:
    """Set options of Numba, which are global, for a while."""
    before = {name: getattr(config, name) for name in values}
    for name, value in values.items():
        setattr(config, name, value)
    try:
        yield
    finally:
        for name, value in before.items():
            setattr(config, name, value)
