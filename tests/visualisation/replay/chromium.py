"""Replay page in headless Chromium, opened from disk."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from browsing import PATIENCE_MS, Window, is_own
from replayed import data_of

from missions.runs.results import Results
from visualisation.replay import page_text


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


def seek(window: Window, times_s: Sequence[float], function: str) -> list[Any]:
    """Results of a function of the page at each of some clock times."""
    return [
        window.ask(f"(t) => {{ R.app.clock.seek(t); return ({function})(R.app.views[0], t); }}", t) for t in times_s
    ]
