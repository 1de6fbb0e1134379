"""Benchmarks by name: each module with rows can be run, and only those."""

from importlib import import_module
from pathlib import Path

from benchmarks.__main__ import BENCHMARKS

PARTS = {"dividing"}
"""Modules whose rows are printed by another one."""


def test_each_named_benchmark_has_rows_and_each_module_with_rows_is_named() -> None:
    assert all(callable(import_module(f"benchmarks.{name}").rows) for name in BENCHMARKS)
    folder = Path(import_module("benchmarks").__path__[0])
    with_rows = {path.stem for path in folder.glob("*.py") if "\ndef rows(" in path.read_text(encoding="utf-8")}
    assert with_rows - PARTS == set(BENCHMARKS)
