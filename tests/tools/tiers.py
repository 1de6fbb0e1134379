"""Which tests are fast: written from how long each took.

    python -m pytest -n 2 --durations=0 --durations-min=0 > log.txt
    python -m tests.tools.tiers log.txt

Functions whose cases take more than a second in all are written to ``tests/tiers.toml``; those that take more than two
are slow, as if they were marked so. All others are fast: ``pytest -m fast tests/exchange``. Times are to be measured
while the machine does nothing else.
"""

from __future__ import annotations

import argparse
import re
from collections import defaultdict
from pathlib import Path

FILE = Path(__file__).parents[1] / "tiers.toml"
MODERATE_S, SLOW_S = 1.0, 2.0
_ROW = re.compile(r"^\s*([\d.]+)s (?:call|setup|teardown)\s+([^\s\[]+)", re.MULTILINE)
KEPT = ("tests/reference/",)
"""Where tests are asked by whoever asks any, however long they take."""
HEAD = """# Tests that are not fast, by function; written by tests/tools/tiers.py.
"""


def times_s(log: str) -> dict[str, float]:
    """Seconds that each function took in all its cases, by its name, of what ``--durations=0`` printed."""
    found: dict[str, float] = defaultdict(float)
    for seconds, name in _ROW.findall(log):
        found[name] += float(seconds)
    return found


def text(times: dict[str, float]) -> str:
    """The two lists."""
    names = sorted(times)
    slow = [name for name in names if times[name] > SLOW_S and not name.startswith(KEPT)]
    moderate = [name for name in names if times[name] > MODERATE_S and name not in slow]
    return HEAD + "\n".join(
        f"{key} = [\n" + "".join(f'    "{name}",\n' for name in of) + "]\n"
        for key, of in (("slow", slow), ("moderate", moderate))
    )


def main() -> None:
    """Write the file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", type=Path, help="what pytest printed with --durations=0")
    log = parser.parse_args().log
    times = times_s(log.read_text(encoding="utf-8"))
    if not times:
        parser.error(f"{log} has no times of tests: run pytest with --durations=0")
    FILE.write_text(text(times), encoding="utf-8")


if __name__ == "__main__":
    main()
