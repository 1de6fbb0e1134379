"""Tests that are not fast are named in ``tiers.toml``."""

import tomllib
from pathlib import Path

from tests.tools import tiers

ROOT = Path(__file__).parents[1]


def test_every_test_that_is_named_is_there() -> None:
    named = [name for names in tomllib.loads(tiers.FILE.read_text(encoding="utf-8")).values() for name in names]
    missing = [
        name
        for name in named
        for file, _, test in [name.partition("::")]
        if not (ROOT / file).is_file()
        or (
            file.startswith("tests/")
            and f"def {test.rpartition('::')[2]}(" not in (ROOT / file).read_text(encoding="utf-8")
        )
    ]
    assert not missing, "\n".join(missing)
    assert len(named) == len(set(named))


def test_all_cases_of_a_function_count_together() -> None:
    log = """
  4.00s call     tests/a/test_b.py::test_c[one of 1.5 s]
  0.50s setup    tests/a/test_b.py::test_c[two]
  0.60s call     tests/a/test_b.py::test_c[two]
  1.20s call     tests/a/test_b.py::TestD::test_e
  9.00s call     tests/reference/test_b.py::test_c
  0.99s teardown tests/a/test_b.py::test_f
"""
    lists = tomllib.loads(tiers.text(tiers.times_s(log)))
    assert lists == {
        "slow": ["tests/a/test_b.py::test_c"],
        "moderate": ["tests/a/test_b.py::TestD::test_e", "tests/reference/test_b.py::test_c"],
    }
