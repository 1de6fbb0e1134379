"""The live page in a notebook, with no server: a frame, and a script beside it that is replaced.

Two outputs of what is executed. The first is the page in a sandboxed frame, the second a script that hands it what has
come so far. Each script has all of it: whoever renders them may leave out scripts that are replaced at once, and a
notebook that is opened again has the last one. A frame that is rendered anew says that it is ready, and is told again.
"""

from __future__ import annotations

import base64
import json
import uuid
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from visualisation.output import DrawingError
from visualisation.replay.page import frame, notebook_text

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
