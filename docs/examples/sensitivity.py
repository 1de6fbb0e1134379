"""Sobol indices of three settings: python sensitivity.py [N [DURATION_S]], 5 N runs."""

import sys

import numpy as np
import remoras
from SALib.analyze import sobol as indices
from SALib.sample import sobol as design

N, DURATION_S = (*map(int, sys.argv[1:]), *(64, 600)[len(sys.argv) - 1 :])
NAMES = ["channel.per", "current.north_mps", "vehicle.AUV01.survey_speed_mps"]
PROBLEM = {"num_vars": 3, "names": NAMES, "bounds": [[0.0, 0.9], [0.0, 0.3], [0.4, 0.8]]}


def goal(point: np.ndarray) -> float:
    keys = {"scenario.duration_s": DURATION_S, **dict(zip(NAMES, point.tolist()))}
    return remoras.run("mapping-rendezvous", set=keys).metric("goal_fraction")


points = design.sample(PROBLEM, N, calc_second_order=False, seed=1)
found = indices.analyze(PROBLEM, np.array([goal(point) for point in points]), calc_second_order=False, seed=1)
for name, first, total, half in zip(NAMES, found["S1"], found["ST"], found["ST_conf"]):
    print(f"{name}: first order {first:.2f}, total {total:.2f} +- {half:.2f}")
