"""Docstrings of each package use the field's language: few phrases that lack an actor or a technical noun.

Phrases for 1,000 words: pandas, networkx, Mesa, rdflib and Hypothesis have 1 to 2.2 of them.
"""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = sorted({path.parent for name in ("worldmodel", "exchange", "remoras", "missions", "visualisation")
                   for path in (ROOT / name).rglob("*.py")})  # fmt: skip
OPENING = re.compile(r"\s*(What|Who|Whoever|Whose|Whom|To|How|The same|Those|That of)\b")
VAGUE = re.compile(
    r"\b(whoever|(some|no|any|every)body|those (of|who|which|that)|(what|who) (is|was|it|they|has|does|the|a|can|comes)"
    r"|tells?|told|says?|said|hears?|(is|are|was|were) (asked|away|there|of use)|anew|in vain|for good|of its own"
    r"|(in|by|of|to) (which|whom|what)|there (is|are)|so (many|much)|as (many|much|far) as|goes? on|but for)\b",
    re.IGNORECASE,
)
MOST_PER_THOUSAND = 5.0
FEWEST_WORDS = 400
"""A package with fewer words may have as many phrases as one with these."""


@cache
def docstrings(path: Path) -> list[str]:
    """The string statements of a file."""
    return [
        node.value.value
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    ]


def n_words(text: str) -> int:
    return len(re.findall(r"[A-Za-z]+", text))


@pytest.mark.parametrize("folder", PACKAGES, ids=lambda folder: str(folder.relative_to(ROOT)))
def test_docstrings_contain_few_vague_phrases(folder: Path) -> None:
    texts = [text for path in folder.rglob("*.py") for text in docstrings(path)]
    words = sum(map(n_words, texts))
    vague = [match.group(0) for text in texts for match in VAGUE.finditer(text)]
    assert len(vague) <= MOST_PER_THOUSAND / 1000.0 * max(words, FEWEST_WORDS), vague
    assert not [text for text in texts if OPENING.match(text)]


def test_a_vague_docstring_is_detected() -> None:
    assert len(VAGUE.findall("Whoever was told what is said to nobody says so once it is asked.")) == 7
    assert OPENING.match("What is answered.")
    assert not OPENING.match("Answer of the vehicle.")
