"""Value of help in a folder of the study ``help``: ``python -m benchmarks.help_value DIR``.

Planned contrast of a level of ``help`` with ``none``, for each share of escorted lines and each loss: ratio of the
mission times without and with, geometric mean over organisations and instances (incomplete runs count with the full
duration), 95 % interval by sign flips of the instances, which all organisations share.
"""

from __future__ import annotations

import math
import sys
from collections import defaultdict
from pathlib import Path
from statistics import fmean

from missions.statistics import NoInterval, difference_interval
from missions.sweeps.folder import SweepResults

HELP, SHARE = "strategy.parameters.help", "drawn_lines.escorted_share"


def ratios(results: SweepResults) -> dict[tuple[float, str, float], list[float]]:
    """Return, by share, level of help and loss, the mean log ratio of each instance."""
    times: dict[tuple[float, float, int, str], dict[str, float]] = defaultdict(dict)
    for line in results.lines.values():
        summary, settings = line["summary"], line["settings"]
        condition = settings[SHARE], summary["per"], line["repeat"], settings[HELP]
        time_s = summary["mission_time_s"] if summary.get("completed") else None
        times[condition][summary["strategy"]] = line["duration_s"] if time_s is None else time_s
    found: dict[tuple[float, str, float], list[float]] = defaultdict(list)
    for (share, per, repeat, level), helped in sorted(times.items()):
        alone = times.get((share, per, repeat, "none"), {})
        if level != "none" and helped.keys() == alone.keys():
            found[share, level, per].append(fmean(math.log(alone[name] / helped[name]) for name in helped))
    return found


if __name__ == "__main__":
    for (share, level, per), values in ratios(SweepResults.read(Path(sys.argv[1]))).items():
        found = difference_interval(values)
        bounds = "" if isinstance(found, NoInterval) else " ({:.2f} to {:.2f})".format(*map(math.exp, found))
        print(f"escorted {share}, {level}, PER {per}: {math.exp(fmean(values)):.2f}{bounds}, n = {len(values)}")
