"""Headless Chromium for tests of pages; requests and console errors of the page are recorded."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
QUIET = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
)  # fmt: skip

PATIENCE_MS = 180_000.0
"""A busy machine may take its time; nothing here is a measurement of speed."""


class Window:
    """A page with its ``requests`` beyond its own file and its console ``faults``."""

    def __init__(self, page: Any) -> None:
        self.page = page
        self.requests: list[str] = []
        self.faults: list[str] = []
        page.on("request", lambda request: self.requests.append(request.url))
        page.on("console", lambda said: self.faults.append(said.text) if said.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: self.faults.append(str(error)))

    def ask(self, expression: str, given: Any = None) -> Any:
        """Evaluate an expression, or a function of ``given``, in the page."""
        return self.page.evaluate(expression, given)

    def texts(self, selector: str) -> list[str]:
        """Texts of all elements that a selector names."""
        return [text.strip() for text in self.page.locator(selector).all_inner_texts()]

    @property
    def time_s(self) -> float:
        """Where the clock of the page stands."""
        return float(self.ask("() => R.app.clock.t"))


@contextmanager
def browser() -> Iterator[Any]:
    """A browser; the test is skipped where Playwright or Chromium is missing."""
    playwright = pytest.importorskip("playwright.sync_api")
    if CHROMIUM is None:
        pytest.skip("chromium is not installed")
    with playwright.sync_playwright() as play:
        found = play.chromium.launch(executable_path=CHROMIUM, args=list(QUIET), timeout=PATIENCE_MS)
        yield found
        found.close()


def is_own(url: str) -> bool:
    """True for what a page made itself and holds in memory."""
    return url.startswith(("blob:", "data:"))
