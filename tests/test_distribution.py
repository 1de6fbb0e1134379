"""Metadata of the distribution: its name, its version, its requirements."""

import re
import tomllib
from pathlib import Path

import remoras
from exchange.study import compiler

ROOT = Path(__file__).parents[1]
DECLARED = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT = DECLARED["project"]
PACKAGES = [name.removesuffix("*") for name in DECLARED["tool"]["setuptools"]["packages"]["find"]["include"]]
TEXTS = [
    *ROOT.glob("*.md"),
    *(ROOT / "docs").rglob("*.md"),
    *(p for name in PACKAGES for p in (ROOT / name).rglob("*.py")),
]


def test_the_distribution_name_is_unique() -> None:
    """In the public index \"remoras\" is somebody else's."""
    assert PROJECT["name"] == "remoras-sim"
    assert PROJECT["scripts"] == {"remoras": "remoras.__main__:main"}


def test_install_hints_name_this_distribution() -> None:
    advice = re.compile(r"(pip|pipx|uv)\b[^`\n]*\binstall\b[^`\n]*[ \"']remoras(?!-sim)\b", re.IGNORECASE)
    assert len(TEXTS) > 100
    assert [path.name for path in TEXTS if advice.search(path.read_text(encoding="utf-8"))] == []


def test_the_version_is_declared_once() -> None:
    assert PROJECT["dynamic"] == ["version"]
    assert f"version: {remoras.__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_the_bounds_of_numba_are_those_of_the_extra() -> None:
    low, high = (".".join(map(str, bound)) for bound in (compiler.NUMBA_FROM, compiler.NUMBA_BELOW))
    numba, extras = f"numba>={low},<{high}; python_version < '3.15'", PROJECT["optional-dependencies"]
    assert extras["study"] == [numba]
    assert numba in extras["dev"]
    assert not [one for one in PROJECT["dependencies"] if one.startswith("numba")]
