"""Processes with different hash seeds: set order, hash() and id() differ."""

import os
import subprocess
import sys

from remoras.plugins import plugin_folders

HASH_SEEDS = ("1", "2")


def printed_by_each(code: str) -> list[str]:
    """Run code in each process, with the import paths of this one; return the outputs."""
    program = (
        f"import sys; sys.path[:0] = {sys.path!r}\n"
        f"from remoras.plugins import look_in\nlook_in({plugin_folders()!r})\n{code}"
    )
    started = [
        subprocess.Popen(
            [sys.executable, "-c", program],
            env={**os.environ, "PYTHONHASHSEED": seed},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for seed in HASH_SEEDS
    ]
    said = [process.communicate() for process in started]
    assert all(process.returncode == 0 for process in started), f"cannot be run in another process: {said[0][1]}"
    return [printed for printed, _ in said]
