"""Entry point of ``remoras`` and of ``python -m remoras``: interruptions are heeded before anything else is loaded."""

import gc
import os

from remoras.interruption import heed
from remoras.plugins import drop_current_folder

NO_PYDANTIC_PLUGINS = "PYDANTIC_DISABLE_PLUGINS"
"""Variable of the environment by which pydantic does not ask every package that is installed for plug-ins of it."""
ARROWS_MEMORY = "ARROW_DEFAULT_MEMORY_POOL"
"""Variable of the environment by which Arrow takes memory from the system: its own pool gives back little of it."""
RARELY = 200_000
"""Objects made between two looks for garbage: nearly all that is loaded stays, and there is little to be found."""


def main() -> None:
    """Do what the command line says."""
    heed()
    gc.set_threshold(RARELY)
    os.environ.setdefault(NO_PYDANTIC_PLUGINS, "true")
    os.environ.setdefault(ARROWS_MEMORY, "system")
    try:
        from remoras.cli import main as command

        command()
    finally:
        gc.freeze()  # the process ends: all that is left goes with it, and nobody need look through it once more


if __name__ == "__main__":  # python -m remoras
    drop_current_folder()
    main()
