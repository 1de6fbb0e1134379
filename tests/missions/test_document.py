"""TOML documents: lines of keys, ordered faults, limits of size."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from missions.document import Document
from missions.errors import ConfigurationError, ConfigurationFault
from missions.files import parsed, toml_value
from missions.scenarios import load

TEXT = """\
title = "t"

[[vehicle]]
name = "AUV00"
slot = 0

[[vehicle]]
name = "AUV01"
slot = 1
[vehicle.sensor]
swath_m = 2.0

[[channel]]
name = "perfect"
[[channel]]
name = "bernoulli"
per = [0.1]

[mission]
importance."Performer.RendezVous" = 1.0
"""


def document(tmp_path: Path, text: str = TEXT) -> Document:
    path = tmp_path / "own.toml"
    path.write_text(text, encoding="utf-8")
    return Document.read(str(path), {}, "scenario")


@pytest.mark.parametrize(
    ("key", "line"),
    [
        ("title", 1),
        ("vehicle.AUV00.slot", 5),
        ("vehicle.2.slot", 9),
        ("vehicle.AUV01.sensor.swath_m", 11),
        ("vehicle.AUV01.depth_m", 8),  # it is missing: the name of the vehicle
        ("vehicle", 3),
        ("channel.per", 17),  # the first channel that has it
        ("channel.1.name", 14),
        ('mission.importance."Performer.RendezVous"', 20),
        ("mission.importance.Performer.RendezVous", 20),
        ("world.x_m", None),
    ],
)
def test_keys_have_their_lines(tmp_path: Path, key: str, line: int | None) -> None:
    assert document(tmp_path).line_of(key) == line


def test_faults_are_ordered_by_line(tmp_path: Path) -> None:
    faults = [ConfigurationFault(key, "", "no") for key in ("mission", "vehicle.AUV01.slot", "world", "title")]
    error = document(tmp_path).error(faults)
    assert [(fault.key, fault.line) for fault in error.faults] == [
        ("world", None), ("title", 1), ("vehicle.AUV01.slot", 9), ("mission", 19),
    ]  # fmt: skip
    assert f"{tmp_path}/own.toml:9: vehicle.AUV01.slot = 1: no" in str(error)


def test_fault_of_a_key_set_by_an_option_names_the_option(tmp_path: Path) -> None:
    faults = [ConfigurationFault(key, "", "no") for key in ("channel.per", "vehicle.AUV01.slot", "--set x", "mission")]
    options = {"channel.per": "--per", "mission.patience_s": "--set"}
    found = document(tmp_path).located(faults, options)
    assert [fault.key for fault in found] == ["--per (channel.per)", "--set x", "--set (mission)", "vehicle.AUV01.slot"]


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"a = 1\nb = = 2\n", r"own.toml:2: TOML: "),
        (b"a = 1\nb = 'caf\xe9'\n", r"own.toml:2: file: cannot be read: byte 0xe9 is not UTF-8; save the file as"),
        ("a = 1".encode("utf-16"), r"own.toml: file: cannot be read: it is UTF-16; save it as UTF-8"),
    ],
)  # fmt: skip
def test_file_that_is_no_toml_is_refused_with_the_remedy(tmp_path: Path, content: bytes, expected: str) -> None:
    path = tmp_path / "own.toml"
    path.write_bytes(content)
    with pytest.raises(ConfigurationError, match=expected):
        Document.read(str(path), {}, "scenario")


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
def test_files_of_windows_editors_are_read(tmp_path: Path, mark: bytes, end: bytes) -> None:
    path = tmp_path / "own.toml"
    path.write_bytes(mark + end.join([b"[table]", b"a = 1", b'b = """x', b'y"""', b""]))
    found = Document.read(str(path), {}, "scenario")
    assert found.raw == {"table": {"a": 1, "b": "x\ny"}}
    assert found.line_of("table.a") == 2


def test_missing_file_is_refused_with_the_nearest_one(tmp_path: Path) -> None:
    (tmp_path / "fleet.toml").touch()
    with pytest.raises(ConfigurationError, match=r"no such file; did you mean '.*/fleet.toml'\?$"):
        Document.read(str(tmp_path / "fleat.toml"), {}, "scenario")
    with pytest.raises(ConfigurationError, match=r"no such file$"):  # only the endings are alike
        Document.read(str(tmp_path / "nope.toml"), {}, "scenario")


@pytest.mark.parametrize("name", ["x" * 5000 + ".toml", "a\0/b.toml"])
def test_impossible_name_is_no_file(name: str) -> None:
    with pytest.raises(ConfigurationError, match=r"no such file$"):
        Document.read(name, {}, "scenario")


@pytest.mark.parametrize("name", ["nothing", "", "x" * 5000, "a\0b"])
def test_missing_file_is_refused_with_allowed_names(name: str) -> None:
    with pytest.raises(ConfigurationError, match=r"study = .*a TOML file or one of quick$|a TOML file or one of quick"):
        Document.read(name, {"quick": Path("quick.toml")}, "study")


PLAIN = st.text("abc_", min_size=1, max_size=4)
TABLES = st.recursive(
    st.integers(0, 9) | st.booleans() | st.floats() | st.dates() | st.text("ab \"'\\#"),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(PLAIN, inner, max_size=3),
    max_leaves=8,
)


@given(TABLES)
def test_value_is_read_back_from_its_toml_text(value: object) -> None:
    import math
    import tomllib

    def same(a: object, b: object) -> bool:
        if isinstance(a, float) and isinstance(b, float) and math.isnan(a):
            return math.isnan(b)
        if isinstance(a, list) and isinstance(b, list):
            return len(a) == len(b) and all(map(same, a, b))
        if isinstance(a, dict) and isinstance(b, dict):
            return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
        return a == b

    text = toml_value(value)
    assert "\n" not in text
    assert same(tomllib.loads(f"value = {text}")["value"], value)


# What is no file of its kind -----------------------------------------------------------------------


def message(path: Path, content: bytes, what: str = "scenario") -> str:
    path.write_bytes(content)
    with pytest.raises(ConfigurationError) as caught:
        Document.read(str(path), {}, what)
    assert len(caught.value.faults) == 1
    return str(caught.value)


def test_scenario_given_as_study_or_reverse_gets_one_hint(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    said = message(file, b"# mine\n[study]\nname = 'x'\n")
    assert said == f"{file}:2: [study]: this is a study; start it with: remoras sweep {file} --out DIR"
    assert "this is a scenario; start it with: remoras run" in message(file, b"[scenario]\nname = 'x'\n", "study")


def test_long_values_are_cut(tmp_path: Path) -> None:
    fault = ConfigurationFault("k" * 10_000, "v" * 10_000, "allowed: 1")
    assert len(fault.text("f" * 10_000)) < 600
    assert fault.text("own.toml").endswith(f"= {'v' * 197}...: allowed: 1")


DEEP = "levels deep; no key needs that"
DIGITS = "an integer of more than 307 digits; no key needs that"
TEXTS = {
    "key of 101 parts": ("x = 1\na" + ".a" * 100 + " = 1\n", DEEP),
    "nested lists": ("x = " + "[" * 20_000 + "]" * 20_000 + "\n", DEEP),
    "integer of 5000 digits": ("y = 1\nx = " + "9" * 5000 + "\n", DIGITS),
    "integer that is no float": ("x = " + "9" * 400 + "\n", DIGITS),
    "integer in hexadecimal": ("x = 0x" + "f" * 5000 + "\n", DIGITS),
}


@pytest.mark.parametrize("name", TEXTS)
def test_text_beyond_the_limits_is_refused_in_one_line(name: str) -> None:
    text, said = TEXTS[name]
    with pytest.raises(ConfigurationError) as caught:
        Document.of_text(text, "mine.toml")
    assert str(caught.value).endswith(said)
    assert len(str(caught.value)) < 200


def test_texts_up_to_the_limits_are_read() -> None:
    assert parsed(f"x = {'9' * 307}")["x"] == 10**307 - 1


@pytest.mark.parametrize("value", ["=" + "9" * 5000, "={a" + ".a" * 100 + "=1}", "=" + "[" * 10_000, ".a" * 100 + "=1"])
def test_option_beyond_the_limits_is_refused_in_one_line(value: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        load("mapping-rendezvous", [("--set", f"decision.weight_external{value}")])
    (fault,) = caught.value.faults
    assert len(fault.text("own.toml")) < 600
