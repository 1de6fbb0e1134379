"""Without a compatible Numba the study runs uncompiled, with a hint, and gives the same results."""

import importlib.metadata
import threading
from typing import Any

import pytest

from exchange.study import compiler, study
from exchange.study.parameters import ExchangeStudy


@pytest.mark.parametrize(
    ("found", "says"),
    [(None, "numba is not installed"), ("0.69.0", "numba 0.69.0 is not supported"), ("0.65.1", "numba 0.65.1")],
)
def test_without_a_fitting_numba_the_study_runs_uncompiled_with_a_hint(
    found: str | None, says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the thread that asked for it, where an interruption reaches it."""
    asked = ExchangeStudy(nodes=3, per=(0.3,), policies=("ack",), trials=5)
    compiled, as_python, threads = study.run(asked), compiler.as_python, set()

    def version(name: str) -> str:
        if found is None:
            raise importlib.metadata.PackageNotFoundError(name)
        return found

    monkeypatch.setattr(compiler, "version", version)

    def watched(kind: Any) -> compiler.SlotLoop:
        loop = as_python(kind)

        def noting(*given: Any) -> None:
            threads.add(threading.current_thread())
            loop(*given)

        return noting

    monkeypatch.setattr(compiler, "compiled", lambda *_: pytest.fail("compiled"))
    monkeypatch.setattr(compiler, "as_python", watched)
    said: list[str] = []
    rows = study.run(asked, jobs=4, say=said.append)
    assert threads == {threading.main_thread()}
    assert len(said) == 1
    assert says in said[0]
    assert 'the extra "study": pip install "numba>=0.66,<0.69"' in said[0]
    assert "\n" not in said[0]
    assert [row.delivered_slots for row in rows] == [row.delivered_slots for row in compiled]
    assert [row.senders_acked_slots for row in rows] == [row.senders_acked_slots for row in compiled]
