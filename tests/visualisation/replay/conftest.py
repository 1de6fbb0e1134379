"""Lossy run and its replay page in a browser, for all tests of pages."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from browsing import Window
from chromium import opened, written
from replayed import LOSSY, recorded

from missions.runs.results import Results


@pytest.fixture(scope="session")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return recorded(tmp_path_factory.mktemp("replayed") / "run", LOSSY)


@pytest.fixture
def window(chrome: Any, results: Results, tmp_path: Path) -> Iterator[Window]:
    with opened(chrome, written(tmp_path, results)) as found:
        yield found
