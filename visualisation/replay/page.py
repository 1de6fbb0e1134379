"""Replay page: assets and data as one self-contained HTML file, or in a frame of a notebook."""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from missions.disk import drafted
from visualisation.colours import VEHICLES
from visualisation.output import DrawingError, html_page

MODEL = ("data.js", "model.js", "knowledge.js", "links.js", "work.js", "decisions.js", "organisation.js", "plans.js")
VIEW = (
    "palette.js", "elements.js", "pen.js", "clock.js", "facts.js", "map.js", "packets.js", "belief.js", "strips.js",
    "signals.js", "lanes.js", "minds.js", "matrix.js", "cost.js", "why.js", "news.js", "tables.js", "groups.js",
    "trees.js", "layout.js", "hands.js", "view.js", "save.js", "app.js",
)  # fmt: skip
SCRIPTS = MODEL + VIEW
LIVE = ("growing.js", "live.js")
STYLES = ("page.css",)
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; media-src blob:; "
    "base-uri 'none'; form-action 'none'"
)
"""Content security policy: inline content only."""
LIVE_POLICY = f"{POLICY}; connect-src 'self'"  # policy of a live page: also requests to its server
FRAME_PX = 720


def asset(name: str) -> str:
    """Return the text of an asset."""
    return (resources.files("visualisation.replay") / "assets" / name).read_text(encoding="utf-8")


def page_text(title: str, payloads: Sequence[bytes]) -> str:
    """Return the page with the payloads of one run, or of two side by side."""
    data = "\n".join(
        f'<script type="application/octet-stream;base64" class="run">{base64.b64encode(payload).decode()}</script>'
        for payload in payloads
    )
    return _text(title, POLICY, STYLES, data, SCRIPTS)


def live_text(title: str) -> str:
    """Return the page of a live run, which polls its server."""
    return _text(title, LIVE_POLICY, (*STYLES, "live.css"), "", (*SCRIPTS, *LIVE))


def frame(text: str) -> str:
    """Embed a page in a sandboxed frame."""
    # Without allow-same-origin, so that the page has no access to the notebook around it.
    return (
        f'<iframe srcdoc="{html.escape(text)}" sandbox="allow-scripts allow-downloads" title="replay" '
        f'style="width: 100%; height: {FRAME_PX}px; border: 0"></iframe>'
    )


def _text(title: str, policy: str, styles: Sequence[str], data: str, scripts: Sequence[str]) -> str:
    style = "\n".join(f"<style>\n{asset(name)}</style>" for name in styles)
    colours = f"globalThis.R = {{ VEHICLE_FILLS: {json.dumps(VEHICLES)} }};"
    program = "\n".join(f"<script>\n{text}</script>" for text in (colours, *map(asset, scripts)))
    body = f"""<noscript>This page needs JavaScript.</noscript>
<main id="app"></main>
{data}
{program}"""
    return html_page(title, policy, style, body)


def title_of(summaries: Sequence[Mapping[str, Any]]) -> str:
    """Return the page title from the summaries of one or two runs."""
    titles = [f"{summary['scenario']}, {summary['strategy']}, seed {summary['seed']}" for summary in summaries]
    return f"{' beside '.join(titles)} - replay"


@dataclass(frozen=True, repr=False)
class ReplayPage:
    """Page displayed by a notebook in a frame."""

    text: str

    def __repr__(self) -> str:
        return f"<Page of {len(self.text)} characters; a notebook shows it>"

    def _repr_html_(self) -> str:
        return frame(self.text)


def check_page_output(out: Path, force: bool) -> None:
    """Raise DrawingError if ``out`` is not writable, or exists without ``force``."""
    if out.is_dir():
        raise DrawingError(f"--out {out}: is a folder; name a file, such as {out / 'replay.html'}")
    if out.exists() and not force:
        raise DrawingError(f"--out {out}: exists; name another file or add --force")
    if not out.parent.is_dir():
        raise DrawingError(f"--out {out}: there is no folder {out.parent}; make it, or name another file")


def write_page(out: Path, text: str) -> None:
    """Write a page atomically after ``check_page_output``; DrawingError on failure."""
    try:
        with drafted(out) as draft:
            draft.write_text(text, encoding="utf-8")
    except OSError as error:
        raise DrawingError(f"--out {out}: cannot be written: {error.strerror}") from None
