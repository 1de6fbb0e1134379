"""`remoras query` ends at its row limit."""

import json
from pathlib import Path

from invoked import remoras

PAIRS = "SELECT * { ?a ?b ?c . ?d ?e ?f }"


def test_shown_rows_are_limited_and_the_limit_is_stated(results: Path) -> None:
    done = remoras("query", results, PAIRS, "--limit", 5, "--json")
    assert done.exit_code == 0
    assert len(json.loads(done.stdout)) == 5
    assert done.stderr == "remoras: only the first 5 rows are shown; --limit N shows more\n"
    few = remoras("query", results, "ASK { ?a ?b ?c }", "--vehicle", "AUV01", "--limit", 1, "--json")
    assert (json.loads(few.stdout), few.stderr) == ([{"answer": True}], "")
