"""Files that ask for more than any scenario needs are refused in one line, within seconds."""

import time

import pytest

from missions.document import Document
from missions.errors import ConfigurationError
from missions.files import MOST_PARTS, MOST_TABLES, parsed
from missions.scenarios import load

FAST_S = 5.0
"""Seconds of a busy machine: each of these texts took more than a minute, or ended with a trace."""
DEEP = "levels deep; no key needs that"
DIGITS = "an integer of more than 307 digits; no key needs that"
TEXTS = {
    "key of 50,000 parts": ("x = 1\na" + ".a" * 50_000 + " = 1\n", 2, DEEP),
    "key of 101 parts": ("x = 1\na" + ".a" * 100 + " = 1\n", 2, DEEP),
    "quoted parts": ('"a"' + " . 'a'" * 50_000 + " = 1\n", 1, DEEP),
    "header of 50,000 parts": ("\n[a" + ".a" * 50_000 + "]\n", 2, DEEP),
    "inline table": ("x = {a" + ".a" * 50_000 + " = 1}\n", 1, DEEP),
    "nested lists": ("x = " + "[" * 100_000 + "]" * 100_000 + "\n", None, DEEP),
    "nested tables": ("x = " + "{a=" * 100_000 + "1" + "}" * 100_000 + "\n", None, DEEP),
    "levels that can be read": ("x = " + "[" * 60 + "]" * 60 + "\n", None, DEEP),
    "integer of 5000 digits": ("y = 1\nx = " + "9" * 5000 + "\n", 2, DIGITS),
    "integer that is no float": ("x = " + "9" * 400 + "\n", 1, DIGITS),
    "integer in hexadecimal": ("x = 0x" + "f" * 5000 + "\n", 1, DIGITS),
    "one long word": ("x = 1\n" + "a" * 900_000 + "\n", 2, "Expected '='"),
    "tables": ("[[x]]\n" * (MOST_TABLES + 1), None, f"more than {MOST_TABLES} tables"),
}


@pytest.mark.parametrize("name", TEXTS)
def test_a_text_beyond_the_limits_is_refused_in_one_line(name: str) -> None:
    text, line, said = TEXTS[name]
    began_s = time.monotonic()
    with pytest.raises(ConfigurationError) as caught:
        Document.of_text(text, "mine.toml")
    assert time.monotonic() - began_s < FAST_S
    (fault,) = caught.value.faults
    assert fault.line == line
    assert said in fault.allowed
    assert len(str(caught.value)) < 200


def test_what_a_file_may_have_is_read() -> None:
    assert parsed(f"x = {'9' * 307}")["x"] == 10**307 - 1
    assert parsed(f"# {'1.' * 1000}\n" + "x = 'a.b.c'") == {"x": "a.b.c"}  # a comment whose dots end it
    assert parsed("a" + ".a" * (MOST_PARTS - 1) + " = 1")
    assert parsed(f'x = "{"a.b" * 1000}"')["x"] == "a.b" * 1000  # a text is one part, whatever it says
    assert len(parsed("[[x]]\n" * (MOST_TABLES - 1))["x"]) == MOST_TABLES - 1


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("decision.weight_external=" + "9" * 5000, DIGITS),
        ("decision.weight_external={a" + ".a" * 50_000 + "=1}", DEEP),
        ("a" + ".a" * 50_000 + "=1", DEEP),
        ("decision.weight_external=" + "[" * 50_000, DEEP),
    ],
    ids=["digits", "parts", "key", "depth"],
)
def test_an_option_beyond_the_limits_is_refused_in_one_line(override: str, said: str) -> None:
    for given in ([override], [override, override], ["decision.weight_external=1", override]):
        began_s = time.monotonic()
        with pytest.raises(ConfigurationError) as caught:
            load("mapping-rendezvous", [("--set", one) for one in given])
        assert time.monotonic() - began_s < FAST_S
        assert any(said in fault.allowed for fault in caught.value.faults)
