"""`remoras query` ends at its time limit and its row limit."""

import json
import subprocess
import time
from pathlib import Path

import pytest
from invoked import COMMAND, remoras

PATHS = "SELECT * { ?a (rdf:type|!rdf:type)* ?b . ?b (rdf:type|!rdf:type)* ?c }"
PAIRS = "SELECT * { ?a ?b ?c . ?d ?e ?f }"


@pytest.mark.slow
def test_a_runaway_query_ends_in_one_line(results: Path) -> None:
    words = ["query", str(results), PATHS, "--timeout-s", "2", "--json"]
    began_s = time.monotonic()
    done = subprocess.run([*COMMAND, *words], capture_output=True, text=True, check=False)
    assert time.monotonic() - began_s < 60.0
    assert done.returncode == 2
    assert done.stderr == "remoras: the query is not answered within 2 s; ask for less, or allow more time\n"
    assert "within 2 s" in json.loads(done.stdout)["error"]


def test_shown_rows_are_limited_and_the_limit_is_stated(results: Path) -> None:
    done = remoras("query", results, PAIRS, "--limit", 5, "--json")
    assert done.exit_code == 0
    assert len(json.loads(done.stdout)) == 5
    assert done.stderr == "remoras: only the first 5 rows are shown; --limit N shows more\n"
    few = remoras("query", results, "ASK { ?a ?b ?c }", "--vehicle", "AUV01", "--limit", 1, "--json")
    assert (json.loads(few.stdout), few.stderr) == ([{"answer": True}], "")
