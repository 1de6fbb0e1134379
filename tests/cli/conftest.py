"""What tests of live runs share."""

import pytest
from crashing import Crash


@pytest.fixture
def crash(monkeypatch: pytest.MonkeyPatch) -> Crash:
    return Crash(monkeypatch)
