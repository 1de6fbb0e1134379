"""What the package says of itself to those who install it: its name, its version, what it needs."""

import importlib.metadata
import re
import tomllib
from pathlib import Path

import pytest

import remoras
from exchange.study import compiler, study
from exchange.study.parameters import ExchangeStudy

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
TEXTS = [
    path
    for pattern in ("*.md", "docs/**/*.md", "docs/**/*.ipynb", "*/**/*.py")
    for path in ROOT.glob(pattern)
    if not path.is_relative_to(ROOT / "tests") and ".venv" not in path.parts and "build" not in path.parts
]


def test_the_distribution_has_a_name_of_its_own() -> None:
    """In the public index \"remoras\" is somebody else's."""
    assert PROJECT["name"] == "remoras-sim"
    assert PROJECT["scripts"] == {"remoras": "remoras.__main__:main"}


def test_nobody_is_told_to_install_somebody_elses_package() -> None:
    advice = re.compile(r"(pip|pipx|uv)\b[^`\n]*\binstall\b[^`\n]*[ \"']remoras(?!-sim)\b", re.IGNORECASE)
    assert len(TEXTS) > 100
    assert [path.name for path in TEXTS if advice.search(path.read_text(encoding="utf-8"))] == []


def test_the_version_is_said_once() -> None:
    assert PROJECT["dynamic"] == ["version"]
    assert f"version: {remoras.__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_the_bounds_of_numba_are_those_of_the_extra() -> None:
    low, high = (".".join(map(str, bound)) for bound in (compiler.NUMBA_FROM, compiler.NUMBA_BELOW))
    numba, extras = f"numba>={low},<{high}; python_version < '3.15'", PROJECT["optional-dependencies"]
    assert extras["study"] == [numba]
    assert numba in extras["dev"]
    assert not [one for one in PROJECT["dependencies"] if one.startswith("numba")]


@pytest.mark.parametrize(
    ("found", "says"),
    [(None, "numba is not installed"), ("0.69.0", "numba 0.69.0 is none"), ("0.65.1", "numba 0.65.1")],
)
def test_without_a_fitting_numba_the_study_runs_uncompiled_with_a_hint(
    found: str | None, says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = ExchangeStudy(nodes=3, per=(0.3,), policies=("ack",), trials=5)
    compiled = study.run(asked)

    def version(name: str) -> str:
        if found is None:
            raise importlib.metadata.PackageNotFoundError(name)
        return found

    monkeypatch.setattr(compiler, "version", version)
    monkeypatch.setattr(compiler, "compiled", lambda *_: pytest.fail("compiled"))
    said: list[str] = []
    rows = study.run(asked, say=said.append)
    assert len(said) == 1
    assert says in said[0]
    assert 'the extra "study": pip install "numba>=0.66,<0.69"' in said[0]
    assert "\n" not in said[0]
    assert [row.delivered_slots for row in rows] == [row.delivered_slots for row in compiled]
    assert [row.senders_acked_slots for row in rows] == [row.senders_acked_slots for row in compiled]
