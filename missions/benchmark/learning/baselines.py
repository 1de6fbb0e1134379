"""Baselines: a greedy policy, and one that was learned on the split ``dev`` of ``fathom-1``.

Both take jobs and never leave one. The learned one is a line of weights over features of a job; the job of the highest
score is taken, if that is above 0. ``python -m benchmarks.learning`` learns them.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from missions.benchmark.learning.observing import JOB, MOST_JOBS, OWN, PEER, TAKE, Array, Sight
from missions.benchmark.learning.policies import strategy

WEIGHTS = Path(__file__).with_name("weights.json")
FEATURES = (
    "bias", "turn", "done_after", "nearer_peers", "others", "share_left", "from_rally", "held", "all_left", "planned",
)  # fmt: skip
"""Of a job: 1; whether it is the vehicle's turn; time to have done it (1000 s); peers that are nearer to it; others who
hold it; share left; way from it to the meeting (1000 m); jobs that the vehicle holds already; unfinished jobs (10);
whether the plan that the vehicle makes of what is vacant, for all members, has it do this one first."""
ROUND, PLACE, N_MEMBERS, N_HELD, N_UNFINISHED, RALLY_X, FREE_AFTER_S, TRANSIT_MPS = map(
    OWN.index,
    ("round", "place", "n_members", "n_held", "n_unfinished", "rally_x_m", "free_after_s", "transit_mps"),
)
N_OTHERS, SHARE_LEFT, X, DONE_AFTER_S = map(JOB.index, ("n_others", "share_left", "x_m", "done_after_s"))
IS_MEMBER, PEER_X, PEER_JOB = map(PEER.index, ("member", "x_m", "job"))


def greedy(seen: Sight) -> int:
    """At its turn, a vehicle without a job takes the vacant one that it would have done soonest."""
    own, jobs = seen["own"], seen["jobs"]
    if own[N_HELD] or own[ROUND] % max(1.0, own[N_MEMBERS]) != own[PLACE]:
        return 0
    may_take = seen["action_mask"][TAKE : TAKE + MOST_JOBS] == 1
    done_after_s = np.where(may_take & (jobs[:, N_OTHERS] == 0), jobs[:, DONE_AFTER_S], np.inf)
    row = int(done_after_s.argmin())
    return TAKE + row if done_after_s[row] < np.inf else 0


def features_of_jobs(seen: Sight) -> Array:
    """``FEATURES`` of each job, a row each."""
    own, jobs, peers = seen["own"], seen["jobs"], seen["peers"]
    places_m = jobs[:, X : X + 2]
    members_m = peers[peers[:, IS_MEMBER] == 1, PEER_X : PEER_X + 2]
    away_m = np.hypot(*places_m.T)
    theirs_m = np.hypot(*(places_m[:, None, :] - members_m[None, :, :]).transpose(2, 0, 1))
    is_turn = own[ROUND] % max(1.0, own[N_MEMBERS]) == own[PLACE]
    found = np.empty((MOST_JOBS, len(FEATURES)))
    found[:, 0], found[:, 1] = 1.0, is_turn
    found[:, 2] = jobs[:, DONE_AFTER_S] / 1000.0
    found[:, 3] = (theirs_m < away_m[:, None]).sum(axis=1)
    found[:, 4], found[:, 5] = jobs[:, N_OTHERS], jobs[:, SHARE_LEFT]
    found[:, 6] = np.hypot(*(places_m - own[RALLY_X : RALLY_X + 2]).T) / 1000.0
    found[:, 7], found[:, 8], found[:, 9] = own[N_HELD], own[N_UNFINISHED] / 10.0, 0.0
    if (first := planned_first(seen)) is not None:
        found[first, 9] = 1.0
    return found


def planned_first(seen: Sight) -> int | None:
    """Row of the job that a plan for all members has this vehicle do first; None if it has none.

    The longest job goes out first, to whoever would then have done its own first, as the bids of a contract net would
    have it (Graham 1969, list scheduling). Peers are taken to be like this vehicle, and where they were last known;
    who is at a job is free once its share left is done, which takes as long as the vacant ones do on average.
    """
    own, jobs, peers = seen["own"], seen["jobs"], seen["peers"]
    may_take = seen["action_mask"][TAKE : TAKE + MOST_JOBS] == 1
    vacant = [int(row) for row in np.flatnonzero(may_take & (jobs[:, N_OTHERS] == 0))]
    if not vacant:
        return None
    places, speed_mps = jobs[:, X : X + 2], max(0.1, float(own[TRANSIT_MPS]))
    work_s = {row: float(jobs[row, DONE_AFTER_S] - np.hypot(*places[row]) / speed_mps) for row in vacant}
    usual_s = sum(work_s.values()) / len(work_s)
    free_s, at = [float(own[FREE_AFTER_S])], [np.zeros(2)]
    for peer in peers[peers[:, IS_MEMBER] == 1]:
        job = int(peer[PEER_JOB])
        free_s.append(0.0 if job < 0 else float(jobs[job, SHARE_LEFT]) * usual_s)
        at.append(peer[PEER_X : PEER_X + 2] if job < 0 else places[job])
    mine = []
    for row in sorted(vacant, key=lambda row: (-work_s[row], row)):
        ends_s = [
            s + float(np.hypot(*(places[row] - m))) / speed_mps + work_s[row] for s, m in zip(free_s, at, strict=True)
        ]
        who = ends_s.index(min(ends_s))
        free_s[who], at[who] = ends_s[who], places[row]
        if who == 0:
            mine.append(row)
    return min(mine, key=lambda row: (float(np.hypot(*places[row])), row), default=None)


class Scorer:
    """A policy that takes the job of the highest score.

    Args:
        weights: of ``FEATURES``.
    """

    def __init__(self, weights: npt.ArrayLike) -> None:
        self._weights = np.asarray(weights, np.float64)

    def __call__(self, seen: Sight) -> int:
        may_take = seen["action_mask"][TAKE : TAKE + MOST_JOBS] == 1
        if not may_take.any():
            return 0
        scores = np.where(may_take, (features_of_jobs(seen) * self._weights).sum(axis=1), 0.0)
        row = int(scores.argmax())
        return TAKE + row if scores[row] > 0.0 else 0


def learned() -> dict[str, Any]:
    """What the learned policy is and came from: weights by feature, and how they were learned."""
    found: dict[str, Any] = json.loads(WEIGHTS.read_text(encoding="utf-8"))
    return found


GREEDY = strategy(greedy, "greedy")
LEARNED = strategy(Scorer([learned()["weights"][name] for name in FEATURES]), "learned")
