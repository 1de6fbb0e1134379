"""The page of a replay: assets and data as one HTML file that asks for nothing."""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from missions.files import drafted
from visualisation.colours import VEHICLES
from visualisation.output import DrawingError

MODEL = ("data.js", "model.js", "knowledge.js", "links.js", "work.js", "chain.js", "organisation.js", "plans.js")
VIEW = (
    "palette.js", "elements.js", "pen.js", "clock.js", "facts.js", "map.js", "packets.js", "belief.js", "strips.js",
    "signals.js", "lanes.js", "minds.js", "matrix.js", "cost.js", "why.js", "news.js", "tables.js", "groups.js",
    "trees.js", "layout.js", "hands.js", "view.js", "save.js", "app.js",
)  # fmt: skip
SCRIPTS = MODEL + VIEW
"""Scripts in the order in which the page has them."""
LIVE = ("growing.js", "live.js")
"""Scripts that the page of a live run has beside them."""
NOTEBOOK = ("growing.js", "notebook.js")
"""The same of a run that goes on in a notebook."""
STYLES = ("page.css",)
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; media-src blob:; "
    "base-uri 'none'; form-action 'none'"
)
"""What the page allows itself: what it holds, and nothing from anywhere."""
LIVE_POLICY = f"{POLICY}; connect-src 'self'"
"""What the page of a live run allows itself: beside that, to ask the program that serves it."""
FRAME_PX = 720
"""Height of a page in a notebook."""


@cache
def asset(name: str) -> str:
    """Text of a file of the page."""
    return (resources.files("visualisation.replay") / "assets" / name).read_text(encoding="utf-8")


def page_text(title: str, payloads: Sequence[bytes]) -> str:
    """The page as text.

    Args:
        title: of the window.
        payloads: of one run, or of two side by side.
    """
    data = "\n".join(
        f'<script type="application/octet-stream;base64" class="run">{base64.b64encode(payload).decode()}</script>'
        for payload in payloads
    )
    return _text(title, POLICY, STYLES, data, SCRIPTS)


def live_text(title: str) -> str:
    """The page of a live run: it gets its data from the program that serves it."""
    return _text(title, LIVE_POLICY, (*STYLES, "live.css"), "", (*SCRIPTS, *LIVE))


def notebook_text(title: str) -> str:
    """The page of a run that goes on in a notebook: it gets its data from what frames it."""
    return _text(title, POLICY, STYLES, "", (*SCRIPTS, *NOTEBOOK))


def frame(text: str, name: str = "") -> str:
    """A page in a frame that can reach nothing of the notebook.

    Args:
        text: the whole page.
        name: by which scripts beside it find the frame.
    """
    named = f' id="{html.escape(name)}"' if name else ""
    return (
        f'<iframe{named} srcdoc="{html.escape(text)}" sandbox="allow-scripts allow-downloads" title="replay" '
        f'style="width: 100%; height: {FRAME_PX}px; border: 0"></iframe>'
    )


def _text(title: str, policy: str, styles: Sequence[str], data: str, scripts: Sequence[str]) -> str:
    style = "\n".join(f"<style>\n{asset(name)}</style>" for name in styles)
    colours = f"globalThis.R = {{ VEHICLE_FILLS: {json.dumps(VEHICLES)} }};"
    program = "\n".join(f"<script>\n{text}</script>" for text in (colours, *map(asset, scripts)))
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{html.escape(policy)}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{html.escape(title)}</title>
<link rel="icon" href="data:,">
{style}
</head>
<body>
<noscript>This page needs JavaScript.</noscript>
<main id="app"></main>
{data}
{program}
</body>
</html>
"""


def title_of(summaries: Sequence[Mapping[str, Any]]) -> str:
    """Title of the page of one run, or of two side by side, by their summaries."""
    titles = [f"{summary['scenario']}, {summary['strategy']}, seed {summary['seed']}" for summary in summaries]
    return f"{' beside '.join(titles)} - replay"


@dataclass(frozen=True, repr=False)
class ReplayPage:
    """A page that a notebook shows in a frame of its own.

    Attributes:
        text: the whole page.
    """

    text: str

    def __repr__(self) -> str:
        return f"<Page of {len(self.text)} characters; a notebook shows it>"

    def _repr_html_(self) -> str:
        return frame(self.text)


def check_page_output(out: Path, force: bool) -> None:
    """Raise DrawingError if a page cannot be written there, or would replace a file without ``force``."""
    if out.is_dir():
        raise DrawingError(f"--out {out}: is a folder; name a file, such as {out / 'replay.html'}")
    if out.exists() and not force:
        raise DrawingError(f"--out {out}: exists; name another file or add --force")
    if not out.parent.is_dir():
        raise DrawingError(f"--out {out}: there is no folder {out.parent}; make it, or name another file")


def write_page(out: Path, text: str, force: bool = False) -> None:
    """Write a page; it appears whole or not at all.

    Raises:
        DrawingError: there is a file already, or it cannot be written.
    """
    check_page_output(out, force)
    try:
        with drafted(out) as draft:
            draft.write_text(text, encoding="utf-8")
    except OSError as error:
        raise DrawingError(f"--out {out}: cannot be written: {error.strerror}") from None
