"""What one shows somebody, made anew in a folder: pages of runs at three widths, and a node that is killed five times.

    python -m tests.tools.shows FOLDER [pages] [killed]

``pages``: replays of 4 vehicles, of 32, and of a mission that failed, as ``NAME.html`` and ``NAME-WIDTH.png``, by
Chromium. ``killed``: the log of a node whose process is killed five times in a fleet of two, ``killed/AUV00.jsonl``,
and ``killed.txt``: what each of its lives said, and how the log repeats. The gallery, the notebooks and their figures
are pages of the documentation: ``python -m sphinx -b html docs FOLDER/site``.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import remoras
from missions.errors import MissionsError

WIDTHS = {390: 844, 768: 1024, 1280: 720}
"""Heights of windows by their widths."""
RUNS = {
    "four": ("mapping-rendezvous", {"channel.per": 0.6}),
    "thirty-two": ("mapping-rendezvous", {"channel.per": 0.3, "fleet.size": 32}),
    "failed": (
        "mapping-rendezvous",
        {
            "channel.per": 0.3,
            "strategy.name": "fixed-partition",
            "fault": [{"vehicle": "AUV01", "kind": "lost", "at_s": 600.0}],
        },
    ),
}
MOMENT = 0.45
"""Share of a run at which its page is shown."""
N_KILLS, SPEED, UNTIL_S, SETTLE_S = 5, 20.0, 500, 200
LINES_OF_A_LIFE, PATIENCE_S = 10, 60.0
"""A life is ended when the log has so many lines more, or after so long."""
COMMAND = [sys.executable, "-m", "remoras"]


def pages(folder: Path) -> list[Path]:
    """Pages of runs, and pictures of them."""
    sys.path.append(str(Path(__file__).parents[1]))
    from browsing import browser

    made = []
    for name, (scenario, settings) in RUNS.items():
        run = remoras.run(scenario, seed=3, set=settings, progress=False)
        made.append(folder / f"{name}.html")
        made[-1].write_text(run.replay().text, encoding="utf-8")
    with browser() as chrome:
        for file in made[:]:
            page = chrome.new_page()
            for width, height in WIDTHS.items():
                page.set_viewport_size({"width": width, "height": height})
                page.goto(file.as_uri())
                page.wait_for_function("() => globalThis.R && R.app && R.app.views.length")
                page.evaluate("(share) => R.app.clock.seek(share * R.app.clock.end_s)", MOMENT)
                made.append(folder / f"{file.stem}-{width}.png")
                page.screenshot(path=str(made[-1]))
            page.close()
    return made


def killed(folder: Path) -> list[Path]:
    """The log of a node that is killed, and what was said."""
    ports = {name: free_port() for name in ("ASV00", "AUV00")}
    start = time.monotonic() + 2.0
    out = folder / "killed"
    log = out / "AUV00.jsonl"

    def begin(name: str, *more: str) -> subprocess.Popen[str]:
        (other,) = set(ports) - {name}
        command = [
            *COMMAND, "node", "mapping-rendezvous", name, "--bind", f"127.0.0.1:{ports[name]}",
            "--peers", f"{other}=127.0.0.1:{ports[other]}", "--speed", f"{SPEED:g}", "--start", f"{start}",
            "--until", f"{UNTIL_S}", "--settle", f"{SETTLE_S}", "--json", *more,
        ]  # fmt: skip
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    ship, said = begin("ASV00"), []
    for life in range(N_KILLS + 1):
        node = begin("AUV00", "--out", str(out), "--resume")
        if life < N_KILLS:
            wait_for(log, lines(log) + LINES_OF_A_LIFE)
            os.kill(node.pid, signal.SIGKILL)
        printed, told = node.communicate()
        said.append(f"life {life}, exit {node.returncode}: {told.strip() or '-'}")
    outcomes = {"ASV00": json.loads(ship.communicate()[0]), "AUV00": json.loads(printed)}
    again = subprocess.run([*COMMAND, "replay-log", str(log)], capture_output=True, text=True, check=False)
    said += [f"{name}: {found['items']} items, state {found['state_hash']}" for name, found in outcomes.items()]
    said += ["they know the same" if len({one["state_hash"] for one in outcomes.values()}) == 1 else "THEY DIFFER"]
    said += [again.stdout.strip() + again.stderr.strip()]
    text = folder / "killed.txt"
    text.write_text("\n".join(said) + "\n", encoding="utf-8")
    return [log, text]


def lines(log: Path) -> int:
    """How many lines a log has."""
    return log.read_bytes().count(b"\n") if log.is_file() else 0


def wait_for(log: Path, n: int) -> None:
    """Wait until a log has so many lines."""
    until_s = time.monotonic() + PATIENCE_S
    while lines(log) < n and time.monotonic() < until_s:
        time.sleep(0.05)


def free_port() -> int:
    """A UDP port that nobody has."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


KINDS = {"pages": pages, "killed": killed}


def main() -> None:
    """Make what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("kinds", nargs="*", choices=[*KINDS, []], default=[])
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    for kind in asked.kinds or KINDS:
        try:
            print(*KINDS[kind](asked.folder), sep="\n")
        except (OSError, MissionsError) as error:
            sys.exit(f"shows {kind}: {error}")


if __name__ == "__main__":
    main()
