"""Claims of the security page: nothing is fetched, no format can carry code."""

import re
import socket
from pathlib import Path

import pytest

from worldmodel import OntologyError, core_ontology_paths, read_tbox

ROOT = Path(__file__).parents[2]
PACKAGES = ("worldmodel", "exchange", "remoras", "missions", "visualisation")


def test_an_ontology_that_imports_from_elsewhere_is_refused_and_nothing_is_fetched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def connected(*_: object) -> None:
        raise AssertionError("something is fetched")

    monkeypatch.setattr(socket.socket, "connect", connected)
    path = tmp_path / "theirs.ttl"
    path.write_text(
        "@prefix owl: <http://www.w3.org/2002/07/owl#> .\n"
        "<http://example.org/a> a owl:Ontology ; owl:imports <http://127.0.0.1:9/b> .\n",
        encoding="utf-8",
    )
    with pytest.raises(OntologyError, match="which is not among the files read"):
        read_tbox(*core_ontology_paths(), path)


def test_no_source_reads_formats_that_carry_code_or_fetch() -> None:
    """Turtle alone is parsed, and lives of vehicles are copied through bytes that stay in memory."""
    excepted = {("remoras/testing/behaviours.py", "import pickle")}
    barred = re.compile(
        r"\b(?:import (?:pickle|marshal|shelve|yaml|urllib|requests)|from (?:pickle|urllib|requests)\b|np\.load\()"
        r"|allow_pickle|(?<![\w.\"'])eval\(|(?<![\w.])exec\("
    )
    parsed = re.compile(r"\.parse\([^\n]*format=\"(\w+)\"")
    formats = set()
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            text = path.read_text(encoding="utf-8")
            name = path.relative_to(ROOT).as_posix()
            found = [each for each in barred.findall(text) if (name, each) not in excepted]
            assert not found, path
            formats |= set(parsed.findall(text))
    assert formats == {"turtle"}
