"""Examples that analyse runs by other packages, in a small setting."""

import re
import runpy
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Run an example with arguments; return its output."""

    def run(*command: str) -> str:
        monkeypatch.setattr(sys, "argv", [*command])
        runpy.run_path(str(EXAMPLES / command[0]), run_name="__main__")
        return capsys.readouterr().out

    return run


def test_indices_of_three_settings_are_printed(said: Callable[..., str]) -> None:
    pytest.importorskip("SALib")
    found = re.findall(r"^(\S+): first order (\S+), total (\S+) \+- \S+$", said("sensitivity.py", "2", "200"), re.M)
    assert [name for name, *_ in found] == ["channel.per", "current.north_mps", "vehicle.AUV01.survey_speed_mps"]
    assert max(float(total) for *_, total in found) > 0.0  # the runs differ


def test_a_weight_is_tuned(said: Callable[..., str]) -> None:
    pytest.importorskip("optuna")
    found = re.fullmatch(r"\{'decision.weight_external': (\S+)\} 60 s\n", said("optuna_tuning.py", "2", "60"))
    assert found is not None
    assert 0.0 <= float(found[1]) <= 4.0
