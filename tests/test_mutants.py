"""The list of mutants fits the program, and the tool tells which of them no test notices."""

from pathlib import Path

import pytest
import tomli_w

from tests.tools.mutants import LIST, Mutant, MutantError, check, main, read

MUTANT = Mutant("sums.py", "a + b", "a - b", ("test_sums.py",))


def checkout(root: Path, *mutants: Mutant) -> list[str]:
    """A program of one function with a test that sees little; returns the arguments of the tool."""
    (root / "sums.py").write_text("def added(a, b):\n    return a + b  # twice\n", encoding="utf-8")
    (root / "test_sums.py").write_text(
        "from sums import added\n\ndef test_one():\n    assert added(2, 2) == 4\n", encoding="utf-8"
    )
    entries = [
        {"file": one.file, "text": one.text, "replacement": one.replacement, "tests": [*one.tests]} for one in mutants
    ]
    (root / "list.toml").write_text(tomli_w.dumps({"mutant": entries}), encoding="utf-8")
    return ["--list", str(root / "list.toml"), "--root", str(root)]


@pytest.mark.parametrize("path", [LIST, LIST.parent / "conformance" / "agr" / "mutants.toml"], ids=["all", "agr"])
def test_every_mutant_of_the_list_can_be_put_in(path: Path) -> None:
    mutants = read(path)
    check(mutants)
    assert len(set(mutants)) == len(mutants)


def test_the_tool_says_which_survive_and_leaves_the_checkout_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = checkout(tmp_path, MUTANT, MUTANT._replace(replacement="a * b"))
    before = (tmp_path / "sums.py").read_bytes()
    assert main(arguments) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[:2] == ["caught   sums.py: a + b -> a - b", "survives sums.py: a + b -> a * b"]
    assert lines[2].startswith("2 mutants, 1 survive, ")
    assert (tmp_path / "sums.py").read_bytes() == before


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"text": "a ! b"}, "sums.py: a ! b -> a - b: the text occurs 0 times; allowed: once"),
        ({"text": "a"}, "the text occurs 3 times; allowed: once"),
        ({"replacement": "a + b"}, "changes nothing"),
        ({"file": "products.py"}, "products.py is not there"),
        ({"tests": ("test_products.py",)}, "test_products.py is not there"),
        ({"tests": ("test_sums.py::test_two",)}, "test_two is not there"),
        ({"tests": ()}, "no test is named"),
    ],
)
def test_a_mutant_that_does_not_fit_is_an_error_that_names_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], changed: dict[str, object], said: str
) -> None:
    assert main(checkout(tmp_path, MUTANT._replace(**changed))) == 2
    assert said in capsys.readouterr().err


def test_an_entry_with_another_key_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "list.toml"
    path.write_text("[[mutant]]\nfile = 'sums.py'\nwhy = 'so'\n", encoding="utf-8")
    with pytest.raises(MutantError, match="mutant 1 has file, why"):
        read(path)


@pytest.mark.slow
def test_tests_that_fail_without_a_mutant_tell_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = checkout(tmp_path, MUTANT)
    (tmp_path / "test_sums.py").write_text("def test_one():\n    assert False\n", encoding="utf-8")
    assert main(arguments) == 2
    assert "do not pass without any mutant" in capsys.readouterr().err


@pytest.mark.thorough
def test_every_mutant_is_caught() -> None:
    assert main([]) == 0
