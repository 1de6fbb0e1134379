"""The page of a replay: assets and data as one HTML file that asks for nothing.

The live page in a notebook, with no server: a frame, and a script beside it that is replaced.

Two outputs of what is executed. The first is the page in a sandboxed frame, the second a script that hands it what has
come so far. Each script has all of it: whoever renders them may leave out scripts that are replaced at once, and a
notebook that is opened again has the last one. A frame that is rendered anew says that it is ready, and is told again.
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


LISTEN = """<script>(function () {
  const name = NAME, runs = (globalThis.remorasRuns ??= {});
  addEventListener("message", (event) => {
    const frame = document.getElementById(name);
    if (event.data !== "remoras-ready" || !frame || event.source !== frame.contentWindow) return;
    if (runs[name]) frame.contentWindow.postMessage(runs[name], "*");
  });
})();</script>"""
"""Beside the frame: tells a page that is ready what has come."""
TELL = """<script>(function () {
  const name = NAME, frame = document.getElementById(name);
  (globalThis.remorasRuns ??= {})[name] = DATA;
  if (frame) frame.contentWindow.postMessage(globalThis.remorasRuns[name], "*");
})();</script>"""
"""Tells the page; one that is not ready yet says so when it is."""


class NotebookPage:
    """The page among the outputs of what is executed.

    Args:
        title: of the page.

    Raises:
        DrawingError: there is no notebook.
    """

    def __init__(self, title: str) -> None:
        self._show = _shown()
        self._name = f"remoras-{uuid.uuid4().hex}"
        self._is_told = False
        self._show(frame(notebook_text(title), self._name) + self._script(LISTEN), self._name, False)

    def tell(self, data: bytes) -> None:
        """Show a run as far as it is, by its ``run_data``."""
        script = self._script(TELL).replace("DATA", json.dumps(base64.b64encode(data).decode()))
        self._show(script, f"{self._name}-told", self._is_told)
        self._is_told = True

    def _script(self, text: str) -> str:
        return text.replace("NAME", json.dumps(self._name))


def _shown() -> Callable[[str, str, bool], None]:
    """Shows HTML under a name; True: in place of what has that name."""
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
