"""Files that ask for more than any scenario needs are refused in one line, within seconds."""

import time
from pathlib import Path

import pytest

from missions.document import Document
from missions.errors import ConfigurationError
from missions.files import LARGEST_BYTES, MOST_PARTS, MOST_TABLES, is_study, parsed, shipped
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


def test_a_file_that_is_too_large_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "large.toml"
    path.write_text(shipped()["mapping-rendezvous"].read_text(encoding="utf-8") + "#\n" * (LARGEST_BYTES // 2))
    monkeypatch.setattr(Path, "read_bytes", lambda self: pytest.fail(f"{self} is read"))
    with pytest.raises(ConfigurationError, match=r"large\.toml: file: has 1\.0 MB; allowed: up to 1 MB"):
        load(str(path))
    assert not is_study(str(path))


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


@pytest.mark.parametrize("table", ["vehicle", "fault", "group"])
def test_a_file_with_a_thousand_faulty_tables_is_refused_in_time(tmp_path: Path, table: str) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(shipped()["mapping-rendezvous"].read_text(encoding="utf-8") + f"\n[[{table}]]\n" * 1000)
    began_s = time.monotonic()
    with pytest.raises(ConfigurationError) as caught:
        load(str(path))
    assert time.monotonic() - began_s < 4 * FAST_S
    if table == "vehicle":
        assert str(caught.value).endswith("1004 vehicles; allowed: up to 64")
