"""Tune the weight of calls for help: python optuna_tuning.py [TRIALS [DURATION_S]]."""

import sys
from statistics import fmean

import optuna
import remoras

TRIALS, DURATION_S = (*map(int, sys.argv[1:]), *(30, 7200)[len(sys.argv) - 1 :])
SEEDS = range(1001, 1005)  # none of these in a later study
WEIGHT = "decision.weight_external"


def mean_time_s(trial: optuna.Trial) -> float:
    keys = {"scenario.duration_s": DURATION_S, WEIGHT: trial.suggest_float(WEIGHT, 0.0, 4.0)}
    runs = (remoras.run("recovery-field", per=0.6, seed=seed, set=keys) for seed in SEEDS)
    return fmean(run.summary["mission_time_s"] for run in runs)  # an incomplete run counts DURATION_S


study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=1))
study.optimize(mean_time_s, n_trials=TRIALS)
print(study.best_params, f"{study.best_value:.0f} s")
