"""Entry point of ``remoras`` and of ``python -m remoras``: interruptions are heeded before anything else is loaded."""

from remoras.interruption import heed


def main() -> None:
    """Do what the command line says."""
    heed()
    from remoras.cli import main as command

    command()


if __name__ == "__main__":
    main()
