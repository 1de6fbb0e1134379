"""Lines on the progress of a command."""

import pytest

from remoras import process
from remoras.process import Progress


@pytest.mark.parametrize(("done", "rate"), [(6604.0, "660"), (123456.0, "12346"), (25.0, "2.5"), (0.05, "0.005")])
def test_rate_is_a_plain_number(
    done: float, rate: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Ten seconds after the first report."""
    now_s = [0.0]
    monkeypatch.setattr(process.time, "monotonic", lambda: now_s[0])
    monkeypatch.setattr(process, "is_watched", lambda: True)
    with Progress("run", 200_000.0) as progress:
        progress.at(0.0)
        now_s[0] = 10.0
        progress.at(done)
    assert f", {rate} per s, " in capsys.readouterr().err
