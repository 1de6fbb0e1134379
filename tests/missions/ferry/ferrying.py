"""The shipped passage for tests: its tables, and runs of it with settings changed."""

from varied import Varied

PASSAGE = Varied("ferry-passage", "reef.toml")
raw, written, ferried = PASSAGE.raw, PASSAGE.written, PASSAGE.flown
