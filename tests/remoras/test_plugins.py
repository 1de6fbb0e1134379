"""Plug-ins: lookup by name, and messages about missing parts of the interface."""

import functools
import sys
from pathlib import Path
from typing import Any, ClassVar, Protocol

import pytest

from remoras.errors import PluginError
from remoras.plugins import answer, faults_of, named_object


class Gauge(Protocol):
    """A seam for these tests: two functions and a name."""

    name: ClassVar[str]

    def read(self, depth_m: float, now_s: float) -> float:
        """A reading."""
        ...

    @classmethod
    def make(cls, serial: int) -> Any:
        """One of them."""
        ...


COMPULSORY = ("name", "read", "make")
LACKS = f"of {__name__}.Gauge"


class Good:
    """Has every part."""

    name = "good"

    def read(self, depth_m: float, now_s: float) -> float:
        return depth_m

    @classmethod
    def make(cls, serial: int) -> Any:
        return cls()


class Lenient(Good):
    """May be called with more than it needs to be, or with other names."""

    def read(self, depth: float, time: float, *rest: float, unit: str = "m") -> float:  # type: ignore[override]
        return depth


class Curried(Good):
    """A part that is a partial function."""

    read = staticmethod(functools.partial(lambda offset_m, depth_m, now_s: depth_m + offset_m, 1.0))


@pytest.mark.parametrize("found", [Good, Good(), Lenient, Lenient(), Curried(), Curried])
def test_a_complete_class_or_object_has_no_faults(found: object) -> None:
    assert list(faults_of(found, Gauge, COMPULSORY)) == []


def test_missing_parts_are_named_with_the_interface() -> None:
    assert list(faults_of(object(), Gauge, COMPULSORY)) == [f"lacks name, read, make {LACKS}"]
    nameless = type("Nameless", (), {"read": Good.read, "make": Good.make})
    assert list(faults_of(nameless(), Gauge, COMPULSORY)) == [f"lacks name {LACKS}"]


@pytest.mark.parametrize(
    ("read", "says"),
    [
        (lambda self: 0.0, "cannot be called as read(depth_m, now_s)"),
        (lambda self, depth_m: 0.0, "cannot be called as read(depth_m, now_s)"),
        (lambda self, depth_m, now_s, unit: 0.0, "cannot be called as read(depth_m, now_s)"),
        (5, "read is int, not a function"),
        ("read", "read is str, not a function"),
    ],
)
def test_a_wrong_signature_is_reported_beside_the_expected_one(read: Any, says: str) -> None:
    wrong = type("Wrong", (Good,), {"read": read})
    for found in (wrong, wrong()):
        (fault,) = faults_of(found, Gauge, COMPULSORY)
        assert fault.startswith("read")
        assert says in fault


# By name ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("reference", ["", ":", "math", "math:", ":pi", "math.pi"])
def test_an_unknown_plug_in_name_is_reported_with_the_allowed_ones(reference: str) -> None:
    with pytest.raises(PluginError, match=r"names no object; allowed: package\.module:object"):
        named_object(reference)


@pytest.mark.parametrize(
    ("reference", "says"),
    [
        ("nowhere.at_all:it", "ModuleNotFoundError: No module named 'nowhere'"),
        (".module:it", "TypeError"),
    ],
)
def test_an_import_path_that_fails_is_reported_with_the_cause(reference: str, says: str) -> None:
    with pytest.raises(PluginError, match=r"package\.module:object that can be imported") as caught:
        named_object(reference)
    assert says in str(caught.value)


def test_a_misspelled_object_is_reported_with_the_allowed_names_and_the_nearest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Classes and objects of the file are allowed; numbers, private and imported names are not."""
    monkeypatch.syspath_prepend(tmp_path)
    imports = "from __future__ import annotations\nimport math\nfrom math import sin\nfrom remoras import Table\n"
    objects = "class Deep: pass\nSHALLOW = Deep()\nROWS = Table('rows', ())\n_hidden, DEPTH_M = Deep(), 5.0\n"
    (tmp_path / "lead_line.py").write_text(imports + objects, encoding="utf-8")
    with pytest.raises(PluginError) as caught:
        named_object("lead_line:SHALOW")
    allowed = "an object of lead_line (Deep, SHALLOW, ROWS), which has no SHALOW; did you mean 'SHALLOW'?"
    assert str(caught.value) == allowed
    with pytest.raises(PluginError, match=r"an object of keyword \(none\), which has no NO"):
        named_object("keyword:NO")


# At run time --------------------------------------------------------------------------------------


def test_a_part_with_a_wrong_result_is_reported_with_the_expected_type() -> None:
    with pytest.raises(PluginError, match="gauge deep: read returned 'five'; expected: a number"):
        answer("gauge deep", "read", "a number", lambda given: isinstance(given, float), lambda: "five")

    def broken() -> float:
        raise ZeroDivisionError("no echo")

    with pytest.raises(
        PluginError, match=r"read raised ZeroDivisionError: no echo, in .*; expected: a number"
    ) as caught:
        answer("gauge deep", "read", "a number", lambda given: True, broken)
    assert isinstance(caught.value.__cause__, ZeroDivisionError)


def test_a_plug_in_that_ends_the_program_is_a_fault_and_an_interruption_is_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run that ended with code 0 and without results would look like success."""

    def raises(error: BaseException) -> float:
        raise error

    with pytest.raises(PluginError, match="gauge deep: read raised SystemExit: 0, in"):
        answer("gauge deep", "read", "a number", float, lambda: raises(SystemExit(0)))
    with pytest.raises(KeyboardInterrupt):
        answer("gauge deep", "read", "a number", float, lambda: raises(KeyboardInterrupt()))
    (tmp_path / "ending.py").write_text("import sys\n\nsys.exit()\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(PluginError, match=r"can be imported \(SystemExit: , in ending.py, line 3\)"):
        named_object("ending:GAUGE")


@pytest.mark.parametrize(("cause", "says"), [
    ("{}['x' * 500]", rf"KeyError: '{'x' * 119}\.\.\."),
    ("json.loads('nonsense')", "JSONDecodeError: Expecting value: line 1 column 1 \\(char 0\\)"),  # in Python's own
    ("numpy.linalg.inv(numpy.zeros((2, 2)))", "LinAlgError: Singular matrix"),  # in an installed package
    ("distance((0.0,), ())", "IndexError: tuple index out of range"),  # in this program
])  # fmt: skip
def test_an_error_names_the_last_line_of_the_users_files(
    cause: str, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A plug-in calls a second file of its folder, which fails in its third line."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "sounding", raising=False)
    imports = "import json; import numpy; from exchange.arithmetic import distance"
    (tmp_path / "sounding.py").write_text(f"{imports}\ndef read():\n    {cause}\n", encoding="utf-8")
    (tmp_path / f"gauge{len(cause)}.py").write_text("import sounding\ndef read():\n    sounding.read()\n")
    read = named_object(f"gauge{len(cause)}:read")
    with pytest.raises(PluginError, match=rf"^gauge: read raised {says}, in sounding\.py, line 3; expected: a number$"):
        answer("gauge", "read", "a number", lambda given: True, read)
