"""A page of a replay in headless Chromium, opened from disk; what it asks for and what it complains of is kept."""

import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from replayed import data_of

from missions.runs.results import Results
from visualisation.replay import page_text

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
QUIET = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
)  # fmt: skip

PATIENCE_MS = 180_000.0
"""A busy machine may take its time; nothing here is a measurement of speed."""


class Window:
    """A page and what it did: ``requests`` beyond its own file, ``faults`` on the console."""

    def __init__(self, page: Any) -> None:
        self.page = page
        self.requests: list[str] = []
        self.faults: list[str] = []
        page.on("request", lambda request: self.requests.append(request.url))
        page.on("console", lambda said: self.faults.append(said.text) if said.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: self.faults.append(str(error)))

    def ask(self, expression: str, given: Any = None) -> Any:
        """What an expression, or a function of ``given``, returns in the page."""
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


def written(folder: Path, *runs: Results) -> Path:
    """The page of one run, or of two, as a file."""
    out = folder / "replay.html"
    out.write_text(page_text("replay", [data_of(run) for run in runs]), encoding="utf-8")
    return out


@contextmanager
def opened(chrome: Any, file: Path, at: str = "", scheme: str = "light") -> Iterator[Window]:
    """A window on a page, shown and without a fault until it is closed again."""
    context = chrome.new_context(viewport={"width": 1280, "height": 720}, color_scheme=scheme, accept_downloads=True)
    context.set_default_timeout(PATIENCE_MS)
    window = Window(context.new_page())
    window.page.goto(file.as_uri() + at)
    window.page.wait_for_function("() => globalThis.R && R.app && R.app.views.length")
    yield window
    assert [url for url in window.requests if url.split("#")[0] != file.as_uri() and not is_own(url)] == []
    assert window.faults == []
    context.close()


def is_own(url: str) -> bool:
    """True for what a page made itself and holds in memory."""
    return url.startswith(("blob:", "data:"))


def seek(window: Window, times_s: Sequence[float], function: str) -> list[Any]:
    """What a function of the page returns with the clock at each of some times."""
    return [
        window.ask(f"(t) => {{ R.app.clock.seek(t); return ({function})(R.app.views[0], t); }}", t) for t in times_s
    ]
