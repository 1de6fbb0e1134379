"""Replay page: assets and data as one self-contained HTML file; live page of a notebook.

A notebook has two outputs: the page in a sandboxed frame, and a replaced script that posts the current data to it. Each
script holds all data, since front ends may skip replaced scripts and a reopened notebook has the last one only.
"""

from __future__ import annotations

import base64
import html
import json
import uuid
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from missions.disk import drafted
from visualisation.colours import VEHICLES
from visualisation.output import DrawingError

MODEL = ("data.js", "model.js", "knowledge.js", "links.js", "work.js", "chain.js", "organisation.js", "plans.js")
VIEW = (
    "palette.js", "elements.js", "pen.js", "clock.js", "facts.js", "map.js", "packets.js", "belief.js", "strips.js",
    "signals.js", "lanes.js", "minds.js", "matrix.js", "cost.js", "why.js", "news.js", "tables.js", "groups.js",
    "trees.js", "layout.js", "hands.js", "view.js", "save.js", "app.js",
)  # fmt: skip
SCRIPTS = MODEL + VIEW
LIVE = ("growing.js", "live.js")
NOTEBOOK = ("growing.js", "notebook.js")
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


def notebook_text(title: str) -> str:
    """Return the page of a live run in a notebook, which receives data by messages."""
    return _text(title, POLICY, STYLES, "", (*SCRIPTS, *NOTEBOOK))


def frame(text: str, name: str = "") -> str:
    """Embed a page in a sandboxed frame; ``name`` is its element id."""
    named = f' id="{html.escape(name)}"' if name else ""
    # Without allow-same-origin, so that the page has no access to the notebook around it.
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


LISTEN = """<script>(function () {
  const name = NAME, runs = (globalThis.remorasRuns ??= {});
  addEventListener("message", (event) => {
    const frame = document.getElementById(name);
    if (event.data !== "remoras-ready" || !frame || event.source !== frame.contentWindow) return;
    if (runs[name]) frame.contentWindow.postMessage(runs[name], "*");
  });
})();</script>"""
TELL = """<script>(function () {
  const name = NAME, frame = document.getElementById(name);
  (globalThis.remorasRuns ??= {})[name] = DATA;
  if (frame) frame.contentWindow.postMessage(globalThis.remorasRuns[name], "*");
})();</script>"""


class NotebookPage:
    """Live page among the outputs; DrawingError outside a notebook."""

    def __init__(self, title: str) -> None:
        self._show = _shown()
        self._name = f"remoras-{uuid.uuid4().hex}"
        self._is_told = False
        self._show(frame(notebook_text(title), self._name) + self._script(LISTEN), self._name, False)

    def tell(self, data: bytes) -> None:
        """Show the current state of the run, from its ``run_data``."""
        # In base64 no data can end the script.
        script = self._script(TELL).replace("DATA", json.dumps(base64.b64encode(data).decode()))
        self._show(script, f"{self._name}-told", self._is_told)
        self._is_told = True

    def _script(self, text: str) -> str:
        return text.replace("NAME", json.dumps(self._name))


def _shown() -> Callable[[str, str, bool], None]:
    """Return a function (text, name, replaces) that displays HTML under a name, or replaces what has that name."""
    shell: Any = None
    with suppress(ImportError):
        from IPython import get_ipython

        shell = get_ipython()
    if getattr(shell, "kernel", None) is None:
        raise DrawingError("watch: this is no notebook; call run(), or watch with 'remoras live' from a terminal")
    from IPython import display

    publish: Any = display.publish_display_data

    def show(text: str, name: str, replaces: bool) -> None:
        data = {"text/html": text, "text/plain": "<the page of a run that goes on>"}
        publish(data, transient={"display_id": name}, update=replaces)

    return show
