"""Version of this program, its results, and sweeps that it can resume."""

__version__ = "0.1.0"
