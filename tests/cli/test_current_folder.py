"""Modules of the current folder are imported only if a file or an option names them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from missions.files import shipped

OPTIONAL = (
    "bottleneck", "cython", "envwrap", "fsspec", "networkx", "numexpr", "org", "orjson", "pytz", "scikits", "sksparse",
    "uarray",
)  # fmt: skip
"""Modules that libraries try to import, and go on without."""
SHORT = ("--set", "scenario.duration_s=30")
MINE = """
import helper
from remoras.strategies.remoras import Remoras

class Strategy(Remoras):
    def adapt(self, work):
        import later
        return super().adapt(work)

Mine = Strategy()
"""


ONE_BY_ONE = """
import ast, sys
from remoras.__main__ import main
for words in ast.literal_eval(sys.argv[1]):
    sys.argv[1:] = words
    try:
        main()
    except SystemExit as end:
        if end.code not in (None, 0, 1):
            raise
"""


def called(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run Python in a folder, as a separate process."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def command(folder: Path, *words: object, module: bool = False) -> subprocess.CompletedProcess[str]:
    """Run ``remoras`` in a folder, as a separate process."""
    begin = ["-m", "remoras"] if module else ["-P", "-c", "from remoras.__main__ import main; main()"]
    return called(folder, *begin, *map(str, words))


def executed(folder: Path) -> list[str]:
    """Names of the planted modules that were executed."""
    return sorted(path.name for path in (folder / "executed").iterdir())


def plant(folder: Path, *names: str, more: str = "") -> None:
    """Put modules into a folder that leave a file in ``executed`` when they are executed."""
    (folder / "executed").mkdir(exist_ok=True)
    for name in names:
        text = f"open({str(folder / 'executed' / name)!r}, 'w').close()\n{more}"
        (folder / f"{name}.py").write_text(text, encoding="utf-8")


def study(folder: Path) -> None:
    """Write a study of two short runs."""
    head, _, tail = shipped()["mapping-rendezvous"].read_text(encoding="utf-8").partition("duration_s")
    (folder / "short.toml").write_text(f"{head}duration_s = 30 #{tail}", encoding="utf-8")
    text = '[study]\nname = "two"\nscenario = "short.toml"\nrepeats = 2\n'
    (folder / "study.toml").write_text(text, encoding="utf-8")


@pytest.mark.slow
def test_no_command_executes_modules_of_the_current_folder(tmp_path: Path) -> None:
    plant(tmp_path, *OPTIONAL, "numpy", "pyarrow")
    study(tmp_path)
    commands = [
        ["run", "mapping-rendezvous", *SHORT, "--out", "dive"],
        ["query", "dive", "SELECT ?s WHERE { ?s ?p ?o } LIMIT 1"],
        ["export", "dive", "--format", "csv", "--out", "tables"],
        ["export", "dive", "--format", "ttl", "--out", "dive.ttl"],
        ["sweep", "study.toml", "--jobs", "2", "--out", "swept"],
    ]
    done = called(tmp_path, "-P", "-c", ONE_BY_ONE, repr(commands))
    assert done.returncode == 0, done.stderr
    assert executed(tmp_path) == []


@pytest.mark.slow
def test_python_m_imports_installed_libraries_only(tmp_path: Path) -> None:
    plant(tmp_path, *OPTIONAL, "numpy", "pyarrow", "pydantic")
    assert command(tmp_path, "validate", "mapping-rendezvous", module=True).returncode == 0
    assert executed(tmp_path) == []


@pytest.mark.slow
def test_a_named_plug_in_can_import_its_neighbours_at_any_time(tmp_path: Path) -> None:
    plant(tmp_path, "helper", "later", "orjson")
    plant(tmp_path, "mine", more=MINE)
    done = command(tmp_path, "run", "mapping-rendezvous", "--strategy", "mine:Mine", *SHORT, "--json")
    assert done.returncode in (0, 1), done.stderr
    assert executed(tmp_path) == ["helper", "later", "mine"]


@pytest.mark.slow
def test_workers_of_a_sweep_find_a_named_plug_in(tmp_path: Path) -> None:
    plant(tmp_path, "orjson", "numpy")
    inner = tmp_path / "inner"
    inner.mkdir()
    plant(inner, "helper", "later", "networkx")
    plant(inner, "mine", more=MINE)
    study(tmp_path)
    done = command(
        tmp_path, "sweep", "study.toml", "--strategy", "inner/mine.py:Mine", "--jobs", "2", "--out", "swept", "--json"
    )
    assert done.returncode in (0, 1), done.stderr
    assert '"failed": 0' in done.stdout, done.stdout
    assert executed(tmp_path) == []
    assert executed(inner) == ["helper", "later", "mine"]
