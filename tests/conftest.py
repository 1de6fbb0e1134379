"""Settings of all tests, and the browser that some of them need."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from browsing import browser
from hypothesis import settings

settings.register_profile("tests", deadline=None, max_examples=60)  # a busy machine is not a fault
settings.load_profile("tests")
NOT_FAST = "slow", "thorough"


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests as slow or fast by ``tiers.toml``; those that are neither take a second or two."""
    tiers = tomllib.loads(Path(__file__).with_name("tiers.toml").read_text(encoding="utf-8"))
    tier = {name: key for key, names in tiers.items() for name in names}
    for item in items:
        found = tier.get(item.nodeid.partition("[")[0], "fast")
        if found != "moderate" and not (found == "fast" and any(item.get_closest_marker(name) for name in NOT_FAST)):
            item.add_marker(found)


@pytest.fixture(scope="module")
def chrome() -> Iterator[Any]:
    """A browser; tests are skipped where Playwright or Chromium is missing."""
    with browser() as found:
        yield found
