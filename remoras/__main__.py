"""Entry point of ``remoras`` and ``python -m remoras``; handles signals before imports."""

import gc
import os

from remoras.plugins import drop_current_folder
from remoras.process import heed

NO_PYDANTIC_PLUGINS = "PYDANTIC_DISABLE_PLUGINS"
"""Environment variable that stops pydantic from searching installed packages for plug-ins."""
ARROWS_MEMORY = "ARROW_DEFAULT_MEMORY_POOL"
"""Environment variable for Arrow's allocator: its own pool returns little memory."""
RARELY = 200_000
"""New objects between garbage collections: nearly all loaded objects stay."""


def main() -> None:
    """Execute the command line."""
    heed()
    gc.set_threshold(RARELY)
    os.environ.setdefault(NO_PYDANTIC_PLUGINS, "true")
    os.environ.setdefault(ARROWS_MEMORY, "system")
    try:
        from remoras.cli import main as command

        command()
    finally:
        gc.freeze()  # spare the final collection: the process ends


if __name__ == "__main__":  # python -m remoras
    drop_current_folder()
    main()
