"""Version of this program: of the distribution, of results, and of what a sweep goes on with."""

__version__ = "0.1.0"
