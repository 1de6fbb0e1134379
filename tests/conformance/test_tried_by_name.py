"""``python -m remoras.testing KIND NAME``: what passes, what does not, and what there is none of."""

import pytest

from remoras.testing import KINDS, conforms
from remoras.testing.__main__ import main


def test_a_shipped_model_passes_every_check(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["channel", "perfect"]) == 0
    assert capsys.readouterr().out.splitlines() == [f"ok  {name}" for name in conforms("channel", "perfect")]


@pytest.mark.parametrize("kind", KINDS)
def test_what_there_is_none_of_is_said_in_one_line(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([kind, "nosuch"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"{kind} nosuch: ")


def test_what_does_not_conform_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["policy", "nonconforming_values:Nameless"]) == 1
    assert capsys.readouterr().err.startswith("policy nonconforming_values:Nameless does not conform: ")


@pytest.mark.parametrize("arguments", [[], ["policy"], ["gadget", "ack"]])
def test_how_it_is_used_is_said(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 2
    assert capsys.readouterr().err == "usage: python -m remoras.testing strategy|mission|policy|channel|fault NAME\n"
