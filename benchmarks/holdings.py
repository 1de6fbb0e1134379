"""Ablate each mechanism of the policies that report received sets, in the policy study.

Each variant runs in its own process, because compiled code keeps the functions of its compilation. A line per load and
fleet gives the mean time until all nodes hold an item and until its origin knows it (slots, 95 % interval), the share
of items refused for lack of space, and false beliefs. Items have 60 bits, packets 256, headers included. A batch has 48
items in the fleet. Poisson load is 0.12 items per slot in the fleet, over 1000 frames after 1000, with a twentieth of
the trials.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import Any
from unittest import mock

from exchange.policy.planning import END_BITS
from exchange.policy.policies import ADAPTIVE, HOLDINGS, AckPolicy
from exchange.study import stating
from exchange.study.lanes import Case, n_columns_of
from exchange.study.parameters import ExchangeStudy, LoadKind, StudyLoad
from exchange.study.stating import Statements, count_owed, gather, look_through, note_brought, note_told, state_holdings
from exchange.study.study import StudyRow, run
from exchange.study.trials import Fleet, Slot, choose

CELLS = ((4, 0.4), (4, 0.8), (8, 0.8))
"""Nodes and loss rates."""
IN_FLEET, RATE_IN_FLEET, FRAMES = 48, 0.12, 1000
MOST_SLOTS = 4000
"""Of a trial, or behind its window: with holder sets out, some never come to know what all hold."""
TRIALS, POISSON_SHARE = 300, 20
SEED = 11


def compose_in_order(case: Case, fleet: Fleet, statements: Statements, slot: Slot, n_bits: int) -> tuple[int, int]:
    """`exchange.study.stating.compose_packet` without a plan: statements that are owed, and items that wait longest.

    Items go by the rule of the six policies, `exchange.study.trials.choose`; there are no symbols.
    """
    n_nodes, owner, place, plan = case.n_nodes, slot.owner, slot.place, statements.plan
    look_through(case, fleet, statements, owner)
    count_owed(case, fleet, statements, owner, slot.number)
    n_candidates = gather(case, fleet, statements, owner)
    left = case.capacity_bits - END_BITS - n_bits
    for step in range(n_nodes):
        origin = (slot.frame + step) % n_nodes
        plan.states[origin] = int(plan.owed[origin] > 0 and plan.statement_bits[origin] <= left)
        left -= plan.states[origin] * plan.statement_bits[origin]
    fleet.queued[:] = 0
    fleet.loaded[place, :] = 0
    for c in range(n_candidates):
        fleet.queued[statements.columns[c]] = 1
    choose(fleet.weights[0, owner], fleet.queued, fleet.loaded[place], 0, left // case.item_bits)
    n_sent = 0
    for column in range(n_columns_of(case)):
        if fleet.loaded[place, column] != 0:
            statements.brought[owner, n_sent] = column
            left -= case.item_bits
            n_sent += 1
    statements.n_brought[owner] = n_sent
    state_holdings(case, fleet, statements, owner, place, 0)
    stating.show_holders(case, fleet, statements, owner, slot.number, left)
    note_told(case, fleet, statements, owner, slot.number)
    note_brought(case, fleet, statements, owner, slot, 0)
    return n_sent, 0


def show_none(case: Case, fleet: Fleet, statements: Statements, owner: int, slot: int, room_bits: int) -> None:
    """Tell of no item who holds it."""
    statements.shown[:] = 0


@dataclass(frozen=True, slots=True)
class Variant:
    """A policy, and what stands in `exchange.study.stating` in place of what is there."""

    policy: AckPolicy
    instead: Mapping[str, Any] = field(default_factory=dict)


NO_HOLDER_SETS: Mapping[str, Any] = {"show_holders": show_none}
IN_ORDER: Mapping[str, Any] = {"compose_packet": compose_in_order}
VARIANTS = {
    "all": Variant(AckPolicy(ADAPTIVE, repeat=True)),
    "holder-sets-out": Variant(AckPolicy(ADAPTIVE, repeat=True), NO_HOLDER_SETS),
    "coding-out": Variant(AckPolicy(HOLDINGS, repeat=True)),
    "plan-out": Variant(AckPolicy(HOLDINGS, repeat=True), IN_ORDER),
    "telling-by-holders-out": Variant(AckPolicy(ADAPTIVE._replace(name="adaptive-origins"), repeat=False)),
    "statements-only": Variant(AckPolicy(HOLDINGS, repeat=False), {**NO_HOLDER_SETS, **IN_ORDER}),
}
"""By what is taken out. Symbols are planned, so without a plan there are none."""


def studies(policy: AckPolicy, trials: int) -> Iterator[ExchangeStudy]:
    """A study for each load and fleet."""
    for kind in LoadKind:
        for nodes, per in CELLS:
            n_trials, load = trials, StudyLoad()
            if kind is LoadKind.BATCH:
                load = StudyLoad(kind, items=IN_FLEET // nodes)
            elif kind is LoadKind.POISSON:
                n_trials, load = max(2, trials // POISSON_SHARE), StudyLoad(kind, rate=RATE_IN_FLEET / nodes)
            yield ExchangeStudy(
                nodes=nodes, per=(per,), policies=(policy,), trials=n_trials, load=load, capacity_bits=256,
                carrier_evidence=True, seed=SEED, warmup_frames=FRAMES, window_frames=FRAMES,
                max_slots=MOST_SLOTS + 2 * FRAMES * nodes * (kind is LoadKind.POISSON),
            )  # fmt: skip


def rows(name: str, trials: int) -> Iterator[StudyRow]:
    """The rows of a variant; once in a process, where the loop is compiled."""
    variant = VARIANTS[name]
    with ExitStack() as out:
        for key, value in variant.instead.items():
            out.enter_context(mock.patch.object(stating, key, value))
        for study in studies(variant.policy, trials):
            yield from run(study, say=lambda text: print(text, file=sys.stderr))


def main() -> int:
    """Play one variant here, or each of several in a process of its own."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.holdings", description=__doc__)
    parser.add_argument("name", nargs="*", help=f"of {', '.join(VARIANTS)}")
    parser.add_argument("--trials", type=int, default=TRIALS, help="of each load but Poisson, 2 or more")
    parser.add_argument("--json", action="store_true", help="print a JSON value in each line, a row")
    arguments = parser.parse_args()
    if unknown := sorted(set(arguments.name) - set(VARIANTS)):
        parser.error(f"unknown variant {', '.join(unknown)}: allowed are {', '.join(VARIANTS)}")
    if arguments.trials < 2:
        parser.error(f"--trials = {arguments.trials}: allowed: 2 or more")
    if len(arguments.name) != 1:
        given = [f"--trials={arguments.trials}", *(["--json"] if arguments.json else [])]
        for name in arguments.name or VARIANTS:
            subprocess.run([sys.executable, "-m", "benchmarks.holdings", name, *given], check=True)
        return 0
    for row in rows(arguments.name[0], arguments.trials):
        print(json.dumps({"variant": arguments.name[0], **row.as_json()}) if arguments.json else _line(row), flush=True)
    return 0


def _line(row: StudyRow) -> str:
    times = []
    for estimate in (row.delivered_slots, row.source_acked_slots):
        half = "" if estimate is None or estimate.ci95_high is None else f" ± {estimate.ci95_high - estimate.mean:.3g}"
        times.append("-" if estimate is None else f"{estimate.mean:.4g}{half}")
    refused = row.refused_fraction.mean if row.refused_fraction else 0.0
    return (
        f"{sys.argv[1]:<24} {row.load:<13} N {row.nodes:>2}  PER {row.per:g}  {times[0]:>16} /{times[1]:>16}  "
        f"n {row.trials}, refused {refused:.2f}, censored {row.censored_source}, false {row.false_beliefs}"
    )


if __name__ == "__main__":
    sys.exit(main())
