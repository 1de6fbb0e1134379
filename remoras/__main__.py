"""Entry point of ``remoras`` and of ``python -m remoras``: interruptions are heeded before anything else is loaded."""

from remoras.interruption import heed
from remoras.plugin_folders import drop_current_folder


def main() -> None:
    """Do what the command line says."""
    heed()
    from remoras.cli import main as command

    command()


if __name__ == "__main__":  # python -m remoras
    drop_current_folder()
    main()
