"""Data model of the replay page (its scripts without a document), evaluated from Python."""

import base64
import html
import json
import random
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from browsing import CHROMIUM, QUIET

from missions.runs.results import Results, write_results
from missions.runs.run import run
from missions.scenarios import load
from missions.scenarios.parts import mission_of, strategy_of
from visualisation.replay import run_data
from visualisation.replay.page import MODEL, asset

NODE = shutil.which("node") or shutil.which("nodejs")
AT_ONCE = ("--virtual-time-budget=60000", "--dump-dom")
"""Lets Chromium print a page when its scripts have done all they do."""
LOSSY = "channel.per=0.6"
"""The setting of the run at which a page has to show most: six of ten packets are lost."""


def recorded(folder: Path, *settings: str, scenario: str = "mapping-rendezvous", seed: int = 1) -> Results:
    """Run of a scenario with additional settings, written and read back."""
    write_results(run(load(scenario, [("--set", one) for one in settings]), seed), folder)
    return Results.read(folder)


def data_of(results: Results) -> bytes:
    """Payload of a run, with all declarations of its mission."""
    mission, strategy = mission_of(results.scenario), strategy_of(results.scenario)
    return run_data(results, mission.places, mission.jobs.values(), strategy.declaration.communicates)


def moments_s(results: Results, n: int = 20) -> list[float]:
    """Random times of a run, in their order."""
    end_s = results.ended_s
    return sorted(random.Random(number).uniform(0.0, end_s) for number in range(n))


def asked(
    payloads: Sequence[bytes], function: str, folder: Path, given: object = None, more: Sequence[str] = ()
) -> Any:
    """Result of a JavaScript function of (runs, given), or of its promise, by node or else by Chromium.

    Args:
        payloads: data of the runs.
        function: text of an arrow function; what it returns has to be JSON, where Infinity is null.
        folder: for the files of this.
        given: JSON for the function.
        more: scripts that it needs beside those of the model.
    """
    scripts = [asset(name) for name in (*MODEL, *more)]
    texts = json.dumps([base64.b64encode(one).decode() for one in payloads])
    call = (
        f"Promise.all({texts}.map(R.decode)).then((runs) => ({function})(runs, {json.dumps(given)}))"
        ".then((found) => JSON.stringify(found))"
    )
    if NODE is not None:
        program = folder / "ask.js"
        program.write_text("\n".join([*scripts, f"{call}.then((text) => console.log(text));"]), encoding="utf-8")
        said = subprocess.run([NODE, str(program)], capture_output=True, text=True, timeout=120, check=False)
        assert said.returncode == 0, said.stderr[-2000:]
        return json.loads(said.stdout)
    if CHROMIUM is None:
        pytest.skip("neither node nor chromium is installed to run the scripts of the page")
    page = folder / "ask.html"
    body = "".join(f"<script>{script}</script>" for script in scripts)
    show = "(text) => { document.body.innerHTML = '<pre id=out></pre>'; document.body.firstChild.textContent = text; }"
    page.write_text(f"<meta charset=utf-8><body>{body}<script>{call}.then({show}, {show});</script>", encoding="utf-8")
    said = subprocess.run(
        [CHROMIUM, *QUIET, *AT_ONCE, page.as_uri()], capture_output=True, text=True, timeout=120, check=False
    )
    return json.loads(html.unescape(said.stdout.partition('<pre id="out">')[2].partition("</pre>")[0]))
