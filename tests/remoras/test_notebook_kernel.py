"""A notebook of ten cells in a real kernel, and the page of a run that goes on in one of them, in a real browser."""

import base64
import json
import struct
import zlib
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from browsing import Window

import remoras
from missions.errors import OutputError
from visualisation.output import DrawingError

pytestmark = pytest.mark.slow

CELLS = (
    "import remoras\nremoras.scenarios()",
    "scenario = remoras.load('mapping-rendezvous', per=0.6, set='scenario.duration_s=900')\nscenario",
    "run = remoras.run(scenario, seed=3)\nrun",
    "run.summary",
    "run.milestones",
    "run.table('roles').head()",
    "run.known('AUV02', at_s=50)",
    "run.plot('trajectories')",
    "run.graph('heard')",
    "steps = remoras.stepping('mapping-rendezvous', per=0.6, seed=3, set='scenario.duration_s=900')\nsteps.watch()",
)
LONGEST = 400
"""Characters of what is shown without a card, a picture or a page."""
RENDER = """(cells) => {
  for (const [name, text] of cells) {
    let cell = document.getElementById(`out-${name}`);
    if (!cell) { cell = document.createElement("div"); cell.id = `out-${name}`; document.body.append(cell); }
    cell.innerHTML = text;
    for (const old of cell.querySelectorAll("script")) {
      const script = document.createElement("script");
      script.textContent = old.textContent;
      old.replaceWith(script);
    }
  }
}"""
"""What JupyterLab does with HTML outputs of a cell: scripts in them are executed each time."""


class Kernel:
    """A kernel, and what each cell showed in it: (type of the message, content)."""

    def __init__(self, client: Any) -> None:
        self.client = client

    def shown(self, code: str) -> list[tuple[str, dict[str, Any]]]:
        found: list[tuple[str, dict[str, Any]]] = []

        def note(message: dict[str, Any]) -> None:
            assert message["msg_type"] != "error", message["content"]
            if "data" in message["content"]:
                found.append((message["msg_type"], message["content"]))

        self.client.execute_interactive(code, output_hook=note, timeout=120)
        return found

    def completions(self, code: str) -> list[str]:
        """Names that Tab offers behind a dot."""
        matches = self.client.complete(code, reply=True, timeout=60)["content"]["matches"]
        return [match.rpartition(".")[2] for match in matches]


@pytest.fixture(scope="module")
def kernel(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Kernel]:
    manager = pytest.importorskip("jupyter_client.manager")
    pytest.importorskip("ipykernel")
    started, client = manager.start_new_kernel(cwd=str(tmp_path_factory.mktemp("notebook")))
    yield Kernel(client)
    client.stop_channels()
    started.shutdown_kernel(now=True)


@pytest.fixture(scope="module")
def cells(kernel: Kernel) -> list[list[tuple[str, dict[str, Any]]]]:
    assert len(CELLS) == 10
    return [kernel.shown(code) for code in CELLS]


def test_what_each_cell_shows_is_short_or_more_than_text(cells: list[list[tuple[str, dict[str, Any]]]]) -> None:
    for code, outputs in zip(CELLS, cells, strict=True):
        assert outputs, code
        for _, content in outputs:
            rich = {"text/html", "image/png"} & set(content["data"])
            assert rich or len(content["data"]["text/plain"]) <= LONGEST, code


def test_tab_offers_own_names_only(cells: list[Any], kernel: Kernel) -> None:
    assert cells
    for code, value in (("remoras.", remoras), ("scenario.", remoras.Scenario), ("run.", remoras.Run)):
        offered = [
            name.rpartition(".")[2]
            for name in kernel.client.complete(code, reply=True, timeout=60)["content"]["matches"]
        ]
        assert len(offered) >= 8, code
        assert not {name for name in offered if name.startswith("_")}
        if value is remoras:
            assert set(offered) == set(remoras.__all__)
        else:
            foreign = {n for kind in value.__mro__ if kind.__module__.startswith("pydantic") for n in vars(kind)}
            assert not foreign & set(offered)


def blocks(outputs: list[tuple[str, dict[str, Any]]]) -> list[dict[str, Any]]:
    """What the scripts of a cell tell the page, but for the columns of numbers."""
    found = []
    for _, content in outputs:
        text = content["data"].get("text/html", "")
        if '] = "' in text:
            data = json.loads('"' + text.partition('] = "')[2].partition('"')[0] + '"')
            packed = zlib.decompress(base64.b64decode(data), -15)
            found.append(json.loads(packed[4 : 4 + struct.unpack_from("<I", packed)[0]]))
    return found


