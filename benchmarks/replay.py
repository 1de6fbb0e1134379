"""Cost, size and pace of the replay page: processor time beside that of its run; bytes, first picture and frames per
second in headless Chromium, with 4 and 50 vehicles.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.measuring import row
from missions.runs.results import Results, write_results
from missions.runs.run import run
from missions.scenarios import load
from missions.scenarios.parts import mission_of
from visualisation.replay import page_text, run_data

CASES = (
    ("4 vehicles", "mapping-rendezvous", (), 60.0, 100.0),
    ("50 vehicles", "mapping-patches", ("fleet.size=50", "scenario.duration_s=3600"), 30.0, 1000.0),
)
"""Name, scenario, settings, frames per second wanted, kB of data wanted."""
PACE = "60"
LASTS_MS = 4000
FIRST_PICTURE_MS = 1000.0
MOST_OF_RUN = 0.5
"""Share of the processor time of a run that its page may take."""
N_TIMES = 3
COMMAND = (sys.executable, "-c", "from remoras.cli import main; main()")
ARGUMENTS = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run")
PLAY = """async ([pace, lasts_ms]) => {
  R.app.setPace(pace);
  R.app.select(R.app.runs[0].vehicles[1].name);
  R.app.clock.seek(300);
  R.app.clock.play();
  let n = 0;
  const began_ms = performance.now();
  while (performance.now() - began_ms < lasts_ms) { await new Promise(requestAnimationFrame); n += 1; }
  return 1000 * n / (performance.now() - began_ms);
}"""
FIRST = """() => {
  const paint = performance.getEntriesByType("paint").find((one) => one.name === "first-contentful-paint");
  return paint ? paint.startTime : 0;
}"""


def rows() -> list[dict[str, Any]]:
    """Benchmark rows; those of the browser are left out where Playwright or Chromium is missing."""
    return [_cost(), *_pace()]


def _cost() -> dict[str, Any]:
    """Processor time of ``remoras replay`` as a share of that of ``remoras run``; the least of some times of each."""
    with tempfile.TemporaryDirectory() as scratch:
        out = str(Path(scratch) / "run")
        run_s = min(
            _cpu_s("run", "mapping-rendezvous", "--per", "0.6", "--out", out, "--force") for _ in range(N_TIMES)
        )
        page_s = min(_cpu_s("replay", out, "--force") for _ in range(N_TIMES))
    return row("replay, processor time, share of run", page_s / run_s, "1", "wanted", MOST_OF_RUN)


def _cpu_s(*arguments: str) -> float:
    before = os.times()
    subprocess.run([*COMMAND, *arguments], check=True, capture_output=True)
    after = os.times()
    return (after.children_user - before.children_user) + (after.children_system - before.children_system)


def _pace() -> list[dict[str, Any]]:
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        return []
    if chromium is None:
        return []
    found: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as scratch, sync_playwright() as play:
        browser = play.chromium.launch(executable_path=chromium, args=list(ARGUMENTS))
        for number, (name, scenario, settings, wanted_fps, wanted_kb) in enumerate(CASES):
            folder = Path(scratch) / str(number)
            write_results(
                run(load(scenario, [("--set", setting) for setting in ("channel.per=0.6", *settings)]), 1), folder
            )
            results = Results.read(folder)
            mission = mission_of(results.scenario)
            data = run_data(results, mission.places, mission.jobs.values())
            file = folder / "replay.html"
            file.write_text(page_text(name, [data]), encoding="utf-8")
            page = browser.new_page(viewport={"width": 1280, "height": 720})
            page.goto(file.as_uri())
            page.wait_for_function("() => globalThis.R && R.app")
            found += [
                row(f"replay data, {name}", len(data) / 1000.0, "kB", "wanted", wanted_kb),
                row(f"replay, first picture, {name}", page.evaluate(FIRST), "ms", "wanted", FIRST_PICTURE_MS),
                row(f"replay, playing, {name}", page.evaluate(PLAY, [PACE, LASTS_MS]), "frame/s", "wanted", wanted_fps),
            ]
            page.close()
        browser.close()
    return found
