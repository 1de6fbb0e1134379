"""Metric: least distance of two vehicles."""

import itertools
import math

from remoras import Better, Metric


def closest_m(run):
    """Least distance of two vehicles at any time; None for a run without rows."""
    rows = run.recorder.rows("trajectories")
    by_time = itertools.groupby(rows, key=lambda row: row[0])
    places = [[row[2:4] for row in at_once] for time_s, at_once in by_time if time_s >= 60.0]
    return min((math.dist(a, b) for at_once in places for a, b in itertools.combinations(at_once, 2)), default=None)


CLOSEST = Metric("closest_m", "m", Better.HIGHER, "least distance", closest_m, note="After the first minute.")