def test_the_page_in_a_cell_follows_the_run(
    cells: list[list[tuple[str, dict[str, Any]]]], kernel: Kernel, chrome: Any
) -> None:
    all_outputs = kernel.shown(CELLS[-1].replace("watch()", "watch(speed=600)"))
    outputs = [(kind, content) for kind, content in all_outputs if content.get("transient")]
    pages = [content["transient"]["display_id"] for _, content in outputs]
    assert len(set(pages)) == 2
    assert [kind for kind, _ in outputs[:2]] == ["display_data", "display_data"]
    assert {kind for kind, _ in outputs[2:]} == {"update_display_data"}
    told = blocks(outputs)
    assert len(told) >= 3  # 900 s at 600 a second: 1.5 s, every half second
    ends_s = [block["header"]["end_s"] for block in told]
    assert all(a < b for a, b in pairwise(ends_s))
    assert ends_s[-1] == 900
    assert [block["header"]["is_underway"] for block in told] == [True] * (len(told) - 1) + [False]
    window = Window(chrome.new_context(viewport={"width": 1280, "height": 900}).new_page())
    window.page.set_content("<!DOCTYPE html><title>cell</title>")
    html = [(one[1]["transient"]["display_id"], one[1]["data"]["text/html"]) for one in outputs]
    window.ask(RENDER, html[:2])
    frame = window.page.wait_for_selector("iframe").content_frame()
    frame.wait_for_function("(end) => globalThis.R && R.app && R.app.clock.end_s === end", arg=ends_s[0])
    frame.evaluate("() => { R.app.kept = true; }")
    window.ask(RENDER, html[2:4])
    frame.wait_for_function("(end) => R.app.clock.end_s === end", arg=ends_s[min(2, len(ends_s) - 1)])
    window.ask(RENDER, html[4:])
    frame.wait_for_function("() => R.app.clock.end_s === 900 && !R.app.clock.grows")
    assert frame.evaluate("() => R.app.kept")  # it was not loaded anew
    assert "900" in frame.evaluate("() => document.querySelector('.verdict').textContent")
    window.page.set_content("<!DOCTYPE html><title>opened again</title>")
    window.ask(RENDER, [html[0], html[-1]])
    frame = window.page.wait_for_selector("iframe").content_frame()
    frame.wait_for_function("() => globalThis.R && R.app && R.app.clock.end_s === 900")
    assert window.faults == []
    assert [url for url in window.requests if not url.startswith(("about:", "data:", "blob:"))] == []


def test_a_cell_that_is_interrupted_keeps_the_page_and_the_run_goes_on(kernel: Kernel) -> None:
    """The interruption comes from the cell itself, as the button of the notebook sends it to the process."""
    code = (
        "import os, signal, threading, remoras\n"
        "steps = remoras.stepping('mapping-rendezvous', per=0.6, seed=3, set='scenario.duration_s=300')\n"
        "timer = threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT))\n"
        "timer.start()\n"
        "try:\n    steps.watch(speed=50)\nexcept KeyboardInterrupt:\n    print('stopped')\n"
        "whole = remoras.run('mapping-rendezvous', per=0.6, seed=3, set='scenario.duration_s=300')\n"
        "after = steps.run()\n"
        "(after.summary == whole.summary, after.table('trajectories').equals(whole.table('trajectories')))"
    )
    outputs = kernel.shown(code)
    assert outputs[-1][1]["data"]["text/plain"] == "(True, True)"
    ends_s = [block["header"]["end_s"] for block in blocks(outputs)]
    assert 20 <= ends_s[-1] <= 100  # a second at 50 s a second


def test_without_a_notebook_it_says_what_to_do() -> None:
    steps = remoras.stepping("mapping-rendezvous", set="scenario.duration_s=5")
    with pytest.raises(DrawingError, match=r"^watch: this is no notebook; call run\(\)"):
        steps.watch()
    with pytest.raises(ValueError, match="speed is 0; allowed: above 0"):
        steps.watch(speed=0)
    assert steps.run().summary["mission_time_s"] == 5.0


def test_nothing_follows_from_a_step_that_was_interrupted(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    steps = remoras.stepping("mapping-rendezvous", set="scenario.duration_s=5")
    next(steps)
    underway = steps._underway

    def step() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(underway, "step", step)
    with pytest.raises(KeyboardInterrupt):
        next(steps)
    monkeypatch.undo()
    with pytest.raises(OutputError, match="interrupted within a step"):
        steps.run()
