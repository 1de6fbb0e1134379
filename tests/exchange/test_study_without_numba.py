"""Without Numba the policy study runs where an interruption reaches it: in the thread that asked for it."""

import threading
from typing import Any

import pytest

from exchange.study import compiler
from exchange.study.parameters import ExchangeStudy
from exchange.study.study import run


def test_uncompiled_trials_run_in_the_thread_that_can_be_interrupted(monkeypatch: pytest.MonkeyPatch) -> None:
    as_python = compiler.as_python
    threads = set()

    def watched(kind: Any) -> compiler.SlotLoop:
        loop = as_python(kind)

        def noting(*given: Any) -> None:
            threads.add(threading.current_thread())
            loop(*given)

        return noting

    monkeypatch.setattr(compiler, "why_uncompiled", lambda: "no Numba here")
    monkeypatch.setattr(compiler, "as_python", watched)
    rows = run(ExchangeStudy(nodes=3, per=(0.2,), trials=3), jobs=4)
    assert rows
    assert threads == {threading.main_thread()}
