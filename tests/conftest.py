"""Settings of all tests, and the browser that some of them need."""

import gc
from collections.abc import Iterator
from typing import Any

import pytest
from browsing import browser
from hypothesis import settings

settings.register_profile("tests", deadline=None, max_examples=60)  # a busy machine is not a fault
settings.load_profile("tests")
gc.set_threshold(50_000, 20, 100)  # usual thresholds take a fifth of the time of tests, which make few cycles


def pytest_collection_finish() -> None:
    """Exempt modules and collected tests from garbage collection, as they live until the end."""
    gc.freeze()


@pytest.fixture(scope="module")
def chrome() -> Iterator[Any]:
    """A browser; tests are skipped where Playwright or Chromium is missing."""
    with browser() as found:
        yield found
