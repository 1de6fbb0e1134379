"""Tables of ontologies that are kept between processes: the same tables, never those of another text, never trusted."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

from worldmodel import core_ontology_paths, disk_cache, ontology_path, read_tbox

FILES = (*core_ontology_paths(), ontology_path("formation"))
READ = """
import sys
from worldmodel import Source, core_ontology_paths, ontology_path, read_tbox
t = read_tbox(*core_ontology_paths(), ontology_path("formation"), Source("own.ttl", sys.argv[1]))
print("rdflib" in sys.modules)
print(t.hash, [(getattr(t, name)) for name in ("classes", "attributes", "disjoint", "axioms", "individuals")],
      [(a.most_bytes, a.drift) for a in t.attributes])
"""


def in_another_process(base: Path, text: str = "") -> tuple[bool, str]:
    """Return whether a process loads rdflib to read files, and the tables that it has then."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(base)}
    done = subprocess.run(
        [sys.executable, "-c", READ, text], capture_output=True, text=True, check=True, env=environment
    )
    loaded, tables = done.stdout.split("\n", 1)
    return loaded == "True", tables.strip()


def test_the_next_process_reads_no_turtle_unless_the_text_is_another(tmp_path: Path):
    first, then = in_another_process(tmp_path), in_another_process(tmp_path)
    assert (first[0], then[0]) == (True, False)
    assert first[1] == then[1]
    assert first[1].startswith(str(read_tbox(*FILES).hash))
    assert in_another_process(tmp_path, "# a comment") == first


@pytest.mark.parametrize("tables", [None, b"[1, 2", b"[[], [], []]", b'[[{"system": ["ls"]}], [], [], [], []]'])
def test_a_file_that_is_not_whole_or_of_something_else_is_compiled_anew(tables: bytes | None, tmp_path: Path):
    first = in_another_process(tmp_path)
    (file,) = (tmp_path / "remoras" / "ontologies").iterdir()
    whole = file.read_bytes()
    file.write_bytes(whole[:-1] if tables is None else hashlib.sha256(tables).digest() + tables)
    assert in_another_process(tmp_path) == first
    assert file.read_bytes() == whole


def test_where_nothing_can_be_written_nothing_is_kept(tmp_path: Path):
    (tmp_path / "file").write_text("")
    assert in_another_process(tmp_path / "file") == in_another_process(tmp_path / "file")


def test_the_oldest_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(disk_cache, "MOST_FILES", 3)
    for number in range(5):
        disk_cache.keep_file("kind", bytes([number]), b"")
        os.utime(tmp_path / "remoras" / "kind" / f"0{number}", (number, number))
    assert {path.name for path in (tmp_path / "remoras" / "kind").iterdir()} == {"02", "03", "04"}
