"""Settings of all tests, and the browser that some of them need."""

from collections.abc import Iterator
from typing import Any

import pytest
from browsing import browser
from hypothesis import settings

settings.register_profile("tests", deadline=None, max_examples=60)  # a busy machine is not a fault
settings.load_profile("tests")


@pytest.fixture(scope="module")
def chrome() -> Iterator[Any]:
    """A browser; tests are skipped where Playwright or Chromium is missing."""
    with browser() as found:
        yield found
