"""What ``explain`` and completion say of keys is kept between processes, and is never that of another program."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from missions.scenarios.explanations import explanations
from missions.sweeps.study import study_explanations
from remoras.cli import keys
from remoras.cli.keys import explained
from worldmodel import disk_cache

TOLD = (
    "import sys; from remoras.cli.keys import explained; explained();"
    "print(*sorted(name.partition('.')[0] for name in sys.modules))"
)
OURS = {"worldmodel", "exchange", "remoras", "missions", "visualisation"}


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "remoras" / "keys"


def in_another_process(cache: Path) -> set[str]:
    """The packages that it loads."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(cache.parents[1])}
    done = subprocess.run([sys.executable, "-c", TOLD], capture_output=True, text=True, check=True, env=environment)
    return set(done.stdout.split())


def test_what_is_kept_is_what_the_tables_say(cache: Path):
    made = {"scenario": explanations(), "study": study_explanations()}
    assert explained() == made
    (file,) = cache.iterdir()
    assert explained() == made
    assert [file] == [*cache.iterdir()]


def test_the_next_process_loads_no_tables(cache: Path):
    assert "pydantic" in in_another_process(cache)
    assert "pydantic" not in in_another_process(cache)


def test_every_package_that_is_loaded_to_make_them_is_in_the_digest(cache: Path, monkeypatch: pytest.MonkeyPatch):
    read: list[Path] = []
    monkeypatch.setattr(keys, "files_digest", lambda files: bytes(read.extend(files) or 1))
    explained()
    assert in_another_process(cache) & OURS == {file.relative_to(keys.ROOT).parts[0] for file in read}
    assert keys.ROOT / "missions" / "mapping" / "rendezvous.toml" in read
    assert keys.ROOT / "missions" / "features" / "current.py" in read


@pytest.mark.parametrize("content", ["", "[]", "{", '{"scenario": 1}', '{"scenario": {"channel.per": "a number"}}'])
def test_a_file_of_something_else_is_made_anew(content: str, cache: Path):
    whole = explained()
    (file,) = cache.iterdir()
    disk_cache.keep_file("keys", bytes.fromhex(file.name), content.encode())
    assert disk_cache.read_kept("keys", bytes.fromhex(file.name)) == content.encode()
    assert explained() == whole


def test_where_nothing_can_be_written_the_tables_are_asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert explained()["scenario"] == explanations()
