"""Tables of ontologies that are kept between processes: the same tables, never those of another text, never trusted."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

from worldmodel import Source, caches, core_ontology_paths, kept
from worldmodel.owl import ontology_path
from worldmodel.tbox import TBox
from worldmodel.turtle import compile_tbox

FILES = (*core_ontology_paths(), ontology_path("formation"))
SOURCES = tuple(Source(path.name, path.read_text(encoding="utf-8")) for path in FILES)
READ = (
    "import sys; from worldmodel import core_ontology_paths, read_tbox;"
    "print(read_tbox(*core_ontology_paths()), 'rdflib' in sys.modules)"
)


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "remoras" / "ontologies"


@pytest.fixture(scope="module")
def compiled() -> TBox:
    return compile_tbox(SOURCES)


def in_another_process(cache: Path) -> str:
    environment = {**os.environ, "XDG_CACHE_HOME": str(cache.parents[1])}
    done = subprocess.run([sys.executable, "-c", READ], capture_output=True, text=True, check=True, env=environment)
    return done.stdout.strip()


def test_what_is_kept_is_what_was_compiled(compiled: TBox):
    kept.keep(compiled)
    read = kept.kept(SOURCES)
    assert read is not None
    assert (read.classes, read.attributes, read.disjoint, read.axioms, read.sources) == (
        compiled.classes, compiled.attributes, compiled.disjoint, compiled.axioms, compiled.sources,
    )  # fmt: skip
    assert (read, read.hash, vars(read).keys()) == (compiled, compiled.hash, vars(compiled).keys())
    assert [a.encode(a.decode((1,))) for a in read.attributes if a.kind.value == "number"] == [
        a.encode(a.decode((1,))) for a in compiled.attributes if a.kind.value == "number"
    ]
    assert [a.most_bytes for a in read.attributes] == [a.most_bytes for a in compiled.attributes]


def test_the_next_process_reads_no_turtle(cache: Path):
    first, then = in_another_process(cache), in_another_process(cache)
    assert first.endswith("True")
    assert then.endswith("False")
    assert first.split()[:2] == then.split()[:2]


def test_another_text_or_another_program_is_another_file(compiled: TBox, monkeypatch: pytest.MonkeyPatch):
    kept.keep(compiled)
    changed = (*SOURCES[:-1], Source(SOURCES[-1].path, SOURCES[-1].text + "\n# a comment\n"))
    assert kept.kept(changed) is None
    assert kept.kept(SOURCES[:-1]) is None
    assert kept.kept(SOURCES) is not None
    monkeypatch.setattr(kept, "_code", lambda: b"another version")
    assert kept.kept(SOURCES) is None


def test_what_was_cut_short_or_changed_is_compiled_anew(compiled: TBox, cache: Path):
    kept.keep(compiled)
    (file,) = cache.iterdir()
    whole = file.read_bytes()
    for length in (*range(0, len(whole), 997), len(whole) - 1):
        file.write_bytes(whole[:length])
        assert kept.kept(SOURCES) is None
    for place in range(0, len(whole), 997):
        file.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        assert kept.kept(SOURCES) is None
    assert in_another_process(cache).endswith("True")
    kept.keep(compiled)
    assert file.read_bytes() == whole


@pytest.mark.parametrize("tables", ["[1, 2", "[[], [], []]", '[[{"system": ["ls"]}], [], [], []]', "[[], [], [], {}]"])
def test_a_file_of_something_else_is_none(tables: str, compiled: TBox, cache: Path):
    kept.keep(compiled)
    (file,) = cache.iterdir()
    file.write_bytes(hashlib.sha256(tables.encode()).digest() + tables.encode())
    assert kept.kept(SOURCES) is None


def test_where_nothing_can_be_written_nothing_is_kept(compiled: TBox, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    kept.keep(compiled)
    assert kept.kept(SOURCES) is None
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setattr(Path, "home", lambda: (_ for _ in ()).throw(RuntimeError("no home")))
    kept.keep(compiled)
    assert kept.kept(SOURCES) is None


def test_the_oldest_go(compiled: TBox, cache: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(caches, "MOST_FILES", 3)
    cache.mkdir(parents=True)
    for number in range(5):
        (cache / str(number)).write_text("")
        os.utime(cache / str(number), (number, number))
    kept.keep(compiled)
    names = {path.name for path in cache.iterdir()}
    assert len(names) == 3
    assert {"3", "4"} < names
