"""The shipped scenario of escorts for tests: its tables, and runs of it with settings changed."""

from varied import Varied

LINES = Varied("escort-lines", "lines.toml")
raw, written, flown = LINES.raw, LINES.written, LINES.flown
